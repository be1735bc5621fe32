"""The client's side of a link: a LINK as users write it, opened to talk on it.

Owns what a LINK may be, and plain TCP; a serial port is opened in serialport.py, one that is served
by RFC 2217 in remote.py. Each of those is loaded where one is asked for.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import socket
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Final, Protocol, runtime_checkable
from urllib.parse import SplitResult, urlsplit

from .errors import LinkError

__all__ = ["BOUND", "Line", "open_line"]

#: Bytes that wait for a peer which does not take them; beyond that they are dropped. 17 s of a line
#: at 38400 baud.
BOUND: Final = 65_536

#: The most that one read of TCP may bring.
CHUNK: Final = 4_096

#: Seconds for a peer to answer at all, and for one that is left to take the last bytes.
CONNECT_TIMEOUT: Final = 5.0
FINISH_TIMEOUT: Final = 1.0

_URL: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_FORMS: Final = "give a path, socket://host:port or rfc2217://host:port"


class Wire(Protocol):
    """What a line is made of."""

    def send(self, data: bytes) -> object:
        """Write without waiting."""

    def set_dtr(self, *, asserted: bool) -> bool:
        """Set a spare output; False where there is none."""

    def close(self) -> object:
        """Close without waiting for anything. Idempotent."""

    async def finish(self) -> None:
        """Let what was written go out, for a moment, and close; then nothing is left open."""


@runtime_checkable
class MarkingWire(Wire, Protocol):
    """A wire that can give bytes a ninth bit: mark parity where it is 1, space where it is 0."""

    def check_marking(self) -> None:
        """LinkError where this very one cannot."""

    def send_marked(self, data: bytes, ninth: bytes) -> object:
        """Write without waiting, ``ninth`` a 0 or 1 for each byte; behind what earlier calls gave.

        Who sends marked bytes sends all of them so: the port has one parity at a time.
        """


class Line:
    """An open line: bytes in both directions, and its end. The same for every kind of LINK."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._wire: Wire | None = None
        self._hear: Callable[[bytes], None] | None = None
        self._lose: Callable[[str], None] | None = None
        self._closed = False
        self._lost: str | None = None

    def start(self, hear: Callable[[bytes], None], lose: Callable[[str], None]) -> None:
        """Have bytes go to ``hear`` from now on, and the line's end, told in words, to ``lose``."""
        self._hear = hear
        self._lose = lose
        if self._lost is not None:
            lose(self._lost)

    def send(self, data: bytes) -> None:
        """Write without waiting; what is written to a line that is gone is lost with it."""
        if self._wire is not None:
            self._wire.send(data)

    def check_marking(self) -> None:
        """LinkError for a line that carries no ninth bits."""
        wire = self._wire
        if not isinstance(wire, MarkingWire):
            raise no_ninth_bits(self._where)
        wire.check_marking()

    def send_marked(self, data: bytes, ninth: bytes) -> None:
        """As :meth:`send`, and never beside it, with a ninth bit of 0 or 1 for each byte."""
        if isinstance(self._wire, MarkingWire):
            self._wire.send_marked(data, ninth)

    def set_dtr(self, *, asserted: bool) -> bool:
        """Set the DTR output of a serial port, now; False where there is none, or it is gone."""
        return self._wire is not None and self._wire.set_dtr(asserted=asserted)

    def close(self) -> None:
        """Close the line at once. Idempotent."""
        wire = self._wire
        self.disconnect()
        if wire is not None:
            wire.close()

    def connect(self, wire: Wire) -> None:
        """The opener's: this is what the line is made of."""
        self._wire = wire

    def disconnect(self) -> None:
        """The opener's: nothing more goes in or out, and the end of the wire is no loss."""
        self._closed = True
        self._wire = None

    def hear(self, data: bytes) -> None:
        """The wire's: bytes have come. Those before :meth:`start` were for somebody else."""
        if self._hear is not None and not self._closed:
            self._hear(data)

    def lose(self, why: str) -> None:
        """The wire's: it is gone. Told once, and not if we have closed it."""
        self._wire = None
        if self._closed or self._lost is not None:
            return
        self._lost = f"the line is gone ({why}), {self._where}, open it again"
        if self._lose is not None:
            self._lose(self._lost)


@asynccontextmanager
async def open_line(link: str, baud: int, *, rts: bool = True) -> AsyncIterator[Line]:
    """Open LINK: the path of a serial port or pty, ``socket://`` or ``rfc2217://host:port``.

    A path is opened 8N1, raw, for oneself alone; so is a port behind RFC 2217, as far as its server
    goes. TCP has no rate. Closed at the end. LinkError in one line when it cannot be had.

    ``rts``: the level of a port's RTS. Who only listens leaves it low, since on many RS485 adapters
    it switches the driver on.
    """
    line = Line(link)
    wire = await _opener(link)(link, baud, line, rts)
    line.connect(wire)
    try:
        yield line
    finally:
        line.disconnect()
        await wire.finish()


Opener = Callable[[str, int, Line, bool], Awaitable[Wire]]


def _opener(link: str) -> Opener:
    if not _URL.match(link):
        return _open_port
    scheme = link.partition("://")[0].lower()
    if scheme == "socket":
        return _open_socket
    if scheme == "rfc2217":
        return _open_remote
    raise LinkError(f"{scheme}:// is no kind of link", link, _FORMS)


