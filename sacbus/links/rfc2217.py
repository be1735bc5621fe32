"""A TCP port that programs take for a serial port: RFC 2217, with rate, parity and modem lines.

Owns the link of one such program, which is telnet (telnet.py) around its TCP connection (tcp.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from .link import Link, LinkCounters, SerialFormat, TellingLink
from .tcp import TcpServer
from .telnet import Telnet

__all__ = ["Rfc2217Link", "Rfc2217Server"]


class Rfc2217Link:
    """One program that has connected; made by Rfc2217Server around ``stream``.

    ``baud`` is the rate until the program sets its own. Counts the line's bytes; what telnet adds
    to them counts as nothing.
    """

    kind: Final = "rfc2217"

    def __init__(self, stream: Link, baud: int) -> None:
        self.counters = LinkCounters(clients=1)
        self.where = stream.where
        self._stream = stream
        self._baud = baud
        self._telnet: Telnet | None = None
        self._deliver: Callable[[bytes], None] | None = None
        self._missed = 0  # what the stream has dropped, as far as that has been counted here

    def open(self, deliver: Callable[[bytes], None]) -> None:
        # Only then does it begin to negotiate: the answers find somebody to talk to.
        self._stream.open(self._receive)
        self._deliver = deliver
        self._telnet = Telnet(self._baud, self._pass_on, self._say)

    def send(self, data: bytes) -> None:
        stream = self._stream
        stream.send(Telnet.escaped(data))
        if stream.counters.dropped_out == self._missed:
            self.counters.bytes_out += len(data)
        else:
            self._missed = stream.counters.dropped_out
            self.counters.dropped_out += len(data)

    def hold(self, *, held: bool) -> None:
        self._stream.hold(held=held)

    def client_baud(self) -> int:
        """The rate that the program has set; the bus's own before."""
        return self._baud if self._telnet is None else self._telnet.port.baudrate

    def client_format(self) -> SerialFormat:
        """Data bits, parity and stop bits that the program has set; 8N1 before."""
        return SerialFormat() if self._telnet is None else self._telnet.port.format

    @property
    def left(self) -> Callable[[], object] | None:
        """As TellingLink.left, which its stream knows of."""
        return self._stream.left if isinstance(self._stream, TellingLink) else None

    @left.setter
    def left(self, left: Callable[[], object] | None) -> None:
        if isinstance(self._stream, TellingLink):
            self._stream.left = left

    def close(self) -> None:
        self._deliver = None
        self._stream.close()

    def end(self) -> None:
        """The stream has ended: count what it did not bring home, escapes included."""
        self._deliver = None
        self.counters.dropped_out += self._stream.counters.dropped_out - self._missed
        self._missed = self._stream.counters.dropped_out

    def _receive(self, data: bytes) -> None:
        assert self._telnet is not None
        self._telnet.receive(data)

    def _pass_on(self, data: bytes) -> None:
        if self._deliver is not None:
            self.counters.bytes_in += len(data)
            self._deliver(data)

    def _say(self, answers: bytes) -> None:
        self._stream.send(answers)
        self._missed = self._stream.counters.dropped_out


class Rfc2217Server:
    """As TcpServer, for programs that speak RFC 2217: ``baud`` is the rate that they find set."""

    kind: Final = "rfc2217"

    def __init__(self, host: str = "", port: int = 0, baud: int = 38_400) -> None:
        self._baud = baud
        self._streams = TcpServer(host, port, scheme="rfc2217")
        self._links: set[Rfc2217Link] = set()
        self._left = LinkCounters()

    @property
    def where(self) -> str:
        return self._streams.where

    @property
    def counters(self) -> LinkCounters:
        total = LinkCounters()
        total.add(self._left)
        for link in self._links:
            total.add(link.counters)
        return total

    async def open(self, admit: Callable[[Link], Callable[[], None]]) -> None:
        """Let programs in. Raises LinkError as TcpServer's does."""

        def let_in(stream: Link) -> Callable[[], None]:
            link = Rfc2217Link(stream, self._baud)
            self._links.add(link)

            def left() -> None:
                link.end()
                self._links.discard(link)
                self._left.add(link.counters)
                gone()

            try:
                gone = admit(link)
            except BaseException:
                self._links.discard(link)
                raise
            return left

        await self._streams.open(let_in)

    def close(self) -> None:
        """Let everybody go; each one's leaving is told before this ends."""
        self._streams.close()
