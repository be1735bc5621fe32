"""A TCP port as a way into the bus: any number of programs, each a talker of its own.

Owns the listening sockets, and the link of one program that has connected. Bytes pass as they are:
TCP has no rate, no parity and no modem lines (rfc2217.py has).

Theory of operation. A program's link is asyncio's protocol of its connection, so that nothing
stands between the socket and the bus. What leaves is handed to the transport, which hands it to
the system at once; only when the system takes no more does the transport begin to keep it, and only
then is its amount looked at: beyond ``BOUND`` whole chunks are dropped, never parts of one.

Two ends of a connection are not one. A program that has shut its writing side (``nc -N``) may still
read; TCP cannot tell it from one that has closed altogether (``socat -u``), before something is
sent to it. So both stay for ``LINGER`` after the last byte. And a program that has closed answers
what it is still sent with a reset, upon which asyncio ends the connection; what the program had
said before is then read from under it, for it is as good as what a UART holds.
"""

from __future__ import annotations

import asyncio
import errno
import os
import socket
from collections.abc import Callable, Sequence
from typing import Any, Final

from .errors import LinkError
from .link import Link, LinkCounters

__all__ = ["BOUND", "LINGER", "TcpLink", "TcpServer"]

#: Bytes that wait for a program which does not read them, beyond what the system holds itself: of
#: the order of what a pty holds, and 17 s of a line at 38400 baud.
BOUND: Final = 65_536

#: The most one read may bring, as of a pty: a line is in no hurry for more, and one program's flood
#: delays the others by no more than it takes to look at so much. One buffer does for all programs
#: of a server, since what it held is copied out before anybody else gets to read.
CHUNK: Final = 4_096

#: Seconds without a byte in either direction after which a program that writes no more is taken to
#: have left. A node answers within 1 ms of the end of a packet.
LINGER: Final = 2.0

#: Programs that one server lets in at once: as many as a bus has places for. The next one finds its
#: connection closed.
PROGRAMS: Final = 250

#: Connections that may wait to be let in: more programs than a bus has places for, at one instant.
BACKLOG: Final = 128

_LOOPBACK: Final = "127.0.0.1"

_OTHER_ADDRESS: Final = "use 127.0.0.1 or ::1 for this machine alone, 0.0.0.0 or :: for all"
_REASONS: Final = {
    errno.EADDRINUSE: (
        "the port is taken",
        "end the program that has it, or choose another port",
    ),
    errno.EADDRNOTAVAIL: ("this machine has no such address", _OTHER_ADDRESS),
    errno.EAFNOSUPPORT: ("this machine has no such kind of address", _OTHER_ADDRESS),
    errno.EACCES: ("permission denied", "choose a port from 1024 on"),
}
#: A host of several addresses is served if one of them can be had, these failures notwithstanding:
#: localhost is ::1 as well on machines that have no IPv6.
_HARMLESS: Final = frozenset((errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT))

Admit = Callable[[Link], Callable[[], None]]


