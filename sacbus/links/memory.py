"""A link whose other end is an object in the same process: for tests and for virtual time.

No event loop and no descriptor: what the client writes is delivered before `write` returns, and
what the bus sends is heard before `send` returns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from .errors import LinkError
from .link import LinkCounters

__all__ = ["CAPACITY", "MemoryClient", "MemoryLink"]

CAPACITY: Final = 20_000
"""Bytes a client may leave unread; of the order of what a Linux pty holds."""


@dataclass(slots=True)
class _Wire:
    """What the two ends have in common."""

    where: str
    counters: LinkCounters = field(default_factory=LinkCounters)
    deliver: Callable[[bytes], None] | None = None
    held: bool = False
    client: MemoryClient | None = None
    left: Callable[[], object] | None = None
    unread: bytearray = field(default_factory=bytearray)

    def hang_up(self) -> None:
        self.client = None
        self.counters.dropped_out += len(self.unread)
        self.unread.clear()


class MemoryClient:
    """The outside's end, as a program holds a serial port; made by `MemoryLink.client`.

    `baud` may be assigned at any time, as a program may change its rate.
    """

    def __init__(self, wire: _Wire, baud: int, hear: Callable[[bytes], None] | None) -> None:
        self.baud = baud
        self.hear: Final = hear
        self._wire = wire

    def write(self, data: bytes) -> int:
        """Put bytes on the bus, all or, while the link is held, none; how many that was.

        Raises LinkError when either end has been closed.
        """
        wire = self._wire
        if wire.client is not self or wire.deliver is None:
            raise LinkError("the line is closed", wire.where, "open it again")
        if wire.held:
            return 0
        if data:
            wire.counters.bytes_in += len(data)
            wire.deliver(bytes(data))
        return len(data)

    def read(self, size: int | None = None) -> bytes:
        """What came, `size` bytes of it at the most; b"" when nothing waits or an end is closed."""
        if self._wire.client is not self:
            return b""
        data = bytes(self._wire.unread[:size])
        del self._wire.unread[:size]
        return data

    def close(self) -> None:
        """Leave; what is unread is dropped and counted. May be called again."""
        if self._wire.client is self:
            self._wire.hang_up()
            if self._wire.left is not None:
                self._wire.left()


class MemoryLink:
    """The bus's end. It takes one client at a time."""

    kind: Final = "memory"

    def __init__(
        self, where: str = "memory", *, baud: int = 38_400, capacity: int = CAPACITY
    ) -> None:
        self._wire = _Wire(where)
        self._baud = baud
        self._capacity = capacity

    @property
    def where(self) -> str:
        return self._wire.where

    @property
    def left(self) -> Callable[[], object] | None:
        """As TellingLink.left."""
        return self._wire.left

    @left.setter
    def left(self, left: Callable[[], object] | None) -> None:
        self._wire.left = left

    @property
    def counters(self) -> LinkCounters:
        return self._wire.counters

    def open(self, deliver: Callable[[bytes], None]) -> None:
        if self._wire.deliver is not None:
            raise LinkError("the link is open already", self.where, "close it first")
        self._wire.deliver = deliver

    def send(self, data: bytes) -> None:
        taken = 0
        client = self._wire.client
        if client is not None and client.hear is not None:
            taken = len(data)
            client.hear(data)
        elif client is not None:
            taken = min(len(data), self._capacity - len(self._wire.unread))
            self._wire.unread += data[:taken]
        self.counters.bytes_out += taken
        self.counters.dropped_out += len(data) - taken

    def hold(self, *, held: bool) -> None:
        self._wire.held = held

    def client_baud(self) -> int:
        """The rate the client has set; the bus's own when nobody is there."""
        return self._baud if self._wire.client is None else self._wire.client.baud

    def close(self) -> None:
        """End the link, for a client too: it has nothing left to read and cannot write any more."""
        self._wire.deliver = None
        self._wire.held = False
        self._wire.hang_up()

    def client(
        self, hear: Callable[[bytes], None] | None = None, *, baud: int | None = None
    ) -> MemoryClient:
        """Open the other end. With `hear`, bytes go there at once; else they wait to be read.

        Raises LinkError when the link is closed or has a client already.
        """
        wire = self._wire
        if wire.deliver is None:
            raise LinkError("the link is closed", self.where, "open it first")
        if wire.client is not None:
            raise LinkError("the link has a client already", self.where, "close that one first")
        wire.client = MemoryClient(wire, self._baud if baud is None else baud, hear)
        wire.counters.clients += 1
        return wire.client
