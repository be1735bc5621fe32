"""The client's side of a link: a serial port, opened to talk on it.

Owns opening a LINK as users write it, and pyserial-asyncio, whose known defects end in this file:
it never reports an adapter that was unplugged while nothing was written (its issues 12 and 28),
which only a write will then show; it hands out a connection before it is made; and it cannot drive
``socket://`` or ``rfc2217://`` (a later version opens those without it).
"""

from __future__ import annotations

import asyncio
import errno
import termios
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final

import serial
import serial_asyncio

from .errors import LinkError

__all__ = ["Line", "open_line"]

_CHECK: Final = "check the path, and whether the bus is running"
_WAIT: Final = "wait until the other program has closed it"
_REASONS: Final = {
    errno.ENOENT: ("no such file", _CHECK),
    errno.ENXIO: ("no such device", "plug it in, or check the path"),
    errno.EISDIR: ("it is a directory", _CHECK),
    errno.ENOTTY: ("it is not a serial port", _CHECK),
    errno.EACCES: ("permission denied", "join the group that owns it, often dialout"),
    errno.EBUSY: ("another program has it", _WAIT),
    errno.EWOULDBLOCK: ("another program has it", _WAIT),
    errno.EIO: ("nobody is at its other end", _CHECK),
}


class Line(asyncio.Protocol):
    """An open line: bytes in both directions, and its end."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._transport: asyncio.Transport | None = None
        self.made = asyncio.Event()
        self._hear: Callable[[bytes], None] | None = None
        self._lose: Callable[[str], None] | None = None
        self._closing = False
        self._lost: str | None = None

    def start(self, hear: Callable[[bytes], None], lose: Callable[[str], None]) -> None:
        """Have bytes go to ``hear`` from now on, and the line's end, told in words, to ``lose``."""
        self._hear = hear
        self._lose = lose
        if self._lost is not None:
            lose(self._lost)

    def send(self, data: bytes) -> None:
        """Write without waiting; what is written to a line that is gone is lost with it."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(data)

    def close(self) -> None:
        """Close the port. Idempotent."""
        self._closing = True
        if self._transport is not None:
            self._transport.abort()
            self._transport = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """asyncio's: the port is open."""
        assert isinstance(transport, asyncio.Transport)  # pyserial-asyncio's is one
        self._transport = transport
        self.made.set()

    def data_received(self, data: bytes) -> None:
        """asyncio's: bytes have come. Those before :meth:`start` were for somebody else."""
        if self._hear is not None:
            self._hear(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """asyncio's: the port is closed, by us or by its end."""
        self._transport = None
        if self._closing:
            return
        self._lost = (
            f"the line is gone ({exc or 'closed by the other end'}), {self._where}, open it again"
        )
        if self._lose is not None:
            self._lose(self._lost)


@asynccontextmanager
async def open_line(link: str, baud: int) -> AsyncIterator[Line]:
    """Open a serial port or pty by its path, 8N1, raw, for oneself alone; closed at the end.

    LinkError in one line when that cannot be had.
    """
    if "://" in link:
        raise LinkError(
            "a URL cannot be opened by this version", link, "give the path of a serial port or pty"
        )
    loop = asyncio.get_running_loop()
    try:
        _, line = await serial_asyncio.create_serial_connection(
            loop, lambda: Line(link), link, baudrate=baud, exclusive=True
        )
    except (serial.SerialException, OSError, ValueError) as fault:
        why, remedy = _reason(fault)
        raise LinkError(f"cannot open the line ({why})", link, remedy) from fault
    try:
        await line.made.wait()
        yield line
    finally:
        line.close()
        # The transport closes its descriptor in a callback of its own.
        await asyncio.sleep(0)


def _reason(fault: Exception) -> tuple[str, str]:
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
    if number is None and isinstance(fault, termios.error):
        number = fault.args[0]
    return number
