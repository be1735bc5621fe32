"""Edges in the order of time, out of steps that fall and turns of DIR.

Owns the order of what happens at one instant: the step lines by axis, then DIR. That makes every
edge a number of its own, so that it is the same in whatever pieces the steps came.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.simad.edges import DIR, HIGH, Edges

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sacbus.simad.steps import Axes, Times

    Keys = NDArray[np.int64]

__all__ = ["EdgeSorter"]

#: An edge as one number: its instant, then its axis (DIR behind all), then its level.
LEVEL_BITS: Final = 1
WHICH_BITS: Final = 8
SHIFT: Final = LEVEL_BITS + WHICH_BITS
DIR_KEY: Final = 255


class EdgeSorter:
    """Edges that others may still come before."""

    def __init__(self) -> None:
        self._keys: list[Keys] = []
        #: The level of DIR behind the edges that were handed out.
        self.direction = HIGH

    def add_steps(self, falls: Times, axes: Axes, low: int) -> None:
        """A fall and a rise for each step; ``low``: ns between them."""
        keys = falls << SHIFT
        keys |= axes.astype(np.int64) << LEVEL_BITS
        self._keys += [keys, keys + ((low << SHIFT) | 1)]

    def add_turns(self, turns: Times, *, now: bool) -> None:
        """DIR turns at each of these instants; ``now``: whether it was high before."""
        levels = (np.arange(turns.size) & 1) ^ (0 if now else 1)
        self._keys.append((turns << SHIFT) | (DIR_KEY << LEVEL_BITS) | levels)

    def until(self, moment: int | None) -> Edges:
        """The edges before an instant, or all of them; they are not kept."""
        keys = np.concatenate([*self._keys, np.empty(0, dtype=np.int64)])
        keys.sort(kind="stable")  # what is nearly sorted already is sorted fastest by this
        if moment is not None:
            end = int(np.searchsorted(keys, moment << SHIFT))
            self._keys = [keys[end:]]
            keys = keys[:end]
        else:
            self._keys = []
        which = keys.astype(np.uint16)  # what of a key is no instant, and some of that
        lines = ((which >> LEVEL_BITS) + 1).astype(np.uint8)  # DIR_KEY + 1 is 0 in a byte
        edges = Edges(keys >> SHIFT, lines, (which & 1).astype(np.uint8), self.direction)
        turns = np.flatnonzero(lines == DIR)
        if turns.size:
            self.direction = int(edges.levels[turns[-1]])
        return edges
