"""An output that nobody can hold up: what a reader does not take in time is lost, counted.

Owns the thread that writes. Reports come from within the bus; were they written there, a reader
that stops reading would stop the bus, its signals included. A leaf beside the command line.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import queue
import sys
import threading
from collections.abc import Callable
from typing import Final

__all__ = ["Writer"]

#: Texts that wait at most; a reader so far behind is not reading.
WAITING: Final = 1_000

#: Whoever can wait is held back from this many on, until so few are left.
MUCH: Final = WAITING // 2
LITTLE: Final = WAITING // 4

#: Seconds that :meth:`Writer.close` gives a slow reader to take the rest.
PATIENCE: Final = 2.0


class Writer:
    """Writes texts or bytes in order, from a thread of its own. To be made in a running event loop.

    ``output`` is the descriptor that they go to, standard output's if none is given; whoever opened
    it closes it. ``lost`` is told once, in the loop, when nothing can be written any more.
    ``missed(count)`` gives the text that stands where texts are missing.
    """

    def __init__(
        self,
        lost: Callable[[OSError], None],
        missed: Callable[[int], str | bytes],
        output: int | None = None,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._lost: Callable[[OSError], None] | None = lost
        self._missed_text = missed
        self._missed = 0
        #: Whether somebody waits in :meth:`room`, and what tells them.
        self._held_back = False
        self._room = asyncio.Event()
        self._texts: queue.Queue[str | bytes | None] = queue.Queue(WAITING)
        self._output = output
        if output is None:
            # The descriptor itself: a buffer's lock, held by a thread that waits, blocks the exit.
            with contextlib.suppress(io.UnsupportedOperation):  # replaced, as in tests
                self._output = sys.stdout.fileno()
        self._thread = threading.Thread(target=self._run, name="sacbus output", daemon=True)
        self._thread.start()

    def say(self, text: str | bytes) -> bool:
        """Have a text written, and whether it will be; never waits and never raises."""
        try:
            if self._missed:
                self._texts.put_nowait(self._missed_text(self._missed))
                self._missed = 0
            self._texts.put_nowait(text)
        except queue.Full:
            self._missed += 1
            return False
        return True

    async def room(self) -> None:
        """Wait while much waits to be written: for whoever can stop what they read from."""
        self._room.clear()
        self._held_back = True
        # Asked only now: from here on, the thread tells when it has come to little.
        if self._texts.qsize() >= MUCH:
            await self._room.wait()
        self._held_back = False

    def close(self) -> None:
        """Have the rest written, as far as it is taken in time."""
        try:
            self._texts.put(None, timeout=PATIENCE)
        except queue.Full:
            return
        self._thread.join(PATIENCE)

    def _run(self) -> None:
        while (text := self._texts.get()) is not None:
            if self._held_back and self._texts.qsize() <= LITTLE:
                self._held_back = False
                self._tell(self._room.set)
            if self._lost is None:
                continue
            try:
                self._write(text)
            except OSError as fault:
                lost, self._lost = self._lost, None
                self._tell(lost, fault)

    def _tell(self, callback: Callable[..., object], *arguments: object) -> None:
        """Have the loop call back."""
        # It may be closed already, or just now, when the last lines go to nobody.
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(callback, *arguments)

    def _write(self, text: str | bytes) -> None:
        if isinstance(text, bytes):
            rest = text
        elif self._output is None:
            sys.stdout.write(text)
            return
        else:
            rest = text.encode(sys.stdout.encoding, "replace")
        assert self._output is not None  # of bytes
        while rest:
            rest = rest[os.write(self._output, rest) :]
