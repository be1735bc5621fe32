"""Times, bounds and bytes as people write them: ``"250 ms"``, ``[399, 401]``, ``"^18 0c"``.

Owns these notations, both ways. A QuantityError says what was expected and what came; who asked
adds the place. Times are whole ns: what a text says beyond that is refused, never rounded.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from math import inf, isfinite
from typing import Final, TypeGuard

from sacbus.config.keys import shown
from sacbus.kernel import MS, SECOND, US, Ns

__all__ = [
    "LONGEST",
    "TIME",
    "Bounds",
    "QuantityError",
    "bounds",
    "marked_bytes",
    "nanoseconds",
    "time_text",
]

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


class QuantityError(ValueError):
    """A text or value that is no such quantity; the text is ``expected …, got …``."""


def nanoseconds(value: object) -> Ns:
    """``"1.5 s"`` in ns. 0 needs its unit as well, so that nobody has to guess."""
    found = _TIME.fullmatch(value) if isinstance(value, str) else None
    if found is None or found[2] not in _UNITS:
        raise QuantityError(f"expected {TIME}, got {shown(value)}")
    ns = Fraction(found[1]) * _UNITS[found[2]]
    if ns.denominator != 1:
        raise QuantityError(f"expected a whole number of ns, got {shown(value)}")
    if ns > LONGEST:
        raise QuantityError(f"expected a time of at most a year, got {shown(value)}")
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


@dataclass(frozen=True, slots=True)
class Bounds:
    """A number that is expected: from ``low`` to ``high``, both included."""

    low: float
    high: float

    @classmethod
    def exactly(cls, value: float) -> Bounds:
        """This number alone."""
        return cls(value, value)

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high

    def __str__(self) -> str:
        if self.low == self.high:
            return f"{self.low:g}"
        if self.low == -inf:
            return f"at most {self.high:g}"
        if self.high == inf:
            return f"at least {self.low:g}"
        return f"{self.low:g} to {self.high:g}"


def bounds(value: object) -> Bounds:
    """A number, ``[low, high]``, or ``"<= 3"`` and ``">= 3"``."""
    if _is_number(value):
        return Bounds.exactly(value)
    if isinstance(value, list) and len(value) == 2:
        low, high = value
        if _is_number(low) and _is_number(high) and low <= high:
            return Bounds(low, high)
    if isinstance(value, str) and (
        found := re.fullmatch(r"\s*([<>])=\s*(-?\d+(\.\d+)?)\s*", value)
    ):
        limit = float(found[2])
        return Bounds(-inf, limit) if found[1] == "<" else Bounds(limit, inf)
    raise QuantityError(f'expected a number, [low, high], "<= 3" or ">= 3", got {shown(value)}')


def marked_bytes(text: str) -> tuple[bytes, bytes | None]:
    """``^18 04 0f``: bytes, and the ninth bit of each, which is 1 behind a ``^``; None: no such.

    QuantityError for what is no bytes in hexadecimal, and for a ``^`` without a byte behind it.
    """
    marked, data = bytearray(), bytearray()
    for place, part in enumerate(text.split("^")):
        try:
            run = bytes.fromhex(part)
        except ValueError:
            run = b""
        if not run and (place or part.strip()):
            raise QuantityError(f"expected bytes in hexadecimal, got {shown(text)}")
        marked += bytes((1, *bytes(len(run) - 1))) if place else bytes(len(run))
        data += run
    return bytes(data), bytes(marked) if "^" in text else None


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
