"""Times as people write them, ``"250 ms"``: in scenarios, of faults, at the command line.

Owns the notation, both ways, and what is said of what is none. Times are whole ns: what a text says
beyond that is refused, never rounded.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Final

from sacbus.kernel import MS, SECOND, US, Ns

__all__ = ["LONGEST", "TIME", "DurationError", "duration", "time_text"]

#: How a time is asked for.
TIME: Final = 'a time such as "250 ms" (ns, us, ms, s, min, h)'

#: The longest time, a year: bus time in float seconds is exact to 4 ns until then.
LONGEST: Final[Ns] = 366 * 24 * 3_600 * SECOND

_UNITS: Final = {
    "ns": 1,
    "us": US,
    "µs": US,
    "ms": MS,
    "s": SECOND,
    "min": 60 * SECOND,
    "h": 3_600 * SECOND,
}
_TIME: Final = re.compile(r"\s*([0-9]{1,20}(?:\.[0-9]{1,12})?)\s*([a-zµ]+)\s*")


class DurationError(ValueError):
    """A value that is no time. ``expected``: what would be one; who asked adds place and value."""

    def __init__(self, expected: str) -> None:
        super().__init__(expected)
        self.expected = expected


def duration(value: object) -> Ns:
    """``"1.5 s"`` in ns; DurationError for what is none. 0 needs its unit: nobody has to guess."""
    found = _TIME.fullmatch(value) if isinstance(value, str) else None
    if found is None or found[2] not in _UNITS:
        raise DurationError(TIME)
    ns = Fraction(found[1]) * _UNITS[found[2]]
    if ns.denominator != 1:
        raise DurationError("a whole number of ns")
    if ns > LONGEST:
        raise DurationError("a time of at most a year")
    return int(ns)


def time_text(ns: Ns) -> str:
    """A time in the largest unit that fits into it, exactly: ``250 ms``, ``1.5 s``, ``0 s``."""
    for unit, size in (("s", SECOND), ("ms", MS), ("us", US)):
        if ns >= size:
            whole, rest = divmod(ns, size)
            # The digits of the rest, with the zeros before them that the 1 of ``size`` holds up.
            digits = f"{size + rest}"[1:].rstrip("0")
            return f"{whole}.{digits} {unit}" if digits else f"{whole} {unit}"
    return f"{ns} ns" if ns else "0 s"
