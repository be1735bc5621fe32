"""What the lines must keep to so that drivers step, and step the right way: times in ns.

Owns the rules as numbers, and what follows from them alone. The defaults are those of Gecko drives.
Source: the announcement of SiMAD, "Gecko drives have a funny requirement" (high 4000 ns, low
500 ns, step on the falling edge) and "satisfies setup time of 4uS".

[D] The announcement has no hold time: a driver is given as long as its step line is low.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from sacbus.simad.fault import SimadError

__all__ = ["GECKO", "Timing", "highest_rate"]

SECOND = 1_000_000_000

#: The longest that a rule may ask for: far above any driver, and sums of many stay whole numbers.
LONGEST = SECOND


@dataclass(frozen=True, slots=True)
class Timing:
    """The rules of a driver, in ns, 1 at least; ``hold`` may be 0. SimadError for others.

    low: how long a step line is low for a step, exactly. high: how long it is high before the next,
    at least. setup: how long DIR has been as it is before a step line falls, at least. hold: how
    long it stays so after that, at least.
    """

    low: int = 500
    high: int = 4_000
    setup: int = 4_000
    hold: int = 500

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            least = 0 if one.name == "hold" else 1
            if not least <= value <= LONGEST:
                raise SimadError(f"{one.name}: expected {least} to {LONGEST} ns, got {value}")

    @property
    def period(self) -> int:
        """The shortest time between two steps of one axis."""
        return self.low + self.high

    @property
    def until_turn(self) -> int:
        """From a fall until DIR may change: no step line is low then, and the hold time is over."""
        return max(self.low, self.hold)

    @property
    def turn(self) -> int:
        """The shortest time between two steps in opposite directions, of whatever axes."""
        return self.until_turn + self.setup


GECKO = Timing()


def highest_rate(timing: Timing = GECKO, directions: int = 1) -> float:
    """Steps per second that every axis can make for ever, on any number of axes.

    ``directions``: how many stretches of one direction there are while each axis steps once. One
    where all go the same way (Gecko: 222 222 steps/s), two where some go the other way (111 111):
    those of one direction step together. More where steps come in an order that keeps them apart,
    as four axes do that step by turns, each the other way than the one before: 55 555.
    """
    if directions < 1:
        raise SimadError(f"expected 1 direction or more, got {directions}")
    turns = timing.turn * directions if directions > 1 else 0
    return SECOND / max(timing.period, turns)
