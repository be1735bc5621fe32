"""Loops: over the queue from one position to another, and over the xRef array.

Owns where a loop starts and finishes, how often it runs, which position comes next, and the xRef
array. Whether it is a loop's turn is the command processor's business.

LS and LF may be given in either order, and again while the loop runs: what comes next is worked out
when the present command is over, from what is set then. The finish may be below the start: then the
loop goes round, from 30 to 1. All is clear again when a loop is over.
Source: manual, "Loop", "xRef", "Autorun"; spec, "Loops and references".
"""

from __future__ import annotations

from typing import Final

from sacbus.language import QUEUE_LENGTH

__all__ = ["Loop"]

#: The end of the xRef array (manual, "xRef").
_NULL: Final = 0


class Loop:
    """The loop of a node, and its xRef array."""

    __slots__ = (
        "_count",
        "_done",
        "_finish",
        "_index",
        "_position",
        "_start",
        "references",
        "running",
    )

    def __init__(self) -> None:
        #: The xRef array from index 0 as far as it was programmed; a 0 ends it.
        self.references: tuple[int, ...] = ()
        self.end()

    def end(self) -> None:
        """The loop is over, or will be after the present command; start, finish, count clear."""
        self._start: int | None = None
        self._finish: int | None = None
        #: Iterations to run, 0 for ever; iterations that are done.
        self._count = 0
        self._done = 0
        #: The position, or index of the xRef array, of the command that was taken last.
        self._position: int | None = None
        self._index: int | None = None
        #: Whether there are commands to come.
        self.running = False

    @property
    def set(self) -> bool:
        """Whether there is anything that could be ended: a loop, or one end of one."""
        return self.running or self._start is not None or self._finish is not None

    # ---- setting ----

    def start_at(self, position: int) -> bool:
        """LS; False when that is where the loop finishes: the two must differ."""
        if position == self._finish:
            return False
        self._start = position
        self._begin_if_set()
        return True

    def finish_at(self, position: int) -> bool:
        """LF; False when that is where the loop starts."""
        if position == self._start:
            return False
        self._finish = position
        self._begin_if_set()
        return True

    def run(self, start: int, finish: int) -> None:
        """Loop from one position to another at once: LA, autorun; the two may be one here."""
        self._start, self._finish = start, finish
        self._begin_if_set()

    def count_to(self, count: int) -> None:
        """LN: so many iterations, 0 for ever. Of a loop that runs it counts those it has done."""
        self._count = count

    def run_references(self, count: int) -> bool:
        """Loop over the xRef array, 0 for ever; False if it is empty or nothing ends it.

        A loop that runs is replaced at the end of the present command.
        """
        if _NULL not in self.references or self.references[0] == _NULL:
            return False
        self.end()
        self._count = count
        self._index = -1
        self.running = True
        return True

    def refer(self, index: int, position: int) -> None:
        """XP: an entry of the xRef array; gaps before it are ends, as memory that was cleared."""
        array = list(self.references)
        array += [_NULL] * (index + 1 - len(array))
        array[index] = position
        self.references = tuple(array)

    def _begin_if_set(self) -> None:
        if self._start is None or self._finish is None:
            return
        if self._index is not None:  # it takes the place of a loop over the xRef array
            self._index = None
            self._done = 0
        self.running = True

    # ---- running ----

    def take(self) -> int | None:
        """The queue position whose turn it is; None when the loop is over."""
        if not self.running:
            return None
        position = self._next_reference() if self._index is not None else self._next_position()
        if position is None:
            self.end()
        return position

    def again(self) -> None:
        """The command taken last has not run: it is the next one."""
        if self._index is not None:
            self._index -= 1
        elif self._position == self._start:
            self._position = None
        elif self._position is not None:
            self._position = (self._position - 2) % QUEUE_LENGTH + 1

    def only_one_more(self) -> None:
        """One more command, then the loop is over."""
        if not self.running:
            return
        position = self.take()
        self.end()
        if position is not None:
            # A loop of one command that runs once.
            self._start = self._finish = position
            self._count = 1
            self.running = True

    def _next_position(self) -> int | None:
        assert self._start is not None
        if self._position is None:
            self._position = self._start
        elif self._position == self._finish:
            if self._over():
                return None
            self._position = self._start
        else:
            self._position = self._position % QUEUE_LENGTH + 1
        return self._position

    def _next_reference(self) -> int | None:
        assert self._index is not None
        self._index += 1
        array = self.references
        if self._index >= len(array) or array[self._index] == _NULL:
            # It may have been programmed anew meanwhile, to nothing.
            if self._over() or array[0] == _NULL:
                return None
            self._index = 0
        return array[self._index]

    def _over(self) -> bool:
        """Count an iteration; whether it was the last."""
        self._done += 1
        return 0 < self._count <= self._done
