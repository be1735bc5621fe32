"""A few steps out of many, to be looked at: where they were due, where they fell, what DIR did.

Owns which ones. A person can follow about ten; the most is to be learned where steps of both
directions come close.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.simad.edges import Edges
from sacbus.simad.fault import SimadError
from sacbus.simad.steps import Steps

if TYPE_CHECKING:
    from sacbus.simad.steps import Signs, Times

__all__ = ["FEW", "Excerpt", "excerpt"]

FEW: Final = 10

#: Steps before the one that was looked for.
BEFORE: Final = 2

#: ns.
CLOSE: Final = 1_000
EVER: Final = 1 << 62


@dataclass(frozen=True, slots=True, eq=False)
class Excerpt:
    """Some steps in the order in which they fall: due and falls in ns; and the edges about them.

    number: which the first of them is, of all, from 1.
    """

    due: Steps
    falls: Times
    edges: Edges
    number: int


def excerpt(
    steps: Steps, falls: Times, edges: Edges, at: int | None = None, few: int = FEW
) -> Excerpt:
    """The first steps that fall at ``at`` (ns) or later; without it the place that tells most.

    That is where the first step had to move, else where DIR first turns, else the beginning.
    SimadError where no step falls then.
    """
    order = np.argsort(falls, kind="stable")
    fallen = falls[order]
    if at is not None:
        first = int(np.searchsorted(fallen, at))
        if first == fallen.size:
            raise SimadError(f"expected an instant before the last step falls, got {at} ns")
    elif not fallen.size:
        raise SimadError("expected steps to be drawn, there are none")
    else:
        first = max(_telling(steps.times[order], fallen, steps.directions[order]) - BEFORE, 0)
    # All that fall at one instant, or so close that a line is still low, are seen together.
    first = int(np.searchsorted(fallen, fallen[first]))
    stop = min(first + few, fallen.size)
    while stop < min(first + 3 * few, fallen.size) and fallen[stop] - fallen[stop - 1] < CLOSE:
        stop += 1
    chosen = order[first:stop]
    # Up to the next step: DIR may turn for it before.
    begin, end = int(fallen[first]), int(fallen[stop]) if stop < fallen.size else EVER
    low, high = np.searchsorted(edges.times, (begin, end))
    return Excerpt(
        Steps(steps.times[chosen], steps.axes[chosen], steps.directions[chosen]),
        falls[chosen],
        Edges(
            edges.times[low:high],
            edges.lines[low:high],
            edges.levels[low:high],
            int(steps.directions[chosen[0]] > 0),
        ),
        first + 1,
    )


def _telling(due: Times, falls: Times, directions: Signs) -> int:
    """The place of the step that is looked for, in the order of the falls."""
    moved = np.flatnonzero(falls > due)
    turned = np.flatnonzero(np.diff(directions)) + 1
    return next((int(one[0]) for one in (moved, turned) if one.size), 0)
