"""When each step can fall: the earliest instant that keeps every rule.

Owns the recurrence. A step falls when it is due, but no earlier than a period after the one before
it on its axis, and a set-up time after DIR turned for its stretch, which it did as soon as it could
after the last fall of the stretch before:

    fall = max(due, fall before on the axis + period, ready of its stretch)
    ready of a stretch = last fall of the stretch before + turn

That looks like a loop, but each part is a running maximum: x[i] = max(a[i], x[i-1] + gap[i]) is
solved by the greatest (a - sum of gaps) so far, plus the sum of gaps. First each axis by itself;
then the stretches, one after the other, of which only the last fall and the number of steps of the
busiest axis count; then each step has its stretch's ready plus the periods of those before it.
That is exact where a turn of DIR takes no less than a period, as Gecko's does (4.5 us both): what
an axis did before the turn is over then. Where a period is longer, an axis may have to wait across
the turn: the whole is then repeated with what was found, which only ever moves steps later, until
nothing moves. Where too many such waits hang on one another, the steps are walked through instead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from sacbus.simad.order import Numbers
    from sacbus.simad.steps import Axes, Times
    from sacbus.simad.timing import Timing

__all__ = ["NEVER", "Progress"]

#: Longer ago than anything.
NEVER: Final = -(1 << 61)

#: How often the whole is repeated before it is walked through.
ROUNDS: Final = 12


class Progress:
    """How far the lines have got: what the steps to come have to wait for. Times in ns.

    ready: from when on a step in the present direction may fall. last: when the last step of the
    present stretch falls. axes: when each axis's last step falls.
    """

    __slots__ = ("axes", "last", "ready", "timing")

    def __init__(self, axes: int, timing: Timing) -> None:
        self.timing = timing
        self.ready = NEVER
        self.last = NEVER
        self.axes = [NEVER] * axes

    def take(
        self, times: Times, axes: Axes, numbers: Numbers, by_axis: Numbers
    ) -> tuple[Times, Times]:
        """When steps fall that are due at ``times``, and when DIR turns before each new stretch.

        The steps in the order in which they are taken, at least one; ``numbers``: of their
        stretches, none left out, of which 0 is the present one. ``by_axis``: the places of the
        steps in the order of the axes.
        """
        spans = self._spans(axes)
        falls = self._of_axes(times, by_axis, spans)
        inner = _within(numbers[by_axis], spans)
        before = np.empty_like(inner)
        before[by_axis] = inner
        for _ in range(ROUNDS):
            falls, lasts, ready = self._of_stretches(falls, numbers, before)
            if self.timing.period <= self.timing.turn:
                break
            again = self._of_axes(falls, by_axis, spans)
            if (again == falls).all():
                break
            falls = again
        else:
            falls, lasts, ready = self._walked(times, axes, numbers)
        in_order = falls[by_axis]
        for axis, (begin, end) in enumerate(spans):
            if end > begin:
                self.axes[axis] = int(in_order[end - 1])
        self.last, self.ready = int(lasts[-1]), int(ready[-1])
        return falls, lasts[:-1] + self.timing.until_turn

    def _spans(self, axes: Axes) -> list[tuple[int, int]]:
        """From where to where each axis stands among the steps in the order of the axes."""
        ends = np.cumsum(np.bincount(axes, minlength=len(self.axes))).tolist()
        return list(zip([0, *ends], ends, strict=False))

    def _of_axes(self, times: Times, by_axis: Numbers, spans: list[tuple[int, int]]) -> Times:
        """When steps would fall if only the axes' own periods counted."""
        due = times[by_axis]
        period = self.timing.period
        for axis, (begin, end) in enumerate(spans):
            if end > begin:
                mine = due[begin:end]
                mine[0] = max(int(mine[0]), self.axes[axis] + period)
                gaps = np.arange(0, period * mine.size, period)
                mine -= gaps
                np.maximum.accumulate(mine, out=mine)
                mine += gaps
        falls = np.empty_like(times)
        falls[by_axis] = due
        return falls

    def _of_stretches(
        self, falls: Times, numbers: Numbers, before: Numbers
    ) -> tuple[Times, Times, Times]:
        """When steps fall if DIR has to turn as well; the stretches' last falls, and their ready.

        ``before``: how many steps of the same axis stand before each in its stretch.
        """
        period, turn = self.timing.period, self.timing.turn
        first = np.flatnonzero(np.append(True, numbers[1:] != numbers[:-1]))
        latest = np.maximum.reduceat(falls, first)
        length = np.maximum.reduceat(before, first) * period
        if numbers[0] == 0:
            latest[0] = max(int(latest[0]), self.ready + int(length[0]), self.last)
            gaps = length
        else:
            latest = np.concatenate(([self.last], latest))
            gaps = np.concatenate(([0], length))
        gaps += turn
        gaps[0] = 0
        np.cumsum(gaps, out=gaps)
        latest -= gaps
        np.maximum.accumulate(latest, out=latest)
        latest += gaps
        ready = np.empty_like(latest)
        ready[0] = self.ready
        np.add(latest[:-1], turn, out=ready[1:])
        return np.maximum(falls, ready[numbers] + before * period), latest, ready

    def _walked(self, times: Times, axes: Axes, numbers: Numbers) -> tuple[Times, Times, Times]:
        """The same, one step after the other."""
        period, turn = self.timing.period, self.timing.turn
        free = [one + period for one in self.axes]
        lasts, readies = [self.last], [self.ready]
        last, ready, present = self.last, self.ready, 0
        falls = []
        for due, axis, number in zip(times.tolist(), axes.tolist(), numbers.tolist(), strict=True):
            if number != present:
                present, ready = number, last + turn
                lasts.append(last)
                readies.append(ready)
            fall = max(due, free[axis], ready)
            free[axis] = fall + period
            if fall > last:
                lasts[-1] = last = fall
            falls.append(fall)
        found = (np.array(one, dtype=np.int64) for one in (falls, lasts, readies))
        return next(found), next(found), next(found)


def _within(numbers: Numbers, spans: list[tuple[int, int]]) -> Numbers:
    """For each step, by axes, how many of the same axis stand before it in its stretch."""
    begins = np.empty(numbers.size, dtype=np.bool_)
    np.not_equal(numbers[1:], numbers[:-1], out=begins[1:])
    for begin, end in spans:
        if end > begin:
            begins[begin] = True
    place = np.arange(numbers.size)
    return place - np.maximum.accumulate(np.where(begins, place, 0))
