"""The command queue: 30 positions, which of them wait for their turn, and the last one written.

Owns what stands in each position and what is pending; when a command runs is the command
processor's business. Positions count from 1 and go round. The manual's two hidden ones are here as
well: 0 keeps the last continuous motion and 31 the last throw-away, for who looks at the queue in
debug mode; nothing else reads them.

A node whose queue nobody has written to keeps none: every position is then the seeded row.
Source: manual, "Command buffer", "Queue", "Throw-away"; spec, "Queue".
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

from sacbus.language import QUEUE_LENGTH, Defaults, Motion, seeded_row

__all__ = ["CONTINUOUS_POSITION", "THROW_AWAY_POSITION", "Queue"]

#: The hidden positions (manual, "Throw-away").
CONTINUOUS_POSITION: Final = 0
THROW_AWAY_POSITION: Final = QUEUE_LENGTH + 1

#: One for all nodes with these defaults.
_seeded = lru_cache(maxsize=256)(seeded_row)


class Queue:
    """The positions and their order. ``defaults`` fill the positions that nobody has written."""

    __slots__ = ("_defaults", "_rows", "_undo", "next_free", "pending")

    def __init__(self, defaults: Defaults) -> None:
        self._defaults = defaults
        self._rows: list[Motion] | None = None
        #: The position written last, what stood there before, and whether it waits since then.
        self._undo: tuple[int, Motion, bool] | None = None
        #: Where the next command goes: "Q is at N".
        self.next_free = 1
        #: Positions that wait, in order; at most all 30. A list, since an empty deque takes as much
        #: as all else here.
        self.pending: list[int] = []

    def row(self, position: int) -> Motion:
        """What stands in a position, 0 to 31."""
        return _seeded(self._defaults) if self._rows is None else self._rows[position]

    def rows(self) -> tuple[Motion, ...]:
        """Positions 1 to 30."""
        return tuple(self.row(position) for position in range(1, QUEUE_LENGTH + 1))

    def waiting(self) -> list[Motion]:
        """The commands that are pending, in order."""
        return [self.row(position) for position in self.pending]

    def add(self, motion: Motion) -> int | None:
        """Put a command into the next position and let it wait for its turn.

        The 31st that waits takes the place of the oldest, which is lost: its position; else None.
        """
        position = self.next_free
        full = len(self.pending) >= QUEUE_LENGTH
        if not full:
            self.pending.append(position)
        self._write(position, motion, waits=True)
        self.next_free = position % QUEUE_LENGTH + 1
        return position if full else None

    def write(self, position: int, motion: Motion) -> None:
        """Put a command into a position, 1 to 30; what waits, and in which order, stays."""
        self._write(position, motion, waits=False)

    def keep_hidden(self, position: int, motion: Motion) -> None:
        """Remember a command in a hidden position, for who looks there."""
        self._own_rows()[position] = motion

    def put_back(self, position: int) -> bool:
        """Let a command that was taken from the head wait again; False when it was overwritten.

        That is when 30 others wait already.
        """
        if len(self.pending) >= QUEUE_LENGTH:
            return False
        self.pending.insert(0, position)
        return True

    def undo(self) -> int | None:
        """Put back what stood in the position written last; the position, None if there is none.

        A command that was the last to come and still waits is taken out of the order too: what
        stood there before it must not run in its place. Undone twice is as it was, but not pending
        (decision).
        """
        if self._undo is None:
            return None
        position, before, waits = self._undo
        if waits and self.pending and self.pending[-1] == position:
            self.pending.pop()
            self.next_free = position
        self._write(position, before, waits=False)
        return position

    def load(self, rows: Sequence[Motion]) -> None:
        """Replace all 30 positions; nothing waits afterwards, and the next free one is 1."""
        own = self._own_rows()
        own[1 : QUEUE_LENGTH + 1] = rows
        self._undo = None
        self.pending.clear()
        self.next_free = 1

    def _write(self, position: int, motion: Motion, *, waits: bool) -> None:
        rows = self._own_rows()
        self._undo = (position, rows[position], waits)
        rows[position] = motion

    def _own_rows(self) -> list[Motion]:
        if self._rows is None:
            self._rows = [_seeded(self._defaults)] * (QUEUE_LENGTH + 2)
        return self._rows
