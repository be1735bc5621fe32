"""The course of a profile: its legs one after the other, as one row of pulses.

Owns the search for the leg that runs. Times in ticks, pulses, and *travel* in finest microsteps
(drive.py), all from the beginning.
"""

from bisect import bisect_right
from collections.abc import Iterable
from itertools import accumulate
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
        """Nominal speed, real period and weight of the pulse."""
        return pace_of(self.leg, self.pulse)


class Course:
    """Legs in a row; only the last may go on for ever. Immutable.

    began, before, went: ticks, pulses and travel ahead of each leg, and of the end where there is
    one.
    """

    __slots__ = ("before", "began", "legs", "went")

    def __init__(self, legs: Iterable[Leg]) -> None:
        self.legs: Final = tuple(legs)
        began, before = [0], [0]
        for leg in self.legs:
            if leg.count is not None and leg.ticks is not None:
                before.append(before[-1] + leg.count)
                began.append(began[-1] + leg.ticks)
        self.began: Final = tuple(began)
        self.before: Final = tuple(before)
        # Where every pulse is a finest microstep, travel is the number of pulses.
        self.went = self.before
        if any(leg.weight != 1 for leg in self.legs):
            steps = ((leg.count or 0) * leg.weight for leg in self.legs[: len(before) - 1])
            self.went = tuple(accumulate(steps, initial=0))

    @property
    def pulses(self) -> int | None:
        """All pulses; None = for ever."""
        return self.before[-1] if len(self.before) > len(self.legs) else None

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
        at = self._leg_of(pulse)
        return Place(self.legs[at], pulse - self.before[at])

    def time(self, pulse: int) -> int:
        """When a pulse is issued; that after the last one is the end."""
        if pulse == self.pulses:
            return self.began[-1]
        at = self._leg_of(pulse)
        return self.began[at] + self.legs[at].time(pulse - self.before[at])

    def travel(self, pulses: int) -> int:
        """Microsteps that the first so many pulses turn the motor by."""
        if pulses == self.pulses:
            return self.went[-1]
        at = self._leg_of(pulses)
        return self.went[at] + (pulses - self.before[at]) * self.legs[at].weight

    def pulse_after(self, travel: int) -> int:
        """The pulse that goes on from a travel which the course comes past."""
        at = bisect_right(self.went, travel, 0, len(self.legs)) - 1
        return self.before[at] + (travel - self.went[at]) // self.legs[at].weight

    def times(self, since: int, until: int) -> Ticks64:
        """The times of all pulses in [since, until), rising."""
        low, high = self._issued_before(since), self._issued_before(until)
        out = np.empty(max(0, high - low), dtype=np.int64)
        at = self._leg_of(low)
        done = 0
        while done < out.size:
            leg, before = self.legs[at], self.before[at]
            begin = low + done - before
            upto = out.size if leg.count is None else min(out.size, before + leg.count - low)
            leg.write(begin, out[done:upto], self.began[at])
            done = upto
            at += 1
        return out

    def legs_of_first(self, pulses: int) -> list[Leg]:
        """The legs of the first `pulses` pulses, the last one cut off where they end."""
        legs: list[Leg] = []
        for leg, before in zip(self.legs, self.before, strict=False):
            if before >= pulses:
                break
            whole = leg.count is not None and before + leg.count <= pulses
            legs.append(leg if whole else leg.first(pulses - before))
        return legs

    def legs_after(self, pulses: int) -> list[Leg]:
        """The legs without the first `pulses` pulses; some are left."""
        at = self._leg_of(pulses)
        skipped = pulses - self.before[at]
        return [self.legs[at].after(skipped) if skipped else self.legs[at], *self.legs[at + 1 :]]

    def pulses_in(self, state: State) -> int:
        """Pulses of the finite legs in a state."""
        return sum(leg.count or 0 for leg in self.legs if leg.state is state)

    def _leg_at(self, ticks: int) -> int:
        return bisect_right(self.began, ticks, 0, len(self.legs)) - 1

    def _leg_of(self, pulse: int) -> int:
        return bisect_right(self.before, pulse, 0, len(self.legs)) - 1

    def _issued_before(self, ticks: int) -> int:
        """Pulses issued earlier than a time."""
        if ticks <= 0 or not self.legs:
            return 0
        if self.pulses is not None and ticks > self.began[-1]:
            return self.before[-1]
        return self.pulse_running(ticks - 1) + 1
