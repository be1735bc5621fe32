"""A client at another baud rate than the line's: what becomes of the bytes between the two.

Owns the one way in which a link touches bytes. A pty would pass on any byte at any setting; a wire
does not, and a program that sets the wrong rate must find out here and not on the machine.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Final

from .link import Link

__all__ = ["Tuning"]


#: Per cent that two rates may differ: at 10 bits a byte a receiver that samples in the middle of
#: the last bit is wrong beyond 5 %, and half of that is what data sheets leave to each side.
TOLERANCE: Final = 2.5

#: Asking for the client's rate costs the system a call; after bytes from it, so many packets to it
#: do without.
TRUST: Final = 8


class Tuning:
    """Between a link and a line of ``baud``: passes bytes on as they are, or spoilt.

    At another rate every byte arrives as another value, drawn from ``noise``; ``tell`` is given a
    sentence each time the client's rate turns out to be a new wrong one.
    """

    __slots__ = ("_baud", "_link", "_noise", "_right", "_tell", "_told", "_trust", "spoilt")

    def __init__(self, link: Link, baud: int, noise: Random, tell: Callable[[str], object]) -> None:
        self._link = link
        self._baud = baud
        self._noise = noise
        self._tell = tell
        self._told: int | None = None
        self._right = True
        #: How often what the client's last bytes showed is taken to hold for bytes to it.
        self._trust = 0
        #: Bytes spoilt so far, in both directions.
        self.spoilt = 0

    def from_client(self, data: bytes) -> bytes:
        """What arrives on the line of ``data`` from the client, now."""
        self._look()
        self._trust = TRUST
        return data if self._right else self._spoil(data)

    def to_client(self, data: bytes) -> bytes:
        """What arrives at the client of ``data`` from the line, now."""
        if self._trust:
            self._trust -= 1
        else:
            self._look()
        return data if self._right else self._spoil(data)

    def _look(self) -> None:
        rate = self._link.client_baud()
        self._right = rate is None or abs(rate - self._baud) * 100 <= TOLERANCE * self._baud
        if self._right:
            self._told = None
        elif rate != self._told:
            self._told = rate
            self._tell(
                f"the program on {self._link.where} has set {rate} baud, the line runs at "
                f"{self._baud}: bytes arrive garbled"
            )

    def _spoil(self, data: bytes) -> bytes:
        self.spoilt += len(data)
        return bytes(byte ^ self._noise.randrange(1, 256) for byte in data)