class TcpLink(asyncio.BufferedProtocol):
    """One program that has connected; made by TcpServer. ``come`` is called once it is there.

    Once the program has left, or the link has been closed, there is nothing to open again: the
    program connects anew and gets another link.
    """

    kind: Final = "tcp"

    def __init__(
        self, where: str, buffer: memoryview, come: Callable[[TcpLink], Callable[[], None]]
    ) -> None:
        self.counters = LinkCounters()
        self.where = where
        self._buffer = buffer
        self._come = come
        self._gone: Callable[[], None] | None = None
        self._deliver: Callable[[bytes], None] | None = None
        self._transport: asyncio.Transport | None = None
        self._ended = False
        self._full = False  # the system takes no more, and the transport keeps what is sent
        self._kept = 0  # what it kept after the last chunk
        self._ending: asyncio.TimerHandle | None = None
        #: As TellingLink.left; told once.
        self.left: Callable[[], object] | None = None

    def open(self, deliver: Callable[[bytes], None]) -> None:
        if self._transport is None:
            raise LinkError("the program has left", self.where, "wait until it connects again")
        if self._deliver is not None:
            raise LinkError("the link is open already", self.where, "close it first")
        self._deliver = deliver

    def send(self, data: bytes) -> None:
        transport = self._transport
        # A transport that is closing would log what it is still given.
        if transport is None or transport.is_closing() or (self._full and not self._keeps(data)):
            self.counters.dropped_out += len(data)
        else:
            self.counters.bytes_out += len(data)
            transport.write(data)

    def hold(self, *, held: bool) -> None:
        if self._transport is None:
            return
        if held:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()

    def client_baud(self) -> None:
        """TCP has no rate."""

    def close(self) -> None:
        """Hang up on the program; whoever was told to mind its leaving is told before this ends."""
        if self._transport is not None:
            self.counters.dropped_out += self._transport.get_write_buffer_size()
            self._transport.abort()
            self._end()

    def _keeps(self, data: bytes) -> bool:
        """Whether the transport may be given this chunk too, though the system takes none."""
        assert self._transport is not None
        kept = self._transport.get_write_buffer_size()
        if kept + len(data) > BOUND:
            return False
        self._kept = kept + len(data)
        return True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """asyncio's: the program is there."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.where += f" from {_address(transport.get_extra_info('peername'))}"
        self.counters.clients = 1
        sock = transport.get_extra_info("socket")
        # asyncio does so too, but only for a socket that was made with the protocol's number.
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # A program whose machine has died is a talker no longer.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        # Otherwise Linux may hold megabytes for a program that does not read, minutes of a line.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BOUND)
        # Told as soon as the system takes no more, and again when it has taken all.
        transport.set_write_buffer_limits(high=0)
        try:
            gone = self._come(self)
        except BaseException:
            self.close()
            raise
        if self._ended:  # closed by whom it came to
            gone()
        else:
            self._gone = gone

    def get_buffer(self, _sizehint: int) -> memoryview:
        """asyncio's: where the next bytes go."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """asyncio's: bytes have come."""
        if self._deliver is not None:
            self.counters.bytes_in += nbytes
            self._deliver(self._buffer[:nbytes].tobytes())

    def eof_received(self) -> bool:
        """asyncio's: the program will write no more. It may still want its answers."""
        self._tell_left()
        self._linger(self._traffic())
        return True

    def pause_writing(self) -> None:
        """asyncio's: the system takes no more."""
        self._full = True
        assert self._transport is not None
        self._kept = self._transport.get_write_buffer_size()

    def resume_writing(self) -> None:
        """asyncio's: the system has taken all there was."""
        self._full = False
        self._kept = 0

    def connection_lost(self, exc: Exception | None) -> None:
        """asyncio's: the connection is gone; by our own doing if the link is closed by now."""
        if self._transport is None:
            return
        # asyncio has thrown it away; some of it may have gone out since the last chunk was sent.
        self.counters.dropped_out += self._kept
        try:
            if exc is not None:
                self._hear_the_rest(self._transport)
            self._tell_left()
        finally:
            self._end()

    def _hear_the_rest(self, transport: asyncio.Transport) -> None:
        """Deliver what the system still holds of a program that asyncio has given up on.

        That is the fate of one that said something and closed, without waiting for an answer: the
        answer comes back as an error, and asyncio does not read any more after that.
        """
        try:
            rest = transport.get_extra_info("socket").dup()
        except OSError:  # no descriptor left to read it by
            return
        with rest:
            while self._deliver is not None:
                try:
                    count = rest.recv_into(self._buffer)
                except OSError:  # nothing left to read
                    return
                if count == 0:
                    return
                self.buffer_updated(count)

    def _tell_left(self) -> None:
        left, self.left = self.left, None
        if left is not None:
            left()

    def _linger(self, before: int) -> None:
        """Hang up if, LINGER from now, no byte has passed since ``before``."""
        loop = asyncio.get_running_loop()
        self._ending = loop.call_later(LINGER, self._look_again, before)

    def _look_again(self, before: int) -> None:
        now = self._traffic()
        if now == before:
            self.close()
        else:
            self._linger(now)

    def _traffic(self) -> int:
        return self.counters.bytes_in + self.counters.bytes_out

    def _end(self) -> None:
        self._ended = True
        self._transport = self._deliver = None
        if self._ending is not None:
            self._ending.cancel()
        gone, self._gone = self._gone, None
        if gone is not None:
            gone()


