"""One axis of a stream: its node's queue as a ring that is written anew while it turns.

Owns what stands in the 30 positions, which of them the node is certain to have loaded, and where
the next command goes. The node runs an endless loop over all of them, so a position comes up again
after 30 commands; an edit takes effect when it is next loaded. Synchronous; times are ns by
mother's clock.
Source: spec, mother ("G-code"); manual, "Queue", "Loop".
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from sacbus.kernel import Ns
from sacbus.language import QUEUE_LENGTH, Defaults, LoopFinish, LoopStart, Motion
from sacbus.mother.edits import edit_lines, hold_line
from sacbus.toolpath import Axis

__all__ = ["Lane"]


class Lane:
    """The queue of one axis's node, as mother knows it: she has written all that stands in it."""

    def __init__(self, index: int, axis: Axis) -> None:
        #: Its place in the machine.
        self.index = index
        self.axis = axis
        self.node = axis.node
        self._defaults = Defaults(sprf=axis.drive.steps_per_rev)
        #: What she has written into each position; None where she has not yet.
        self._rows: list[Motion | None] = [None] * QUEUE_LENGTH
        #: Where the next command goes.
        self._next = 1
        #: When each released command that may not have been loaded yet is certain to be.
        self._released: deque[Ns] = deque()
        #: Commands that are written, and whose block has not been released.
        self.written = 0
        #: Whether the next position holds whoever comes to it, though no next command is there.
        self.barred = False
        #: Whether the node is in its loop: then it is held at a block's first command, or runs one.
        self.joined = False
        #: When the last block that it was released for is over for certain.
        self.over: Ns = 0
        #: Signed full steps of the blocks that it was released for.
        self.steps = 0
        #: The most commands that were ever in its queue and not certain to be loaded.
        self.deepest = 0

    def room_at(self, now: Ns) -> Ns | None:
        """When the next position may be written over: ``now``, or later; None: not before ``y``."""
        released = self._released
        while released and released[0] <= now:
            released.popleft()
        waiting = len(released) + self.written
        if waiting < QUEUE_LENGTH:
            return now
        return released[0] if released else None

    def write(self, motion: Motion) -> tuple[int, list[str]]:
        """The next command: its position, and the edits that put it there."""
        position = self._next
        lines = self._edits(position, motion)
        self._next = position % QUEUE_LENGTH + 1
        self.written += 1
        self.barred = False
        self.deepest = max(self.deepest, len(self._released) + self.written)
        return position, lines

    def bar(self) -> str:
        """The edit after which the next position holds whoever comes to it, whatever is there."""
        row = self._rows[self._next - 1]
        if row is not None:
            self._rows[self._next - 1] = replace(row, sync=True)
        self.barred = True
        return hold_line(self._next)

    def loop_from(self, position: int) -> tuple[str, str]:
        """What makes the node loop over all positions, beginning with this one."""
        last = (position - 2) % QUEUE_LENGTH + 1
        return LoopStart(position).text(), LoopFinish(last).text()

    def release(self, loaded: Sequence[Ns], over: Ns) -> None:
        """Its oldest block was released: when each of its commands is certain to be loaded."""
        self._released.extend(loaded)
        self.written -= len(loaded)
        self.over = over

    def _edits(self, position: int, motion: Motion) -> list[str]:
        before = self._rows[position - 1]
        self._rows[position - 1] = motion
        return edit_lines(position, motion, self._defaults, before=before)
