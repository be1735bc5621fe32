"""A serial port on the event loop: pyserial-asyncio, whose defects and pyserial's end in this file.

Owns opening a port by its path, in words when that fails, and telling its end once. What is wrong
with the two (0.6 and 3.5) and is put right here:

- an unplugged port with something still to write ends in a traceback from the loop; one that is
  unplugged while nothing is read of it is told only afterwards (what is left, in 0.6 on Linux, of
  its issues 12 and 28: that an unplugged port is never told);
- what another program takes between pyserial's `select` and its `read` leaves an empty read, and
  that counts as unplugged: with VMIN 0, as pyserial sets it, nothing and the end look the same;
- `select` itself fails above descriptor 1023, and then again at every turn of the loop;
- a write that the system does not take at once is tried again and again in the loop, without pause;
- closing waits in the loop until everything is written (`tcdrain`), for ever on a port that is
  stuck, and the system waits once more, up to 30 s;
- aborting what is ending already ends it twice, the second time with an AttributeError;
- what waits to be written is kept without limit;
- opening may raise `termios.error`, which is no OSError, and hands out what is not yet connected.

On Windows, where pyserial has other calls and pyserial-asyncio polls every half millisecond, only
the last four are put right.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final

import serial
import serial_asyncio

from .client import no_ninth_bits
from .errors import LinkError
from .hardware import set_dtr
from .marking import PARITIES, runs

if sys.platform != "win32":
    import termios

__all__ = ["BOUND", "FAULTS", "SerialConnection", "unopened"]

#: Bytes that wait for a port which does not take them: what the system has no room for. 17 s of a
#: line at 38400 baud.
BOUND: Final = 65_536

#: Seconds more than a line's own time for the last bytes to leave when a port is closed.
FINISH_TIMEOUT: Final = 0.2

_BITS: Final = 10  # of a byte: start, eight, stop
_CHUNK: Final = 65_536  # the most one read may bring; Linux gives 4 kB at a time

_CHECK: Final = "check the path, and whether the bus is running or the adapter plugged in"
_WAIT: Final = "wait until the other program has closed it"
_REASONS: Final = {
    errno.ENOENT: ("no such file", _CHECK),
    errno.ENXIO: ("no such device", "plug it in, or check the path"),
    errno.ENODEV: ("no such device", "plug it in, or check the path"),
    errno.EISDIR: ("it is a directory", _CHECK),
    errno.ENOTTY: ("it is not a serial port", _CHECK),
    errno.EACCES: ("permission denied", "join the group that owns it, often dialout"),
    errno.EBUSY: ("another program has it", _WAIT),
    errno.EWOULDBLOCK: ("another program has it", _WAIT),
    errno.EIO: ("nobody is at its other end", _CHECK),
}
_HUNG_UP: Final = "unplugged, or closed by its other end"


class _Port(serial.Serial):
    """pyserial's port, which fails by calling ``failed`` instead of raising, and never waits."""

    failed: Callable[[str], object]

    if sys.platform != "win32":

        def read(self, size: int = 1) -> bytes:  # noqa: ARG002 (pyserial-asyncio's is too small)
            """What has come; b"" when there is nothing, or nothing will come any more."""
            try:
                data = os.read(self.fileno(), _CHUNK)
            except (BlockingIOError, InterruptedError):
                return b""
            except OSError as fault:
                self.failed(_words(fault))
                return b""
            if not data:
                self.failed(_HUNG_UP)
            return data

        def write(self, data: bytes, /) -> int:  # type: ignore[override]  # bytes is all we write
            """How many bytes the system took; 0 when it has no room, or the port is gone."""
            try:
                return os.write(self.fileno(), data)
            except (BlockingIOError, InterruptedError):
                return 0
            except OSError as fault:
                self.failed(_words(fault))
                return 0

        def flush(self) -> None:
            """Not wait: pyserial-asyncio calls this in the loop, before it closes."""

        def close(self) -> None:
            """Close, throwing away what the system has not sent: it would wait for that."""
            with contextlib.suppress(OSError, termios.error):
                # Not for nothing: of a pty, which never makes anyone wait, that throws away what
                # the other end has not read yet.
                if self.is_open and self.out_waiting:
                    termios.tcflush(self.fileno(), termios.TCOFLUSH)
            super().close()