class TcpServer:
    """Programs connect to ``port`` of ``host``, an address or a name; port 0: the system chooses.

    Without a host only programs of this machine get in. ``scheme`` begins the URL in ``where``.
    """

    kind: Final = "tcp"

    def __init__(self, host: str = "", port: int = 0, *, scheme: str = "socket") -> None:
        self._host = host or _LOOPBACK
        self._port = port
        self._scheme = scheme
        self._where = self._url(port)
        self._buffer = memoryview(bytearray(CHUNK))
        self._admit: Admit | None = None
        self._listeners: list[asyncio.Server] = []
        self._links: set[TcpLink] = set()
        self._left = LinkCounters()

    @property
    def where(self) -> str:
        return self._where

    @property
    def counters(self) -> LinkCounters:
        total = LinkCounters()
        total.add(self._left)
        for link in self._links:
            total.add(link.counters)
        return total

    async def open(self, admit: Admit) -> None:
        """Let programs in.

        Raises LinkError where the port cannot be had: it is taken, there is no such host, ...
        """
        if self._admit is not None:
            raise LinkError("the link is open already", self.where, "close it first")
        self._admit = admit
        loop = asyncio.get_running_loop()
        try:
            for sock in self._bound(await self._addresses(loop)):
                self._listeners.append(
                    await loop.create_server(
                        self._program, sock=sock, backlog=BACKLOG, start_serving=False
                    )
                )
            for listener in self._listeners:
                await listener.start_serving()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let everybody go; each one's leaving is told before this ends."""
        self._admit = None
        while self._listeners:
            self._listeners.pop().close()
        for link in list(self._links):
            link.close()
        self._where = self._url(self._port)

    def _url(self, port: int) -> str:
        return f"{self._scheme}://{_address((self._host, port))}"

    async def _addresses(self, loop: asyncio.AbstractEventLoop) -> Sequence[tuple[int, Any]]:
        """Family and address of all that the host's name stands for; one if the port is open."""
        host, port = self._host, self._port
        if not 0 <= port <= 65_535:
            raise LinkError("there is no such port", self.where, "choose one from 1024 to 65535")
        try:
            try:  # an address needs nobody to be asked, and no thread to wait for the answer
                found = socket.getaddrinfo(
                    host, port, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST
                )
            except socket.gaierror:
                found = await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        except (OSError, ValueError) as error:  # ValueError: no name at all by its spelling
            what = f"no such host ({getattr(error, 'strerror', None) or error})"
            raise LinkError(what, self.where, "check the name, or give an address") from error
        addresses = list(dict.fromkeys((family, address) for family, _, _, _, address in found))
        # Several sockets with a port of the system's choice each would have no URL in common.
        return addresses if port else addresses[:1]

    def _bound(self, addresses: Sequence[tuple[int, Any]]) -> list[socket.socket]:
        """A listening socket for each address; all or, with a LinkError, none."""
        bound: list[socket.socket] = []
        failed: OSError | None = None
        for family, address in addresses:
            try:
                bound.append(socket.create_server(address, family=family, backlog=BACKLOG))
            except OSError as error:
                failed = error
                if error.errno not in _HARMLESS:
                    break
        if failed is not None and (not bound or failed.errno not in _HARMLESS):
            for sock in bound:
                sock.close()
            why = os.strerror(failed.errno) if failed.errno is not None else str(failed)
            unknown = f"cannot be listened on ({why})", "choose another host or port"
            what, remedy = _REASONS.get(failed.errno or 0, unknown)
            raise LinkError(what, self.where, remedy) from failed
        self._where = self._url(bound[0].getsockname()[1])
        return bound

    def _program(self) -> TcpLink:
        """asyncio's: somebody has come."""
        if self._admit is None:
            # asyncio would fail over its own closed server, and forget to close the connection.
            raise ConnectionAbortedError("the server was closed while a program was coming in")
        return TcpLink(self._where, self._buffer, self._let_in)

    def _let_in(self, link: TcpLink) -> Callable[[], None]:
        # Closed while the program was coming in; or there are so many that all buses of the process
        # would want for descriptors.
        if self._admit is None or len(self._links) >= PROGRAMS:
            link.close()
            return lambda: None
        self._links.add(link)

        def left() -> None:
            self._links.discard(link)
            self._left.add(link.counters)
            gone()

        try:
            gone = self._admit(link)
        except BaseException:
            self._links.discard(link)
            raise
        return left


def _address(address: tuple[Any, ...] | None) -> str:
    """``host:port`` as a URL has it."""
    if not address:
        return "nobody"
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