def endpoint(link: str) -> tuple[str, int, SplitResult]:
    """Host and port of a URL, and the whole of it. LinkError says what is wrong with it."""
    scheme = link.partition("://")[0].lower()
    form = f"write it as {scheme}://host:port"
    try:
        parts = urlsplit(link)
        host = parts.hostname
    except ValueError as fault:  # brackets that do not match
        raise LinkError(f"a malformed URL ({fault})", link, form) from fault
    if not host or parts.username is not None or parts.path not in ("", "/") or parts.fragment:
        raise LinkError("a malformed URL", link, form)
    try:
        port = parts.port
    except ValueError:
        port = 0
    if port is None:
        raise LinkError("a URL without a port number", link, form)
    if not port:
        given = parts.netloc.rpartition(":")[2]
        raise LinkError(f"{given!r} is not a port number", link, "give one from 1 to 65535")
    return host, port, parts


def no_ninth_bits(link: str) -> LinkError:
    """Why 9-bit mode cannot be had there."""
    return LinkError(
        "no ninth bits there", link, "take a serial port, or one behind RFC 2217, or 8-bit mode"
    )


def unreachable(link: str, host: str, fault: BaseException) -> LinkError:
    """Why a peer cannot be connected to, in one line."""
    if isinstance(fault, TimeoutError):
        return LinkError("nobody answers there", link, "check host and port, and the network")
    if isinstance(fault, ConnectionRefusedError):
        remedy = "check host and port, and whether the bus is running"
        return LinkError("connection refused: nobody listens there", link, remedy)
    if isinstance(fault, socket.gaierror | UnicodeError):
        return LinkError(f"unknown host {host}", link, "check the name, or give an address")
    number = getattr(fault, "errno", None)
    why = os.strerror(number).lower() if number is not None else str(fault)
    return LinkError(f"cannot connect ({why})", link, "check host and port, and the network")


async def _open_port(link: str, baud: int, line: Line, rts: bool) -> Wire:
    try:
        from .serialport import SerialConnection  # noqa: PLC0415 (see the headline)
    except ImportError as fault:
        raise LinkError("this system has no serial ports", link, _FORMS) from fault
    return SerialConnection(link, baud, line.hear, line.lose, rts=rts)


async def _open_remote(link: str, baud: int, line: Line, rts: bool) -> Wire:
    from .remote import RemotePort  # noqa: PLC0415 (see the headline)

    host, _, parts = endpoint(link)
    port = RemotePort(parts.geturl(), host, baud, line.hear, line.lose, rts=rts)
    await port.open()
    return port


async def _open_socket(link: str, _baud: int, line: Line, _rts: bool) -> Wire:
    host, port, parts = endpoint(link)
    if parts.query:
        raise LinkError("a malformed URL", link, "write it as socket://host:port")
    loop = asyncio.get_running_loop()
    failed: OSError | None = None
    try:
        async with asyncio.timeout(CONNECT_TIMEOUT):
            # One address after the other: of several failures asyncio makes a text without reason.
            for *_, address in await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM):
                try:
                    _, wire = await loop.create_connection(
                        lambda: _Socket(line), str(address[0]), int(address[1])
                    )
                except OSError as fault:
                    failed = fault
                else:
                    return wire
    except (OSError, UnicodeError) as fault:
        raise unreachable(link, host, fault) from fault
    raise unreachable(link, host, failed or OSError("no address")) from failed


class _Socket(asyncio.BufferedProtocol):
    """A connection of plain TCP. asyncio sets TCP_NODELAY itself.

    It reads into a buffer of its own: asyncio would get 256 KiB of memory from the system for every
    read, and give it back, which takes longer than all else that is done with an answer.
    """

    def __init__(self, line: Line) -> None:
        self._line = line
        self._buffer = memoryview(bytearray(CHUNK))
        self._transport: asyncio.Transport | None = None
        self._ended = asyncio.Event()

    def send(self, data: bytes) -> None:
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if transport.get_write_buffer_size() + len(data) <= BOUND:
            transport.write(data)

    def set_dtr(self, *, asserted: bool) -> bool:  # noqa: ARG002 (as other wires)
        return False

    def close(self) -> None:
        if self._transport is not None:
            self._transport.abort()

    async def finish(self) -> None:
        if self._transport is not None:
            self._transport.close()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(FINISH_TIMEOUT):
                await self._ended.wait()
        self.close()
        await self._ended.wait()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """asyncio's: the peer is there."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if sys.platform.startswith("linux"):
            # A peer whose machine has gone answers nothing; without this that is never told.
            sock = transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 10)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 5)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3)

    def get_buffer(self, _sizehint: int) -> memoryview:
        """asyncio's: where the next bytes go."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """asyncio's: bytes have come."""
        self._line.hear(self._buffer[:nbytes].tobytes())

    def connection_lost(self, exc: Exception | None) -> None:
        """asyncio's: the connection has ended, by us or by the peer."""
        self._transport = None
        self._ended.set()
        number = getattr(exc, "errno", None)
        self._line.lose(
            "closed by the other end" if number is None else os.strerror(number).lower()
        )
