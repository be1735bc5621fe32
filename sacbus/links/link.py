"""The contract of a link: how outside bytes reach the bus, and how the bus answers.

A link moves bytes and counts them, nothing more: it knows neither packets nor times nor nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

__all__ = ["FormattedLink", "Link", "LinkCounters", "SerialFormat", "Server", "TellingLink"]


@dataclass(slots=True)
class LinkCounters:
    """What went through a link since it was made; they only grow, over closing and opening too."""

    bytes_in: int = 0
    """Bytes from clients, handed on to `deliver`."""
    bytes_out: int = 0
    """Bytes that `send` could hand to the system, those included that a client left unread."""
    dropped_out: int = 0
    """Bytes that no client got: nobody was there, the buffer was full, or they were left unread."""
    clients: int = 0
    """Times a client opened the other end; several in the same instant may count once."""
    framing_errors: int = 0
    """Bytes that came in without a stop bit, where the system counts them: a real port of Linux."""
    reconnects: int = 0
    """Times the other end was lost and found again: an adapter that was unplugged."""

    def add(self, more: LinkCounters) -> None:
        """Count what another link has counted as well, as a server does of its programs."""
        self.bytes_in += more.bytes_in
        self.bytes_out += more.bytes_out
        self.dropped_out += more.dropped_out
        self.clients += more.clients
        self.framing_errors += more.framing_errors
        self.reconnects += more.reconnects


@dataclass(frozen=True, slots=True)
class SerialFormat:
    """What a program wants a byte to look like on its serial line; as text ``8N1``."""

    data_bits: int = 8
    """5 to 8."""
    parity: str = "N"
    """N none, E even, O odd, M mark (always 1), S space (always 0)."""
    stop_bits: float = 1
    """1, 1.5 or 2."""

    def __str__(self) -> str:
        return f"{self.data_bits}{self.parity}{self.stop_bits:g}"


class Link(Protocol):
    """One way into the bus. All calls come from one thread, the event loop's where there is one."""

    @property
    def kind(self) -> str:
        """`pty`, `memory`, ...: what `sacbus serve` prints."""

    @property
    def where(self) -> str:
        """What a user opens, such as a path; empty until `open` where the system chooses it."""

    @property
    def counters(self) -> LinkCounters: ...

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """Let clients in; `deliver` gets every chunk they write, in order, never empty.

        Raises LinkError when the link cannot be had, and then leaves nothing behind, or when it is
        open already. A closed link may be opened again.
        """

    def send(self, data: bytes) -> None:
        """Hand bytes to whoever listens. Never blocks and never raises, even when closed.

        What an absent or slow reader misses is dropped and counted, as on a serial line.
        """

    def hold(self, *, held: bool) -> None:
        """Take no more bytes from the client, which then waits as at a full UART; or go on.

        A little that is on its way already may still be delivered. Held or not is forgotten when
        the link is closed.
        """

    def client_baud(self) -> int | None:
        """The rate the client has set, in bits a second; None where a link has no such thing."""

    def close(self) -> None:
        """Let everybody go; leaves no descriptor and no file. May be called again."""


@runtime_checkable
class FormattedLink(Link, Protocol):
    """A link that also knows how its client has set the bits of a byte.

    Few do: a pty keeps 8N whatever a program asks for, and TCP has no such thing.
    """

    def client_format(self) -> SerialFormat:
        """What the client has set; called often, so it must cost next to nothing."""


@runtime_checkable
class TellingLink(Link, Protocol):
    """A link that tells when its client is gone, while it lasts itself.

    A pty outlives its programs, and an adapter goes on when it is plugged in again; what a server
    lets in may still want answers after it has said its last word, and is told of as soon as that.
    """

    left: Callable[[], object] | None
    """Called when the last client has said all that it ever will, and that has been delivered; also
    when another one came in the same instant. Not when the link is closed. None: nobody is told."""


class Server(Protocol):
    """A place that many programs connect to at once; each of them is a link of its own.

    ``admit`` is called with the link of each program that comes, its far end open already. It opens
    the link (:meth:`Link.open`) and gives back what the server calls, once, when the program has
    left; by then the link is closed.
    """

    @property
    def kind(self) -> str:
        """`tcp`, `rfc2217`: what `sacbus serve` prints."""

    @property
    def where(self) -> str:
        """What a user opens: a URL; with the port that the system chose, once open."""

    @property
    def counters(self) -> LinkCounters:
        """Of all programs together, those included that have left."""

    async def open(self, admit: Callable[[Link], Callable[[], None]]) -> None:
        """Let programs in. Raises LinkError as Link.open does; may be opened again once closed."""

    def close(self) -> None:
        """Let everybody go, without waiting; leaves no descriptor. May be called again."""
