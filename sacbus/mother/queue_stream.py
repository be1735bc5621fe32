"""Rows without number through the 30 positions of a node's queue, while the node runs them.

Owns what is written when. The node runs an endless loop over its positions; each row goes into the
next one, round and round, some way ahead of the node.

Theory of operation. Nobody can ask a node where it is, but its pace is planned: a position is free
when its command is loaded for certain, by the latest clock; and the node may come to a position as
soon as the earliest clock says so. Behind the last row that is written stands a *barrier*: a
position that is held for sync. So whatever happens to mother, the node runs what it was given and
stands; it never runs into rows of a round before. More rows are written from the last one back to
the first, which stands where the barrier is: only when its last edit says that it is not held, are
they open to the node, all at once. That edit is sent only when it will have arrived, retries and
all, before the node may be there. When it is too late for that the node *pauses*: it is at the
barrier for certain, or will be; it is stopped there, and loops on from that position. Nothing is
lost by it but time, and the velocity that was kept.

The end is the last barrier: when the node is there for certain S takes it out of its loop. (A bare
L during the last row would do as well, but a last row may be over before L is there.)

For whoever edits this file: a position is written only when ``surely_by`` its loading has passed,
a barrier is removed only before ``not_before`` the end of the row ahead of it.
Source: spec, mother ("G-code": flow control; "Queue files"); manual, "Queue", "Loop".
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Final

from sacbus.kernel import SECOND, Ns
from sacbus.language import QUEUE_LENGTH, Defaults, LoopFinish, LoopStart, Motion
from sacbus.mother.edits import edit_lines, hold_line
from sacbus.mother.errors import BadRequest, MotherError, Stopped
from sacbus.mother.queue_file import RowRefused
from sacbus.mother.request import checked_address
from sacbus.mother.timeline import (
    DRIFT_PPM,
    Departure,
    NotStreamable,
    Timeline,
    Times,
    check_streamed,
)
from sacbus.motion import Drive

if TYPE_CHECKING:
    from sacbus.mother.mother import Mother

__all__ = ["LostTrack", "QueueStream"]

#: Rows that are written in one go: one edit more than rows, so of one alone half would be overhead.
BATCH: Final = 8

#: How often who looks on is told where the node is.
_LOOK: Final[Ns] = SECOND // 4


class LostTrack(MotherError):
    """A row was sent so late that nobody knows whether the node took it; it was stopped.

    node; row: the last one, from 1, that it has run for certain.
    """

    def __init__(self, node: int, row: int) -> None:
        self.node, self.row = node, row
        super().__init__(
            f"node {node}: row {row + 1} was sent, and acknowledged too late to know whether the "
            "node runs it, so it was stopped; keep the line free for it, or take longer rows"
        )


@dataclass(slots=True)
class _Row:
    """A row that is written, and may not be over yet; times are ns of the node's own time."""

    number: int
    times: Times


