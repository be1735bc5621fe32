"""The command queue: 30 positions, which of them wait for their turn, and the last one written.

Owns what stands in each position and what is pending; when a command runs is the command
processor's business. Positions count from 1 and go round. The manual's two hidden ones are here as
well: 0 keeps the last continuous motion and 31 the last throw-away, for who looks at the queue in
debug mode; nothing else reads them.

Positions that nobody has written are not kept: they are the seeded row.
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

    __slots__ = ("_defaults", "_rows", "_undo", "continuous", "next_free", "pending", "throw_away")

    def __init__(self, defaults: Defaults) -> None:
        self._defaults = defaults
        #: From position 1 as far as anybody has written.
        self._rows: list[Motion] = []
        #: What stands in the hidden positions; None as long as nothing has been put there.
        self.continuous: Motion | None = None
        self.throw_away: Motion | None = None
        #: The position written last, what stood there before, and whether it waits since then.
        self._undo: tuple[int, Motion, bool] | None = None
        #: Where the next command goes: "Q is at N".
        self.next_free = 1
        #: Positions that wait, in order; at most all 30. A list, since an empty deque takes as much
        #: as all else here.
        self.pending: list[int] = []

    def row(self, position: int) -> Motion:
        """What stands in a position, 0 to 31."""
        if position == CONTINUOUS_POSITION:
            row = self.continuous
        elif position == THROW_AWAY_POSITION:
            row = self.throw_away
        else:
            row = self._rows[position - 1] if position <= len(self._rows) else None
        return _seeded(self._defaults) if row is None else row

    def rows(self) -> tuple[Motion, ...]:
        """Positions 1 to 30."""
        return tuple(self.row(position) for position in range(1, QUEUE_LENGTH + 1))

    def waiting(self) -> list[Motion]:
        """The commands that are pending, in order."""
        return [self.row(position) for position in self.pending]

    def add(self, motion: Motion) -> int | None:
        """Put a command into the next position and let it wait for its turn.

        One that waits there already is lost, as the oldest is when the 31st comes: the new one
        takes its place and its turn. Returns that position, else None.
        """
        position = self.next_free
        # Not only while 30 wait: once the 31st has come, the next one meets the oldest as well.
        lost = position in self.pending
        if not lost:
            self.pending.append(position)
        self._write(position, motion, waits=True)
        self.next_free = position % QUEUE_LENGTH + 1
        return position if lost else None

    def write(self, position: int, motion: Motion) -> None:
        """Put a command into a position, 1 to 30; what waits, and in which order, stays."""
        self._write(position, motion, waits=False)

    def put_back(self, position: int) -> bool:
        """Let a command that was taken from the head wait again; False when it was overwritten.

        That is when another waits in its position.
        """
        if position in self.pending:
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
        self._rows = list(rows)
        self._undo = None
        self.pending.clear()
        self.next_free = 1

    def _write(self, position: int, motion: Motion, *, waits: bool) -> None:
        rows = self._rows
        while len(rows) < position:
            rows.append(_seeded(self._defaults))
        self._undo = (position, rows[position - 1], waits)
        rows[position - 1] = motion
