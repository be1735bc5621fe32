"""The client's side of a link: a serial port, opened to talk on it.

Owns opening a LINK as users write it, and pyserial-asyncio, whose known defects end in this file:
it never reports an adapter that was unplugged while nothing was written (its issues 12 and 28),
which only a write will then show; it hands out a connection before it is made; and it cannot drive
``socket://`` or ``rfc2217://`` (a later version opens those without it).
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import serial
import serial_asyncio

from .errors import LinkError

__all__ = ["Line", "open_line"]


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
    """Open a serial port or pty by its path, 8N1, raw, for oneself alone; closed at the block's end.

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
        raise LinkError(
            f"cannot open the line ({_reason(fault)})", link, "check the path, and who else has it"
        ) from fault
    try:
        await line.made.wait()
        yield line
    finally:
        line.close()
        # The transport closes its descriptor in a callback of its own.
        await asyncio.sleep(0)


def _reason(fault: Exception) -> str:
    cause = fault.__context__ if isinstance(fault, serial.SerialException) else fault
    return getattr(cause, "strerror", None) or str(fault)
