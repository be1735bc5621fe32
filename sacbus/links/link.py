"""The contract of a link: how outside bytes reach the bus, and how the bus answers.

A link moves bytes and counts them, nothing more: it knows neither packets nor times nor nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

__all__ = ["Link", "LinkCounters"]


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

    def client_baud(self) -> int | None:
        """The rate the client has set, in bits a second; None where a link has no such thing."""

    def close(self) -> None:
        """Let everybody go; leaves no descriptor and no file. May be called again."""
