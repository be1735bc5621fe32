"""In which order steps are taken, and so when DIR turns: the stretches of one direction.

Owns the rule: steps are taken in the order of time; of those due at one instant first the ones in
the direction that DIR has, then by axis; the steps of one axis never change their order. DIR turns
where the direction of what is taken does. A stretch that is over is not begun again: what is taken
later falls later than DIR's turn, though a step of the same direction before it may still be
waiting for its axis.

So the stretches follow from the steps alone, whatever they have to wait for, and can be found with
arrays. What takes thought is the steps of one instant in both directions. There an axis counts how
often its own direction changes within the instant, and each change needs one more stretch; so does
the first where DIR is against it. How many stretches an instant begins, and so which way DIR is
behind it, depends only on which way DIR was before it: such a function of two values is constant, or
it turns DIR round, or it leaves DIR alone. A chain of these is a count of turns since the last
constant one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sacbus.simad.steps import Axes, Times

    Flags = NDArray[np.bool_]
    Numbers = NDArray[np.int64]

__all__ = ["Stretches", "first_direction", "stretches"]


class Stretches(NamedTuple):
    """For each step the number of its stretch; 0 is the one that DIR is in before the first step.

    A stretch goes the other way than the one before. ``place``: which step is taken as the first,
    second, third..., by stretches; None where they are taken as they stand.
    """

    numbers: Numbers
    place: Numbers | None


def first_direction(times: Times, axes: Axes, clockwise: Flags) -> bool:
    """Which way DIR is set before the first step of all: whether clockwise.

    Of the steps of the first instant, that of the first axis decides.
    """
    together = int(np.searchsorted(times, times[0], side="right"))
    return bool(clockwise[int(axes[:together].argmin())])


def stretches(
    times: Times, axes: Axes, clockwise: Flags, by_axis: Numbers, now: bool
) -> Stretches:
    """The stretches of steps, all those of an instant among them.

    ``by_axis``: the places of the steps in the order of the axes, each axis's own in order;
    ``now``: which way DIR is before the first.
    """
    turns = np.empty(times.size, dtype=np.bool_)
    turns[0] = clockwise[0] != now
    np.not_equal(clockwise[1:], clockwise[:-1], out=turns[1:])
    apart = times[1:] != times[:-1]
    if (apart | ~turns[1:]).all():
        return Stretches(np.cumsum(turns), None)
    numbers = _with_instants(apart, axes, clockwise, by_axis, now)
    place = np.argsort(numbers, kind="stable")
    return Stretches(numbers, place)


def _with_instants(
    apart: Flags, axes: Axes, clockwise: Flags, by_axis: Numbers, now: bool
) -> Numbers:
    """The number of each step's stretch where instants have steps in both directions."""
    begins = np.append(True, apart)
    instant = np.cumsum(begins) - 1
    head, later = _within_instants(instant, axes, clockwise, by_axis)
    # By which way DIR is before the instant, False and True: how many stretches it begins.
    first = np.flatnonzero(begins)
    needed = [np.maximum.reduceat(later + (head != way), first) for way in (False, True)]
    before = _chain([way ^ (count & 1).astype(np.bool_) for way, count in enumerate(needed)], now)
    begun = np.where(before, needed[1], needed[0])
    base = np.cumsum(begun) - begun
    numbers: Numbers = base[instant] + later + (head != before[instant])
    return numbers


def _within_instants(
    instant: Numbers, axes: Axes, clockwise: Flags, by_axis: Numbers
) -> tuple[Flags, Numbers]:
    """For each step the first direction of its axis in its instant, and how often it changed."""
    which, when, way = axes[by_axis], instant[by_axis], clockwise[by_axis]
    alone = np.append(True, (which[1:] != which[:-1]) | (when[1:] != when[:-1]))
    first = np.flatnonzero(alone)
    group = np.cumsum(alone) - 1
    changes = np.cumsum(~alone & np.append(False, way[1:] != way[:-1]))
    head = np.empty_like(way)
    head[by_axis] = way[first][group]
    later = np.empty_like(changes)
    later[by_axis] = changes - changes[first][group]
    return head, later


def _chain(behind: list[Flags], now: bool) -> Flags:
    """Which way DIR is before each instant; ``behind``: which way it is after, for both ways."""
    of_false, of_true = behind
    number = np.arange(of_false.size)
    constant = of_false == of_true
    # What neither is constant nor leaves DIR alone turns it round.
    turned = np.cumsum(~constant & of_false)
    last = np.maximum.accumulate(np.where(constant, number, -1))
    known = last >= 0
    start = np.where(known, of_false[last], now)
    since = turned - np.where(known, turned[last], 0)
    after = start ^ (since & 1).astype(np.bool_)
    return np.append(np.bool_(now), after[:-1])
