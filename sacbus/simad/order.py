"""In which order steps are taken, and so when DIR turns: the stretches of one direction.

Owns the rule: steps are taken in the order of time; of those due at one instant first the ones in
the direction that DIR has, then by axis; the steps of one axis never change their order. DIR turns
where the direction of what is taken does. A stretch that is over is not begun again: what is taken
later falls later than DIR's turn, though a step of the same direction before it may still be
waiting for its axis.

So the order follows from the steps alone, whatever they have to wait for, and can be found with
arrays. What takes thought is the mixed instants, those with steps in both directions. There an axis
counts how often its own direction changes within the instant, and each change needs one more
stretch; so does the first where DIR is against it. How many stretches an instant begins, and so
which way DIR is behind it, depends only on which way DIR was before it. Such a function of two
values is constant, or it turns DIR round, or it leaves DIR alone; a chain of these is a count of
turns since the last constant one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sacbus.simad.steps import Axes, Times

    Flags = NDArray[np.bool_]
    Numbers = NDArray[np.int64]

__all__ = ["first_direction", "stretches", "taking_order"]


def first_direction(times: Times, axes: Axes, clockwise: Flags) -> bool:
    """Which way DIR is set before the first step of all: whether clockwise.

    Of the steps of the first instant, that of the first axis decides.
    """
    together = int(np.searchsorted(times, times[0], side="right"))
    return bool(clockwise[int(axes[:together].argmin())])


def stretches(clockwise: Flags, now: bool) -> Numbers:
    """For each step, in the order in which they are taken, the number of its stretch.

    0 is the stretch that DIR is in before the first step, which goes the way ``now`` says; each
    goes the other way than the one before.
    """
    turns = np.empty(clockwise.size, dtype=np.bool_)
    turns[0] = clockwise[0] != now
    np.not_equal(clockwise[1:], clockwise[:-1], out=turns[1:])
    return np.cumsum(turns)


def taking_order(times: Times, axes: Axes, clockwise: Flags, now: bool) -> Numbers | None:
    """Which step is taken first, second, third...; None: as they stand.

    The steps of whole instants, at least one. Of steps in one direction at one instant the order
    makes no difference, and is left.
    """
    mixed = _of_mixed_instants(times, clockwise)
    if mixed is None:
        return None
    when, way = times[mixed], clockwise[mixed]
    begins = np.append(True, when[1:] != when[:-1])
    instant = np.cumsum(begins) - 1
    head, later = _within_instants(instant, axes[mixed], way)
    first = np.flatnonzero(begins)
    # By which way DIR is before the instant, False and True: how many stretches it begins.
    begun = [np.maximum.reduceat(later + (head != before), first) for before in (False, True)]
    behind = [bool(before) ^ (count & 1).astype(np.bool_) for before, count in enumerate(begun)]
    # Before a mixed instant DIR is as the step before had it, unless that is of a mixed one too.
    step = mixed[first]
    known = np.append(True, mixed[first[1:] - 1] != step[1:] - 1)
    former = np.where(step > 0, clockwise[step - 1], now)
    before = _chain(behind, known, former)
    stretch = later + (head != before[instant])
    place = np.arange(times.size)
    place[mixed] = mixed[np.lexsort((stretch, instant))]
    return place


def _of_mixed_instants(times: Times, clockwise: Flags) -> Numbers | None:
    """The places of all steps whose instant has steps in both directions."""
    together = times[1:] == times[:-1]
    changes = np.flatnonzero(together & (clockwise[1:] != clockwise[:-1]))
    if not changes.size:
        return None
    instants = times[changes]
    instants = instants[np.append(True, instants[1:] != instants[:-1])]
    low = np.searchsorted(times, instants, side="left")
    high = np.searchsorted(times, instants, side="right")
    counts = high - low
    ends = np.cumsum(counts)
    places: Numbers = np.arange(int(ends[-1])) + np.repeat(low - (ends - counts), counts)
    return places


def _within_instants(instant: Numbers, axes: Axes, clockwise: Flags) -> tuple[Flags, Numbers]:
    """For each step the first direction of its axis in its instant, and how often it changed."""
    by_axis = np.argsort(axes, kind="stable")
    which, when, way = axes[by_axis], instant[by_axis], clockwise[by_axis]
    alone = np.append(True, (which[1:] != which[:-1]) | (when[1:] != when[:-1]))
    if alone.all():
        return clockwise, np.zeros(axes.size, dtype=np.int64)
    first = np.flatnonzero(alone)
    group = np.cumsum(alone) - 1
    changes = np.cumsum(~alone & np.append(False, way[1:] != way[:-1]))
    head = np.empty_like(way)
    head[by_axis] = way[first][group]
    later = np.empty_like(changes)
    later[by_axis] = changes - changes[first][group]
    return head, later


def _chain(behind: list[Flags], known: Flags, former: Flags) -> Flags:
    """Which way DIR is before each mixed instant.

    ``behind``: which way it is behind each, for both ways before it. ``known``: where it is
    ``former`` before it; elsewhere it is what the mixed instant before has left.
    """
    of_false, of_true = behind
    # What each leaves, as a function of what the one before it has left: constant where known.
    of_false, of_true = (
        np.where(known & former, of_true, of_false),
        np.where(known & ~former, of_false, of_true),
    )
    constant = of_false == of_true
    turned = np.cumsum(~constant & of_false)
    # The first is known, so that there always is a constant one.
    last = np.maximum.accumulate(np.where(constant, np.arange(constant.size), 0))
    after = of_false[last] ^ ((turned - turned[last]) & 1).astype(np.bool_)
    before = np.empty_like(former)
    before[0] = former[0]
    before[1:] = np.where(known[1:], former[1:], after[:-1])
    return before
