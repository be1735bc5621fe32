"""The course of a profile: its legs one after the other, as one row of pulses.

Owns the search for the leg that runs. Times in ticks and pulses from the beginning.
"""

from bisect import bisect_right
from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np

from sacbus.motion.layout import Pace, pace_of
from sacbus.motion.legs import Leg, State
from sacbus.motion.ramp import Ticks64


class Place(NamedTuple):
    """A pulse, as its leg knows it."""

    leg: Leg
    pulse: int

    @property
    def pace(self) -> Pace:
        """Nominal speed and real period of the pulse."""
        return pace_of(self.leg, self.pulse)


class Course:
    """Legs in a row; only the last may go on for ever. Immutable.

    began, before: ticks and pulses ahead of each leg, and of the end where there is one.
    """

    __slots__ = ("before", "began", "legs")

    def __init__(self, legs: Iterable[Leg]) -> None:
        self.legs: Final = tuple(legs)
        began, before = [0], [0]
        for leg in self.legs:
            if leg.count is not None and leg.ticks is not None:
                before.append(before[-1] + leg.count)
                began.append(began[-1] + leg.ticks)
        self.began: Final = began
        self.before: Final = before

    def pulse_running(self, ticks: int) -> int:
        """The pulse whose period runs at a time from 0 up to the end."""
        at = self._leg_at(ticks)
        return self.before[at] + self.legs[at].running(ticks - self.began[at])

    def place_at(self, ticks: int) -> Place:
        """Leg and pulse that run at a time from 0 up to the end."""
        at = self._leg_at(ticks)
        return Place(self.legs[at], self.legs[at].running(ticks - self.began[at]))

    def place_of(self, pulse: int) -> Place:
        """Leg of a pulse of the course."""
        at = bisect_right(self.before, pulse, 0, len(self.legs)) - 1
        return Place(self.legs[at], pulse - self.before[at])

    def time(self, pulse: int) -> int:
        """When a pulse is issued; that after the last one is the end."""
        at = bisect_right(self.before, pulse) - 1
        if at == len(self.legs):
            return self.began[at]
        return self.began[at] + self.legs[at].time(pulse - self.before[at])

    def times(self, since: int, until: int) -> Ticks64:
        """The times of all pulses in [since, until), rising."""
        parts: list[Ticks64] = []
        for at in range(max(0, bisect_right(self.began, since) - 1), len(self.legs)):
            began = self.began[at]
            if began >= until:
                break
            leg = self.legs[at]
            low, high = _issued_before(leg, since - began), _issued_before(leg, until - began)
            if low < high:
                parts.append(leg.times(low, high) + began)
        return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)

    def legs_of_first(self, pulses: int) -> list[Leg]:
        """The legs of the first `pulses` pulses, the last one cut off where they end."""
        legs: list[Leg] = []
        for leg, before in zip(self.legs, self.before, strict=False):
            if before >= pulses:
                break
            whole = leg.count is not None and before + leg.count <= pulses
            legs.append(leg if whole else leg.first(pulses - before))
        return legs

    def pulses_in(self, state: State) -> int:
        """Pulses of the finite legs in a state."""
        return sum(leg.count or 0 for leg in self.legs if leg.state is state)

    def _leg_at(self, ticks: int) -> int:
        return bisect_right(self.began, ticks, 0, len(self.legs)) - 1


def _issued_before(leg: Leg, ticks: int) -> int:
    """Pulses of a leg issued earlier than a time from its beginning."""
    if ticks <= 0:
        return 0
    if leg.ticks is not None and ticks > leg.ticks:
        ticks = leg.ticks
    return leg.running(ticks - 1) + 1
