"""Where links are to be opened: values that a configuration holds and the daemon acts upon.

Owns what can be said of a link before it exists; opens nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

__all__ = ["AdapterAt", "Place", "PtyAt", "Rfc2217At", "TcpAt", "terminal_path"]

#: A paced link starts to send no earlier than this after the line went idle (bus/port.py).
LATENCY_US: Final = 1_000


@dataclass(frozen=True, slots=True)
class PtyAt:
    """A pseudo-terminal, behind a stable symlink if ``path`` is given.

    ``echo`` gives a program its own bytes back, as a two-wire adapter does. ``latency_us``: how
    long the line has been idle before the program's bytes go out.
    """

    path: Path | None = None
    echo: bool = False
    latency_us: int = LATENCY_US


@dataclass(frozen=True, slots=True)
class TcpAt:
    """A TCP server; port 0 lets the system choose. Every client is a talker of its own."""

    host: str = "127.0.0.1"
    port: int = 0
    echo: bool = False
    latency_us: int = LATENCY_US


@dataclass(frozen=True, slots=True)
class Rfc2217At:
    """A TCP server that speaks RFC 2217: clients see a serial port, with rate, parity and RTS."""

    host: str = "127.0.0.1"
    port: int = 0
    echo: bool = False
    latency_us: int = LATENCY_US


@dataclass(frozen=True, slots=True)
class AdapterAt:
    """A real serial port, on which real nodes or a real mother may be.

    ``rts``: RTS switches the adapter's direction, by the kernel where it can. ``echo``: the adapter
    gives back what it sends, and that is taken out of what it hears.
    """

    path: str
    rts: bool = False
    echo: bool = False


Place = PtyAt | TcpAt | Rfc2217At | AdapterAt


def terminal_path(places: Iterable[Place], address: int | str) -> Path | None:
    """Where the terminal of a node is: beside the first pty that has a path, if one has."""
    for place in places:
        if isinstance(place, PtyAt) and place.path is not None:
            return place.path.with_name(f"{place.path.name}-{address}")
    return None
