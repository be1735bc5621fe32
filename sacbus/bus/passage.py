"""A passage: what faults make of one transmission on its way, and who hears what of it.

Owns the bytes as they arrive, when each of them begins, who is kept from hearing them, and the
names of the faults that had a hand in it. A transmission has one only while a fault touches it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from sacbus.bus.transmission import Transmission
from sacbus.bus.waveform import resampled
from sacbus.kernel import LineRate, Ns

__all__ = ["EVERY_LINK", "Passage"]

#: Stands for whoever listens without being a node, where a node's address would stand.
EVERY_LINK: Final = None


class Passage:
    """One transmission under faults. They change it in the order in which they were put on.

    ``values`` are the bytes that arrive, ``begins`` when each of them does (ns), ``ninth`` their
    ninth bits where there are some, ``framing`` a 1 for each that has no stop bit, where any may
    lack it. A *barrier* is asked whether it keeps the node of an address, or EVERY_LINK, from
    hearing.
    """

    __slots__ = (
        "_address_of",
        "_begins",
        "_node",
        "barriers",
        "by",
        "echoes",
        "end",
        "framing",
        "late",
        "left",
        "missed",
        "ninth",
        "receivers",
        "sent",
        "side",
        "silent",
        "values",
    )

    def __init__(self, sent: Transmission, address_of: Callable[[object], int | None]) -> None:
        self.sent = sent
        self._address_of = address_of
        #: The sender's address, once it was asked for; most faults never do.
        self._node: int | None = None
        self.values = bytearray(sent.data)
        self.ninth = None if sent.ninth is None else bytearray(sent.ninth)
        self.framing: bytearray | None = None
        #: Times of the bytes, once they are not those of the transmission any more.
        self._begins: list[Ns] | None = None
        #: When the line is free of it, if that is not when the sender should have ended.
        self.end: Ns | None = None
        #: The names of the faults that acted, each once, in the order in which they did.
        self.by: tuple[str, ...] = ()
        #: True when nothing of it ever gets on the line.
        self.silent = False
        #: Transmissions on different sides of a cut do not meet.
        self.side: Sequence[bool] = ()
        self.barriers: list[Callable[[int | None], bool]] = []
        #: Addresses of those who were kept from hearing what concerned them; a dict for its order.
        self.missed: dict[int | None, None] = {}
        #: Receivers at another rate than the line's, by address.
        self.receivers: dict[int, LineRate] = {}
        #: How much later than it arrives a listener is given it; and whether one hears itself.
        self.late: Callable[[object], Ns] | None = None
        self.echoes: Callable[[object], bool] | None = None
        #: Pieces of it that have not arrived to their ends.
        self.left = 0

    @property
    def concerns(self) -> bool:
        """Whether it differs from an ordinary transmission, or may to somebody."""
        return bool(self.by or self.barriers or self.late or self.echoes)

    @property
    def node(self) -> int | None:
        """The sender's address; None for one that is no node."""
        if self._node is None:
            self._node = self._address_of(self.sent.sender)
        return self._node

    def mark(self, name: str) -> None:
        """Note that the fault of that name acts on it."""
        if name not in self.by:
            self.by += (name,)

    @property
    def begins(self) -> list[Ns]:
        """When each byte begins; whoever moves one makes sure that none begins before the last."""
        if self._begins is None:
            sent = self.sent
            self._begins = [sent.start + sent.rate.span(index) for index in range(len(sent.data))]
        return self._begins

    def drop(self, index: int) -> None:
        """The byte does not arrive; the others keep their times."""
        del self.begins[index]
        del self.values[index]
        for bits in (self.ninth, self.framing):
            if bits is not None:
                del bits[index]

    def double(self, index: int) -> None:
        """The byte arrives twice; those behind it come a byte later."""
        byte = self.sent.rate.span(1)
        begins = self.begins
        begins.insert(index + 1, begins[index])
        self.values.insert(index + 1, self.values[index])
        for bits in (self.ninth, self.framing):
            if bits is not None:
                bits.insert(index + 1, bits[index])
        self.put_off(index + 1, byte)

    def put_off(self, index: int, late: Ns) -> None:
        """The byte, and all behind it, begin ``late`` ns later."""
        begins = self.begins
        for place in range(index, len(begins)):
            begins[place] += late

    def replace(self, data: bytes) -> None:
        """Other bytes come instead, from the same instant on, without a pause."""
        sent = self.sent
        self.values = bytearray(data)
        self.framing = None
        self._begins = [sent.start + sent.rate.span(index) for index in range(len(data))]
        if self.ninth is not None:
            self.ninth = bytearray(self.ninth[:1] * len(data))
        self.end = sent.start + sent.rate.span(len(data))

    def mistune(self, baud: int) -> None:
        """It is sent at another rate: others make of its bits what their own rate makes of them."""
        sent = self.sent
        rate = LineRate(baud, sent.rate.bits)
        begins = [sent.start + rate.span(index) for index in range(len(self.values))]
        self.end = sent.start + rate.span(len(self.values))
        self._read(rate, sent.rate, begins)

    def as_read_at(self, rate: LineRate) -> Passage:
        """What a receiver that is set to another rate than the line's makes of it."""
        heard = Passage(self.sent, self._address_of)
        heard.values, heard.ninth = self.values, self.ninth
        heard._read(self.sent.rate, rate, self.begins)
        return heard

    def _read(self, of: LineRate, at: LineRate, begins: Sequence[Ns]) -> None:
        found = resampled(self.values, self.ninth, begins, of, at)
        self._begins = [begin for begin, *_ in found]
        self.values = bytearray(value for _, value, _, _ in found)
        self.framing = bytearray(framing for *_, framing in found)
        if self.ninth is not None:
            self.ninth = bytearray(ninth for _, _, ninth, _ in found)

    def reaches(self, listener: int | None) -> bool:
        """Whether the node of an address, or EVERY_LINK, hears it; notes it if not."""
        for keeps in self.barriers:
            if keeps(listener):
                self.missed[listener] = None
                return False
        return True

    def pieces(self, rate: LineRate | None = None) -> list[Transmission]:
        """What arrives, in runs without a pause, each as a transmission of the same sender.

        ``rate`` is the receiver's where that is not the line's.
        """
        rate = rate or self.sent.rate
        values, begins = self.values, self._begins
        if begins is None:
            return [self._piece(rate, 0, len(values), self.sent.start)]
        # Times are truncated to ns, so bytes that follow each other may be one more apart.
        follows = rate.span(1) + 1
        found = []
        first = 0
        for index in range(1, len(values) + 1):
            if index == len(values) or begins[index] - begins[index - 1] > follows:
                found.append(self._piece(rate, first, index, begins[first]))
                first = index
        return found if values else []

    def outcome(self, seed: int) -> bytes:
        """All that arrived, where nobody was kept from hearing it."""
        if self.silent:
            return b""
        return b"".join(
            piece.arrived(0, len(piece.data), seed) for piece in self._struck(self.pieces())
        )

    def heard_by(self, listener: int | None, seed: int) -> bytes:
        """All that came to one who listened: the node of an address, or EVERY_LINK."""
        if listener in self.missed and listener not in self.receivers:
            return b""
        rate = None if listener is None else self.receivers.get(listener)
        if rate is None:
            return self.outcome(seed)
        pieces = self._struck(self.as_read_at(rate).pieces(rate))
        return b"".join(piece.arrived(0, len(piece.data), seed) for piece in pieces)

    def outcome_ninth(self, seed: int) -> bytes | None:
        """The ninth bits that belong to :meth:`outcome`; None where none were sent."""
        if self.ninth is None or self.silent:
            return None
        bits = [
            piece.ninth_bits(0, len(piece.data), seed) or b""
            for piece in self._struck(self.pieces())
        ]
        return b"".join(bits)

    def _struck(self, pieces: list[Transmission]) -> list[Transmission]:
        """What overlapped the whole overlapped its pieces."""
        for piece in pieces:
            piece.hits = self.sent.hits
        return pieces

    def _piece(self, rate: LineRate, first: int, last: int, start: Ns) -> Transmission:
        sent = self.sent
        piece = Transmission(
            sent.number,
            sent.sender,
            sent.lane,
            start,
            bytes(self.values[first:last]),
            rate,
            start + rate.span(last - first),
            (),
            None if self.ninth is None else bytes(self.ninth[first:last]),
        )
        if self.framing is not None:
            piece.framing = bytes(self.framing[first:last])
        return piece
