"""What the bus must know of a wire protocol: who is addressed, when to act, what was said.

Owns this contract; knows no protocol and no node.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from typing import Protocol as Contract

from sacbus.kernel import LineRate, Ns

__all__ = [
    "EVERYONE",
    "MASTER",
    "Decoder",
    "Protocol",
    "Said",
]

#: What :meth:`Protocol.addressed` gives when all nodes must hear.
EVERYONE: Final = None

#: Stands for the master in :class:`Said` where a protocol gives it no address.
MASTER: Final = -1


@dataclass(frozen=True, slots=True)
class Said:
    """What one of a decoder's events says, in a form that is every protocol's.

    ``kind``: ``packet``, ``ack``, ``nak`` (an answer to a packet) or ``garbage``, which has no
    ``source`` and no ``destination``. ``general``: it is for everybody. ``data`` is a packet's
    body, or the garbage as it came. ``words`` say what it means, without addresses. ``verdict`` is
    what the check says: ``right``, ``unchecked`` (none was sent), ``wrong``, or a word of the
    protocol's own for what else is wrong; empty where nothing is to be checked. ``size``: bytes on
    the wire. ``binary``: the body is no text.
    ``reply_after``: how long after the end of a packet its answer begins, by the protocol's
    figures, in ns; None when nobody answers it.
    """

    kind: str
    source: int | None
    destination: int | None
    data: bytes
    words: str
    verdict: str
    size: int
    reply_after: Ns | None = None
    general: bool = False
    binary: bool = False

    @property
    def body(self) -> str:
        """``data`` as people are shown it: as text, or in hexadecimal where it is ``binary``."""
        return self.data.hex(" ") if self.binary else self.data.decode("latin-1")


class Decoder(Contract):
    """Bytes of a line to what they say; events are the protocol's own types. Never raises."""

    @property
    def pending(self) -> bytes:
        """The bytes that are not decided yet: a bounded number."""
        ...

    @property
    def unfinished(self) -> bool:
        """Whether what is pending may yet become a packet; noise never does."""
        ...

    def receive(self, data: bytes, ninth: bytes | None = None) -> Sequence[object]:
        """The events that these bytes complete; ``ninth``: a 0 or 1 for each, where known."""
        ...

    def locate(self, data: bytes, ninth: bytes | None = None) -> Sequence[tuple[object, int, int]]:
        """As :meth:`receive`, each with the places of its first byte and behind its last.

        Places count from the first byte of ``data``; those before it are negative.
        """
        ...


class Protocol(Contract):
    """What the bus must know of a wire protocol; stateless but for its decoders."""

    @property
    def name(self) -> str:
        """As in a configuration: ``sac``."""
        ...

    @property
    def lanes(self) -> int:
        """1: everybody on one pair of wires. 2: the master talks on one, the nodes on the other."""
        ...

    @property
    def rate(self) -> LineRate:
        """The line rate that its devices leave the factory with."""
        ...

    @property
    def addresses(self) -> range:
        """The addresses that a node may have."""
        ...

    @property
    def link_type(self) -> int | None:
        """The link type of its bytes in a capture, of the USER ones (147 to 162); None: any."""
        ...

    @property
    def dissector(self) -> Path | None:
        """The Lua file by which Wireshark reads such captures; None: there is none."""
        ...

    def patience(self, byte: Ns) -> Ns | None:
        """Silence after which a device gives up what has not come whole; None: it never does.

        ``byte`` is what one takes on the line.
        """
        ...

    def cuts(self, data: bytes) -> Sequence[int]:
        """Offsets at which a node may have to act before the transmission is over, ascending."""
        ...

    def addressed(self, data: bytes) -> Sequence[int] | None:
        """Addresses that these bytes open a packet for; EVERYONE when all nodes must hear."""
        ...

    def decoder(self, lane: int = 0) -> Decoder:
        """A new receiver for those who listen to everything that is on a lane."""
        ...

    def tell(self, event: object) -> Said:
        """What one of the decoder's events says; TypeError for anything else."""
        ...
