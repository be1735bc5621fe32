"""A client whose serial settings are not the line's: what becomes of the bytes between the two.

Owns the one way in which a link touches bytes. A pty would pass on any byte at any setting; a wire
does not, and a program that sets the wrong rate, data bits or parity must find out here and not on
the machine. On a line with ninth bits parity is how a program sets them: mark is 1, space is 0.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Final

from .link import FormattedLink, Link, SerialFormat

__all__ = ["Tuning"]


#: Per cent that two rates may differ: at 10 bits a byte a receiver that samples in the middle of
#: the last bit is wrong beyond 5 %, and half of that is what data sheets leave to each side.
TOLERANCE: Final = 2.5

#: Asking for the client's rate costs the system a call; after bytes from it, so many packets to it
#: do without.
TRUST: Final = 8

#: Parities that a line understands: of 8N1 only none, since the parity bit comes where the stop bit
#: should be; where a ninth bit is, those that give it one value, and none (a second stop bit).
_PARITIES: Final = {False: "N", True: "NMS"}

_NINTH: Final = {"M": 1, "S": 0}


class Tuning:
    """Between a link and a line of ``baud``: passes bytes on as they are, or spoilt.

    ``bits`` are those of a byte on the line: 10 or, with ninth bits, 11. At another rate, other
    data bits or another parity every byte arrives as another value, drawn from ``noise``; ``tell``
    is given a sentence each time the client's setting turns out to be a new wrong one. Stop bits
    spoil nothing: a second one is a pause.
    """

    __slots__ = (
        "_baud",
        "_format",
        "_link",
        "_nine",
        "_noise",
        "_parities",
        "_right",
        "_tell",
        "_told",
        "_trust",
        "spoilt",
    )

    def __init__(
        self,
        link: Link,
        baud: int,
        noise: Random,
        tell: Callable[[str], object],
        *,
        nine: bool = False,
    ) -> None:
        self._link = link
        self._baud = baud
        self._nine = nine
        self._parities = _PARITIES[nine]
        #: What tells the client's format; None for a link that has no such thing.
        self._format = link.client_format if isinstance(link, FormattedLink) else None
        self._noise = noise
        self._tell = tell
        self._told: int | SerialFormat | None = None
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

    def ninth(self) -> int | None:
        """The ninth bit that the client's parity puts on its bytes just now: mark 1, space 0.

        None when it puts none there, and on a line that has no ninth bits.
        """
        if self._format is None or not self._nine:
            return None
        return _NINTH.get(self._format().parity)

    def _look(self) -> None:
        rate = self._link.client_baud()
        self._right = rate is None or abs(rate - self._baud) * 100 <= TOLERANCE * self._baud
        if not self._right:
            self._complain(rate, f"{rate} baud", f"runs at {self._baud}")
        elif self._format is not None and not self._fits(form := self._format()):
            self._right = False
            self._complain(form, str(form), f"is 8N1{' with a ninth bit' * self._nine}")
        else:
            self._told = None

    def _fits(self, form: SerialFormat) -> bool:
        return form.data_bits == 8 and form.parity in self._parities

    def _complain(self, wrong: int | SerialFormat | None, has: str, line: str) -> None:
        if wrong != self._told:
            self._told = wrong
            self._tell(
                f"the program on {self._link.where} has set {has}, the line {line}: "
                "bytes arrive garbled"
            )

    def _spoil(self, data: bytes) -> bytes:
        self.spoilt += len(data)
        return bytes(byte ^ self._noise.randrange(1, 256) for byte in data)