class SerialConnection(asyncio.Protocol):
    """An open port, 8N1, raw, for oneself alone, until it is closed or lost.

    ``hear`` gets what comes, ``lose`` why the port is gone: once, and not after :meth:`close`.
    ``rts`` is the level that RTS has from the start. Raises LinkError when the port cannot be had.
    """

    def __init__(
        self,
        path: str,
        baud: int,
        hear: Callable[[bytes], None],
        lose: Callable[[str], None],
        *,
        rts: bool = True,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._hear = hear
        self._lose = lose
        self._byte_s = _BITS / max(baud, 1)  # one that cannot be had is refused below
        self._path = path
        #: The thread that writes marked bytes, in the order of the calls; None until there are any.
        self._marker: ThreadPoolExecutor | None = None
        #: Marked bytes that may not be out.
        self._unmarked = 0
        self._failing = False
        self._ended = False
        #: Whether the transport may hold bytes that the system has not taken; its count is dear.
        self._kept = False
        #: Bytes that the port had not taken when it was lost.
        self.lost_unwritten = 0
        self.port: Final = _Port()
        self.port.failed = self._failed
        try:
            _open(self.port, path, baud, rts=rts)
        except FAULTS as fault:
            raise unopened(path, fault) from fault
        self._transport = serial_asyncio.SerialTransport(self._loop, self, self.port)

    @property
    def unsent(self) -> int:
        """Bytes that wait here or in the system, as far as that tells; 0 once the port is gone."""
        if self._ended:
            return 0
        with contextlib.suppress(OSError):
            return self._unwritten + self._unmarked + self.port.out_waiting
        return self._unwritten + self._unmarked

    def send(self, data: bytes) -> int:
        """Write without waiting; how many bytes were taken. What BOUND leaves no room for is not.

        Bytes taken that the system had not when the port was lost are in ``lost_unwritten``.
        """
        if self._ended or self._failing or self._transport.is_closing():
            return 0
        unwritten = self._unwritten if self._kept else 0
        taken = 0
        if sys.platform != "win32" and not unwritten:
            # At once, not at the loop's next turn: that is a third of what a reply costs.
            taken = self.port.write(data)
            if taken == len(data):
                self._kept = False
                return taken
        rest = data[taken : taken + BOUND - unwritten]
        if rest:
            self._transport.write(rest)
            self._kept = True
        return taken + len(rest)

    def check_marking(self) -> None:
        """LinkError for a port that takes no parity, as a pseudo-terminal."""
        if sys.platform == "win32":
            return
        try:
            self.port.parity = PARITIES[1]
            takes = termios.tcgetattr(self.port.fileno())[2] & termios.PARENB
        except FAULTS:
            takes = 0
        if not takes:
            raise no_ninth_bits(self._path)

    def send_marked(self, data: bytes, ninth: bytes) -> None:
        """Write with a ninth bit for each byte, in a thread: it waits until one run of them is out.

        What an earlier call gave goes before. Not to be mixed with :meth:`send`, whose bytes would
        have the parity of the moment.
        """
        if self._ended or self._failing:
            return
        if self._marker is None:
            self._marker = ThreadPoolExecutor(1)
        self._unmarked += len(data)
        marked = tuple(runs(data, ninth))
        out = self._loop.run_in_executor(self._marker, self._write_marked, marked)
        out.add_done_callback(lambda _: self._marked(len(data)))

    def _marked(self, size: int) -> None:
        self._unmarked -= size

    def _write_marked(self, marked: Sequence[tuple[str, bytes]]) -> None:
        try:
            for parity, data in marked:
                self.port.parity = parity
                rest = data
                while rest and not (self._ended or self._failing):
                    rest = rest[self.port.write(rest) :]
                    super(_Port, self.port).flush()
        except FAULTS as fault:
            if not self._ended:
                self._failed(_words(fault))

    def set_dtr(self, *, asserted: bool) -> bool:
        """Set the DTR output now; False where there is none, or the port is gone."""
        return not self._ended and set_dtr(self.port, asserted=asserted)

    def hold(self, *, held: bool) -> None:
        """Read no more, or go on. A port that is unplugged meanwhile is noticed afterwards."""
        # Behind the transport's own beginning to read, which waits for the loop's next turn.
        self._loop.call_soon(self._hold, held)

    def close(self) -> int:
        """Close at once, leaving no descriptor; how many bytes had not been written. Idempotent."""
        if self._ended:
            return 0
        self._ended = True
        unwritten = self._unwritten
        if self._marker is not None:
            self._marker.shutdown(wait=False, cancel_futures=True)
        # First, since closing a transport that has something to write only asks for its end.
        self._transport.flush()
        if not self._transport.is_closing():
            self._transport.abort()
        self.port.close()
        return unwritten

    async def finish(self) -> None:
        """Let what was written go out, for as long as that takes the line, and close."""
        patience = self._loop.time() + self.unsent * self._byte_s + FINISH_TIMEOUT
        # No system tells when it is done, but by a call that waits for it.
        try:
            while self.unsent and self._loop.time() < patience:  # noqa: ASYNC110
                await asyncio.sleep(self._byte_s)
        finally:  # who has no patience at all leaves no descriptor either
            self.close()
        await asyncio.sleep(0)  # the transport ends in a callback of its own

    def data_received(self, data: bytes) -> None:
        """asyncio's: bytes have come."""
        if not self._ended:
            self._hear(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """asyncio's: the transport has ended; by our own doing, but for Windows."""
        self._end(_HUNG_UP if exc is None else _words(exc))

    @property
    def _unwritten(self) -> int:
        size = self._transport.get_write_buffer_size()
        assert isinstance(size, int)
        return size

    def _hold(self, held: bool) -> None:
        if not self._ended and held:
            self._transport.pause_reading()
        elif not self._ended:
            self._transport.resume_reading()

    def _failed(self, why: str) -> None:
        """The port's: it is gone. Told at the loop's next turn, since the transport is busy now.

        From any thread: marked bytes are written in one of their own.
        """
        if not self._failing:
            self._failing = True
            self._loop.call_soon_threadsafe(self._end, why)

    def _end(self, why: str) -> None:
        if not self._ended:
            self.lost_unwritten = self.close()
            self._lose(why)


def _open(port: _Port, path: str, baud: int, *, rts: bool) -> None:
    port.port = path
    port.baudrate = baud
    port.exclusive = True
    port.rts = rts
    if sys.platform != "win32":
        port.inter_byte_timeout = 0  # what pyserial makes VMIN 1 of
    port.open()


def unopened(path: str, fault: Exception) -> LinkError:
    """Why a port cannot be had, in one line."""
    why, remedy = _reason(fault)
    return LinkError(f"cannot open the line ({why})", path, remedy)


def _words(fault: BaseException) -> str:
    """The system's reason in words, without numbers and paths."""
    number = _number(fault)
    if number == errno.EIO:
        return _HUNG_UP
    return os.strerror(number).lower() if number is not None else str(fault)


def _reason(fault: BaseException) -> tuple[str, str]:
    """Why a port cannot be opened, and what to do; pyserial puts the system's error into a text."""
    cause: BaseException | None = fault
    while cause is not None:
        number = _number(cause)
        if number in _REASONS:
            return _REASONS[number]
        cause = cause.__context__
    return getattr(fault, "strerror", None) or str(fault), "check the path and the rate"


def _number(fault: BaseException) -> int | None:
    """The system's error number; ``termios.error`` has it as its first argument only."""
    number = getattr(fault, "errno", None)
    if number is None and sys.platform != "win32" and isinstance(fault, termios.error):
        number = fault.args[0]
    return number if isinstance(number, int) else None


#: What pyserial raises when it opens or sets a port: SerialException is an OSError; a rate that
#: cannot be set is one of the next two, or the last where the system knows only the usual ones.
_USUAL: Final = (OSError, ValueError, OverflowError, NotImplementedError)
FAULTS: Final = _USUAL if sys.platform == "win32" else (*_USUAL, termios.error)
