"""Blocks of a stream that are not released yet, and what of them is still to be written.

Owns the way of a plan's blocks into lanes: how they are taken one by one, and which command goes
next into which queue. Synchronous; whoever sends the edits says when they are acknowledged.
Source: spec, mother ("G-code": look-ahead over the queue's 30 positions).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from sacbus.kernel import Ns
from sacbus.language import QUEUE_LENGTH, Motion
from sacbus.mother.lane import Lane
from sacbus.toolpath import AxisRun, Block

__all__ = ["MOST_COMMANDS", "Backlog", "Passage"]

#: Commands of one axis in a block: one position is left for what holds it at its end.
MOST_COMMANDS: Final = QUEUE_LENGTH - 1


@dataclass(slots=True, eq=False)
class Passage:
    """A block that has not been released yet.

    left: commands of which not all edits are acknowledged. firsts: where each axis's first one is.
    """

    block: Block
    runs: dict[int, AxisRun]
    left: int
    firsts: dict[int, int] = field(default_factory=dict)

    def written(self, axis: int, position: int) -> None:
        """The next command of an axis is in its queue for certain."""
        self.left -= 1
        self.firsts.setdefault(axis, position)


class Backlog:
    """The blocks that were taken from a plan and are not released. ``passages``: in their order."""

    def __init__(self, lanes: Sequence[Lane], blocks: Iterable[Block]) -> None:
        self.passages: deque[Passage] = deque()
        self._lanes = lanes
        self._blocks = iter(blocks)
        self._ended = False
        #: What each lane has to write, in order: whose it is, which command of it, and when it is
        #: due in its block.
        self._to_write: list[deque[tuple[Passage, int, int, Motion]]] = [deque() for _ in lanes]

    def take(self) -> bool:
        """Take the next block from the plan; False when there is none.

        ValueError for one with more commands of an axis than a queue has room for.
        """
        if self._ended:
            return False
        block = next(self._blocks, None)
        if block is None:
            self._ended = True
            return False
        longest = max((len(run.motions) for run in block.runs), default=0)
        if longest > MOST_COMMANDS:
            raise ValueError(
                f"block of lines {block.lines}: expected at most {MOST_COMMANDS} commands for an "
                f"axis, got {longest}"
            )
        runs = {run.axis: run for run in block.runs}
        passage = Passage(block, runs, sum(len(run.motions) for run in block.runs))
        self.passages.append(passage)
        for run in block.runs:
            self._to_write[run.axis].extend(
                (passage, number, start, motion)
                for number, (start, motion) in enumerate(zip(run.starts, run.motions, strict=True))
            )
        return True

    def has(self, lane: Lane) -> bool:
        """Whether there is anything to write into a lane."""
        return bool(self._to_write[lane.index])

    def first(self, now: Ns) -> Lane | None:
        """The lane whose next command is due first, of those that have room for it."""
        best: Lane | None = None
        key: tuple[int, bool, int] = (0, False, 0)
        for lane, waiting in zip(self._lanes, self._to_write, strict=True):
            if not waiting or (room := lane.room_at(now)) is None or room > now:
                continue
            passage, number, start, _ = waiting[0]
            # First commands first: without them nobody can be held.
            candidate = (self.passages.index(passage), number > 0, start)
            if best is None or candidate < key:
                best, key = lane, candidate
        return best

    def write(self, lane: Lane) -> tuple[Passage, int, list[str]]:
        """A lane's next command: whose it is, its position, and the edits that put it there."""
        passage, _, _, motion = self._to_write[lane.index].popleft()
        position, lines = lane.write(motion)
        return passage, position, lines
