"""The monitor's entries as a capture, written while it grows: to a file, or into a pipe.

Owns what is special about a live one: every packet is written at once, what a slow reader does not
take is counted in the next packet, and that the reader has left is noticed while the line is still.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import select
from collections.abc import Callable
from dataclasses import dataclass

from sacbus.kernel import LineRate, Ns
from sacbus.trace.capture import Capture, CapturedLine
from sacbus.watch import Entry
from sacbus.writer import Writer

__all__ = ["Looked", "PcapOutput"]


@dataclass(frozen=True, slots=True)
class Looked:
    """A line that is looked at. ``bus``: its name if it is one of ours. ``times``: in words."""

    name: str
    bus: str | None
    protocol: str
    rate: LineRate
    lanes: int
    times: str


class PcapOutput:
    """A capture that grows. To be made in a running event loop.

    ``lost`` is told once when nothing can be written any more; BrokenPipeError: the reader has
    left. Whoever opened ``descriptor`` closes it, after :meth:`close`.
    """

    def __init__(self, descriptor: int, lost: Callable[[OSError], None]) -> None:
        self._descriptor = descriptor
        self._lost = lost
        self._capture = Capture()
        self._line: CapturedLine | None = None
        #: What must stand before the next packet, and could not be written yet.
        self._due = b""
        # Nothing stands where packets are missing: the next one tells how many.
        self._writer = Writer(lost, lambda _count: b"", descriptor)
        self.room = self._writer.room
        self._mind_the_reader()

    def begin(self, looked: Looked, epoch: Ns) -> None:
        """What comes from now on is of this line; ``epoch``: ns from 1970 to its time 0."""
        if self._line is None:
            with contextlib.suppress(OSError):  # a pipe
                os.ftruncate(self._descriptor, 0)
            self._due = self._capture.header
        missing = 0 if self._line is None else self._line.dropped
        self._line = self._capture.line(
            looked.name,
            looked.protocol,
            looked.rate,
            lanes=looked.lanes,
            times=looked.times,
            epoch=epoch,
        )
        self._line.dropped = missing
        self._write(self._due + self._line.header, b"")

    def show(self, entry: Entry) -> None:
        """Write it, if it has bytes."""
        line = self._line
        assert line is not None  # it has begun
        missing = line.dropped
        blocks = line.blocks(entry)
        if blocks and not self._write(self._due, blocks):
            line.dropped = missing + 1

    def close(self) -> None:
        """Have the rest written."""
        with contextlib.suppress(NotImplementedError):
            asyncio.get_running_loop().remove_reader(self._descriptor)
        self._writer.close()

    def _write(self, due: bytes, blocks: bytes) -> bool:
        written = self._writer.say(due + blocks)
        self._due = b"" if written else due
        return written

    def _mind_the_reader(self) -> None:
        """Of a pipe whose reader leaves, notice it; otherwise only the next packet would."""
        # A file cannot be waited for, and need not be.
        with contextlib.suppress(OSError, NotImplementedError):
            asyncio.get_running_loop().add_reader(self._descriptor, self._look_for_the_reader)

    def _look_for_the_reader(self) -> None:
        asyncio.get_running_loop().remove_reader(self._descriptor)
        poll = select.poll()
        poll.register(self._descriptor, 0)
        if poll.poll(0):  # only that it is broken is told where nothing was asked for
            self._lost(BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE)))