class QueueStream:
    """Streams commands through the queue of a node; for one run.

    ::

        stream = QueueStream(mother, 10)
        await stream.run(row.motion for row in rows)
        print(stream.done, stream.pauses)

    ``drive``: the settings by which the node's pace is planned, the factory's by default: they must
    be the node's own, or rows are lost. ``defaults``: its default direction, and its sprf, by
    default the drive's. ``gap``: as the node's GAP is. ``drift_ppm``: by how much its oscillator
    may be off.
    """

    def __init__(
        self,
        mother: Mother,
        node: int,
        *,
        drive: Drive | None = None,
        defaults: Defaults | None = None,
        gap: bool = True,
        drift_ppm: int = DRIFT_PPM,
    ) -> None:
        """:class:`BadRequest` for an address that no node can have."""
        self._mother = mother
        self.node: Final = checked_address(node)
        self._drive = drive or Drive()
        self._defaults = defaults or Defaults(sprf=self._drive.steps_per_rev)
        self._drift_ppm = drift_ppm
        self._gap = gap
        self._timeline = Timeline(self._drive, gap=gap)
        self._departure: Departure | None = None
        #: What stands in each position, as far as it was written here.
        self._held: list[Motion | None] = [None] * QUEUE_LENGTH
        #: Rows that are written and not over for certain, the oldest first.
        self._ahead: deque[_Row] = deque()
        #: Rows that were written so far: the barrier is at the next one's position.
        self.written = 0
        #: Rows that are over for certain.
        self.done = 0
        #: How often the node had to wait at a barrier, since rows came too late.
        self.pauses = 0
        #: In which row it was stopped before its end; None as long as it was not.
        self._stopped_in: int | None = None
        #: Whether the node has acknowledged the S that stopped it before its end.
        self.stopped = False
        #: Emergency stops before it began.
        self._stops = 0
        self._progress: Callable[[int], object] | None = None

    @property
    def row(self) -> int:
        """The row that the node runs, or was stopped in, from 1; 0 before the first.

        As far as its pace tells: at the border of two rows it may be the other one.
        """
        departure = self._departure
        if self._stopped_in is not None:
            return self._stopped_in
        if departure is None:
            return self.done
        now = self._mother.now
        begun = [one.number for one in self._ahead if departure.latest + one.times.start <= now]
        return max(begun, default=self.done)

    def survey(self, motions: Iterable[Motion]) -> tuple[int, Ns]:
        """How many they are, and how long they take; nothing is sent.

        :class:`RowRefused` at the first that cannot be streamed. ns, without pauses.
        """
        timeline, count = Timeline(self._drive, gap=self._gap), 0
        for motion in self._planned(motions):
            timeline.add(motion)
            count += 1
        return count, timeline.end

    async def run(
        self, motions: Iterable[Motion], *, progress: Callable[[int], object] | None = None
    ) -> None:
        """Run all of them; returns when the node stands behind the last one.

        The node is stopped before the first, and its soft ops are switched off, which would part
        commands. ``motions`` is taken some 30 at a time, so it may be of any length.
        ``progress`` is called now and then with the number of rows that are over.

        Whatever ends it early, a cancelled call too, the node is stopped with S where it is:
        :attr:`row` tells in which row, and :attr:`stopped` whether it has acknowledged that. Raises
        :class:`RowRefused` at one that cannot be streamed, :class:`LostTrack`, :class:`Stopped`
        upon an emergency stop, and what :meth:`Mother.send` does.
        """
        self._progress = progress
        self._stops = self._mother.caller.stops
        rows = self._planned(motions)
        try:
            await self._send("S")
            await self._send("$O0")
            await self._begin(list(islice(rows, QUEUE_LENGTH - 1)))
            while batch := list(islice(rows, BATCH)):
                await self._go_on(batch)
            await self._over()
        except BaseException:
            self._stopped_in = self.row
            # What went wrong is worth telling, not what more goes wrong because of it.
            with suppress(MotherError):
                await self._mother.send(self.node, "S")
                self.stopped = True
            raise

    def _planned(self, motions: Iterable[Motion]) -> Iterator[Motion]:
        """The motions, each checked before anything of it is written."""
        for number, motion in enumerate(motions, start=1):
            try:
                check_streamed(motion)
                edit_lines(1, motion, self._defaults)
            except NotStreamable as fault:
                raise RowRefused(number, fault.what, fault.remedy) from fault
            except BadRequest as fault:
                raise RowRefused(number, str(fault), "change it") from fault
            yield motion

    # ---- writing ----

    async def _begin(self, rows: list[Motion]) -> None:
        """Write the first rows and their barrier, and let the node loop."""
        if not rows:
            return
        await self._bar(len(rows))
        for index, motion in enumerate(rows):
            await self._write(index, motion)
        self._account(rows)
        await self._depart(0)

    async def _go_on(self, rows: list[Motion]) -> None:
        """Write more rows, behind those that are written, and take the barrier before them away."""
        first = self.written
        # The row that stands where the new barrier goes must be loaded, and so are those before.
        await self._loaded(first + len(rows) - QUEUE_LENGTH)
        await self._bar(first + len(rows))
        for index in range(len(rows) - 1, 0, -1):
            await self._write(first + index, rows[index])
        *others, opening = self._lines(first, rows[0])
        for line in others:
            await self._send(line)
        late = self._mother.now + self._mother.caller.longest_call(len(opening))
        if late < self._at_barrier():
            await self._send(opening)
            if self._mother.now > self._at_barrier():
                raise LostTrack(self.node, first)
            self._account(rows)
        else:
            await self._pause(opening, rows)

    async def _pause(self, opening: str, rows: list[Motion]) -> None:
        """Too late to say for certain that the node goes on: let it stand, and loop on from there.

        What it holds then is what stood there before; S drops that.
        """
        await self._over()
        self.pauses += 1
        await self._send(opening)
        self._timeline.halt()
        first = self.written
        self._account(rows)
        await self._depart(first)

    async def _bar(self, index: int) -> None:
        """The position of this row holds whoever comes to it, whatever stands there."""
        position = index % QUEUE_LENGTH
        there = self._held[position]
        if there is not None:
            self._held[position] = replace(there, sync=True)
        await self._send(hold_line(position + 1))

    async def _write(self, index: int, motion: Motion) -> None:
        for line in self._lines(index, motion):
            await self._send(line)

    def _lines(self, index: int, motion: Motion) -> list[str]:
        """The edits that put a row into its position; at least one, the last of which opens it."""
        position = index % QUEUE_LENGTH
        before, self._held[position] = self._held[position], motion
        return edit_lines(position + 1, motion, self._defaults, before=before)

    def _account(self, rows: list[Motion]) -> None:
        """The node will run these next."""
        for motion in rows:
            self.written += 1
            self._ahead.append(_Row(self.written, self._timeline.add(motion)))

    async def _depart(self, index: int) -> None:
        """Let the node loop from the position of a row on."""
        position = index % QUEUE_LENGTH
        await self._send(LoopStart(position + 1).text())
        earliest = self._mother.now
        await self._send(LoopFinish((position - 1) % QUEUE_LENGTH + 1).text())
        self._departure = Departure(earliest, self._mother.now, self._drift_ppm)

    # ---- waiting ----

    async def _loaded(self, index: int) -> None:
        """Wait until a row is loaded for certain: then its position may be written over."""
        departure = self._departure
        assert departure is not None, "rows are free once the node has begun"
        for row in self._ahead:
            if row.number == index + 1:
                await self._until(departure.surely_by(row.times.loaded))
                return

    def _at_barrier(self) -> Ns:
        """When the node may come to the barrier at the earliest."""
        assert self._departure is not None, "there is no barrier to come to before it has begun"
        return self._departure.not_before(self._timeline.end)

    async def _over(self) -> None:
        """Wait until the node is at the barrier for certain, and take it out of its loop there."""
        departure = self._departure
        if departure is None:
            return
        await self._until(departure.surely_by(self._timeline.end))
        await self._send("S")
        self._departure = None

    async def _until(self, when: Ns) -> None:
        """Wait, keeping count of the rows that are over."""
        while True:
            self._count()
            now = self._mother.now
            if now >= when:
                return
            await self._mother.until(when if self._progress is None else min(when, now + _LOOK))

    def _count(self) -> None:
        departure, now = self._departure, self._mother.now
        if departure is None:
            return
        while self._ahead and departure.surely_by(self._ahead[0].times.end) <= now:
            self.done = self._ahead.popleft().number
        if self._progress is not None:
            self._progress(self.done)

    async def _send(self, line: str) -> None:
        if self._mother.caller.stops != self._stops:
            raise Stopped(self.node, line)
        await self._mother.send(self.node, line)
