"""Edges of the N + 1 lines: line 0 is DIR, line 1 + axis the step line of each axis.

Owns the arrays. DIR is high for clockwise; the step lines idle high, and a driver steps when its
own falls. Sources: the announcement of SiMAD, "Here is a more detailed microscopic explanation";
docs/simad.md for where it contradicts itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Times = NDArray[np.int64]
    Bytes = NDArray[np.uint8]

__all__ = ["DIR", "HIGH", "LOW", "UNKNOWN", "Edges", "joined_edges"]

#: The number of the DIR line.
DIR: Final = 0

#: Levels. What a dump calls x or z is neither: no step begins or ends with it.
LOW: Final = 0
HIGH: Final = 1
UNKNOWN: Final = 2


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Changes of level in the order of time; three arrays of one length.

    times: int64, ns, never falling. lines: uint8. levels: uint8, the level from then on. At one
    instant step lines stand before DIR, which may change as soon as they are high again.
    direction: the level of DIR before the first edge; the step lines are high.
    """

    times: Times
    lines: Bytes
    levels: Bytes
    direction: int = HIGH

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.times.size)

    def of_line(self, line: int) -> tuple[Times, Bytes]:
        """When a line changes, and to which levels."""
        mine = self.lines == line
        return self.times[mine], self.levels[mine]


def joined_edges(parts: Sequence[Edges]) -> Edges:
    """One stream of several that follow one another."""
    parts = [one for one in parts if one.count]
    if not parts:
        return Edges(*_EMPTY)
    return Edges(
        np.concatenate([one.times for one in parts]),
        np.concatenate([one.lines for one in parts]),
        np.concatenate([one.levels for one in parts]),
        parts[0].direction,
    )


_EMPTY: Final = (
    np.empty(0, dtype=np.int64),
    np.empty(0, dtype=np.uint8),
    np.empty(0, dtype=np.uint8),
)
