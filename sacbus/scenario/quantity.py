"""Bounds and bytes as people write them, ``[399, 401]``, ``"^18 0c"``, and times in a scenario.

Owns these notations, both ways; that of times is the bus's (``sacbus/bus/duration.py``). A
QuantityError says what was expected and what came; who asked adds the place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import inf, isfinite
from typing import TypeGuard

from sacbus.bus.duration import DurationError, duration
from sacbus.config.keys import shown
from sacbus.kernel import Ns

__all__ = ["Bounds", "QuantityError", "bounds", "marked_bytes", "nanoseconds"]


class QuantityError(ValueError):
    """A text or value that is no such quantity; the text is ``expected …, got …``."""


def nanoseconds(value: object) -> Ns:
    """``"1.5 s"`` in ns, as :func:`~sacbus.bus.duration.duration` reads it."""
    try:
        return duration(value)
    except DurationError as wrong:
        raise QuantityError(f"expected {wrong.expected}, got {shown(value)}") from wrong


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
    raise QuantityError(
        f'expected a number, [low, high] such as [3, 5], "<= 3" or ">= 3", got {shown(value)}'
    )


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
