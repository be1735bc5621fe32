"""The exact pulses of an axis in a block: when each comes, and where the axis is then.

Owns the walk through the commands of a run, with oscillators that are exact. Pulses are worked out
for a span of time at once and not kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sacbus.motion import REST, Left, Profile, begin, plan, release
from sacbus.toolpath.block import AxisRun
from sacbus.toolpath.machine import Axis

__all__ = ["Pulses"]

Times = NDArray[np.int64]
Places = NDArray[np.float64]


class Pulses:
    """The pulses of a run.

    profiles: of its commands, in order.
    """

    def __init__(self, axis: Axis, run: AxisRun) -> None:
        self._axis: Final = axis
        self._run: Final = run
        self.profiles: Final = tuple(_profiles(axis, run))
        #: Microsteps, signed, before each command, and behind the last.
        self._before = tuple(accumulate((self._signed(one) for one in self.profiles), initial=0))

    @property
    def count(self) -> int:
        """How many there are."""
        return sum(profile.pulses or 0 for profile in self.profiles)

    def times(self, since: int, until: int) -> Times:
        """When those in [since, until) come, in ticks from the release, rising."""
        found = [
            profile.pulse_times(max(0, since - start), until - start) + start
            for _, start, profile in self._within(since, until)
        ]
        return np.concatenate(found) if found else np.empty(0, np.int64)

    def places(self, since: int, until: int) -> Places:
        """Where the axis is after each of them: full steps from the beginning, signed."""
        found = []
        for at, start, profile in self._within(since, until):
            done = profile.pulses_at(since - start - 1)
            upto = profile.pulses_at(until - start - 1)
            travel = self._travel(profile, done, upto)
            found.append(self._before[at] + (travel if self._forward(profile) else -travel))
        return np.concatenate(found) / self._axis.drive.m if found else np.empty(0)

    def place_at(self, ticks: int) -> float:
        """Where the axis is at a time, the pulses issued then included."""
        microsteps = 0
        for start, profile in zip(self._run.starts, self.profiles, strict=True):
            gone = profile.travel_at(ticks - start)
            microsteps += gone if self._forward(profile) else -gone
        return microsteps / self._axis.drive.m

    def _within(self, since: int, until: int) -> Iterator[tuple[int, int, Profile]]:
        """The commands that run in a span: number, start, profile."""
        for at, (start, profile) in enumerate(zip(self._run.starts, self.profiles, strict=True)):
            if start < until and start + (profile.duration or 0) > since:
                yield at, start, profile

    def _forward(self, profile: Profile) -> bool:
        return profile.motion.cw is not self._axis.inverted

    def _signed(self, profile: Profile) -> int:
        microsteps = profile.travel_at(profile.duration or 0)
        return microsteps if self._forward(profile) else -microsteps

    def _travel(self, profile: Profile, done: int, upto: int) -> Times:
        """Microsteps of a command after its pulse ``done`` and those that follow, up to one."""
        count = np.arange(done + 1, upto + 1, dtype=np.int64)
        if not self._axis.drive.auto_micro:
            return count
        course = profile.course
        return np.array([course.travel(int(one)) for one in count], dtype=np.int64)


def _profiles(axis: Axis, run: AxisRun) -> Iterator[Profile]:
    left: Left = REST
    end = 0
    for at, motion in enumerate(run.motions):
        beginning = begin(motion, left, end) if at else release(motion, 0)
        profile = plan(motion, axis.drive, beginning.start_rpm)
        assert profile.duration is not None  # it has steps
        left, end = Left.by(profile), beginning.start + profile.duration
        yield profile
