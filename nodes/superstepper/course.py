"""The course of a motion: stretches of periods one after the other, and every step on them.

Owns the questions that a motion answers: how many steps have been issued at a tick, when a step is
issued, which period runs, what its value is. A period is half low and half high: the step comes in
its middle, where the output rises, and the output falls again at the end of the period, as the
timer's two halves have it (manual, "How to compute Speed"). Ticks are those of the 4 MHz timer,
from the beginning of the course on.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from nodes.superstepper.ramp import Ramp

if TYPE_CHECKING:
    from nodes.superstepper.ramp import Ticks

__all__ = ["ACCEL", "CRUISE", "DECEL", "Course", "Stretch"]

ACCEL: Final = "ACCEL"
CRUISE: Final = "CRUISE"
DECEL: Final = "DECEL"


class Stretch(NamedTuple):
    """Periods of one kind. ``periods``: how many; None: for ever.

    Without a ``ramp`` all of ``value``; with one its first so many, read ``backwards`` its last so
    many from the end on. ``sign``: 1 clockwise, -1 counterclockwise.
    """

    state: str
    sign: int
    value: int
    divider: int
    periods: int | None
    ramp: Ramp | None = None
    backwards: bool = False

    @property
    def duration(self) -> int | None:
        """What they take together."""
        return None if self.periods is None else self.begin(self.periods)

    def begin(self, number: int) -> int:
        """When a period begins."""
        if self.ramp is None:
            return 2 * self.divider * self.value * number
        if not self.backwards:
            return self.ramp.begin(number)
        return self.ramp.duration - self.ramp.begin(self.ramp.periods - number)

    def begins(self, numbers: Ticks) -> Ticks:
        """:meth:`begin` of many."""
        if self.ramp is None:
            return 2 * self.divider * self.value * numbers
        if not self.backwards:
            return self.ramp.begins(numbers)
        return self.ramp.duration - self.ramp.begins(self.ramp.periods - numbers)

    def number_at(self, tick: int) -> int:
        """The period that runs at a tick."""
        if self.ramp is None:
            return tick // (2 * self.divider * self.value)
        if not self.backwards:
            return self.ramp.number_at(tick)
        # The last tick of a period read backwards is its first.
        return self.ramp.periods - 1 - self.ramp.number_at(self.ramp.duration - tick - 1)

    def value_of(self, number: int) -> int:
        """The speed value of a period."""
        if self.ramp is None:
            return self.value
        if self.backwards:
            number = self.ramp.periods - 1 - number
        return self.ramp.value(number)


class Running(NamedTuple):
    """The period that runs at a tick: of which stretch, its number there, when it began."""

    stretch: Stretch
    number: int
    begin: int

    @property
    def half(self) -> int:
        """Half of it, in ticks."""
        return self.stretch.divider * self.stretch.value_of(self.number)


class Course:
    """Stretches one after the other; those that hold nothing are left out."""

    __slots__ = ("_began", "_firsts", "duration", "steps", "stretches")

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        self.stretches = tuple(one for one in stretches if one.periods != 0)
        #: When each stretch begins, and how many steps come before it.
        self._began: list[int] = []
        self._firsts: list[int] = []
        tick, steps = 0, 0
        #: What it takes, and how many steps it has; None where it never ends.
        self.duration: int | None = None
        self.steps: int | None = None
        for one in self.stretches:
            self._began.append(tick)
            self._firsts.append(steps)
            duration = one.duration
            if duration is None or one.periods is None:
                return
            tick += duration
            steps += one.periods
        self.duration, self.steps = tick, steps

    def running(self, tick: int) -> Running | None:
        """The period that runs at a tick from 0 on; None once all is over."""
        if self.duration is not None and tick >= self.duration:
            return None
        place = bisect_right(self._began, tick) - 1
        stretch, began = self.stretches[place], self._began[place]
        number = stretch.number_at(tick - began)
        return Running(stretch, number, began + stretch.begin(number))

    def steps_at(self, tick: int) -> int:
        """Steps that have been issued up to and with a tick."""
        if tick < 0:
            return 0
        if self.duration is not None and tick >= self.duration:
            assert self.steps is not None  # a course that ends has so many
            return self.steps
        place = bisect_right(self._began, tick) - 1
        stretch, began = self.stretches[place], self._began[place]
        number = stretch.number_at(tick - began)
        half = stretch.divider * stretch.value_of(number)
        issued = tick - began - stretch.begin(number) >= half
        return self._firsts[place] + number + issued

    def travel_at(self, tick: int) -> int:
        """The same with the signs of their directions."""
        return self._travel(self.steps_at(tick))

    def _travel(self, steps: int) -> int:
        travel = 0
        for place, stretch in enumerate(self.stretches):
            count = steps - self._firsts[place]
            if count <= 0:
                break
            if stretch.periods is not None:
                count = min(count, stretch.periods)
            travel += stretch.sign * count
        return travel

    @property
    def turn(self) -> int | None:
        """When its direction changes first; None when it does not."""
        for tick, one in zip(self._began, self.stretches, strict=True):
            if one.sign != self.stretches[0].sign:
                return tick
        return None

    def after_turn(self) -> tuple[int, Course]:
        """When its direction changes, and what comes then."""
        tick = self.turn
        assert tick is not None  # whoever asks has looked
        return tick, Course(self.stretches[self._began.index(tick) :])

    def sign_at(self, tick: int, before: int) -> int:
        """The direction of the period that runs at a tick, or of the last; ``before`` the first."""
        if tick < 0 or not self.stretches:
            return before
        return self.stretches[bisect_right(self._began, tick) - 1].sign

    def time_of(self, step: int) -> int:
        """When a step is issued; they count from 0. IndexError where there is none."""
        if step < 0 or (self.steps is not None and step >= self.steps):
            raise IndexError(f"no step {step} in a course of {self.steps}")
        place = bisect_right(self._firsts, step) - 1
        stretch = self.stretches[place]
        number = step - self._firsts[place]
        half = stretch.divider * stretch.value_of(number)
        return self._began[place] + stretch.begin(number) + half

    def step_times(self, since: int, until: int) -> Ticks:
        """When steps are issued in [since, until), rising."""
        return self._middles(since, until)[0]

    def step_ends(self, since: int, until: int) -> Ticks:
        """When the output falls again after each of these."""
        return self._middles(since, until)[1]

    def _middles(self, since: int, until: int) -> tuple[Ticks, Ticks]:
        first, last = self.steps_at(since - 1), self.steps_at(until - 1)
        rises, falls = [], []
        for place, stretch in enumerate(self.stretches):
            before = self._firsts[place]
            low, high = max(first - before, 0), last - before
            if stretch.periods is not None:
                high = min(high, stretch.periods)
            if low >= high:
                continue
            edges = stretch.begins(np.arange(low, high + 1, dtype=np.int64)) + self._began[place]
            rises.append((edges[:-1] + edges[1:]) // 2)
            falls.append(edges[1:])
        return _joined(rises), _joined(falls)

    def states(self) -> list[tuple[int, str]]:
        """From which tick on it is in which state."""
        return [(tick, one.state) for tick, one in zip(self._began, self.stretches, strict=True)]


def _joined(parts: list[Ticks]) -> Ticks:
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)
