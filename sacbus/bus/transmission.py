"""One transmission on a lane: who sent what, from when, and what became of it.

Owns the bytes on the wire and which of them were hit when transmissions overlapped.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from zlib import crc32

from sacbus.kernel import LineRate, Ns

if TYPE_CHECKING:
    from sacbus.bus.passage import Passage

__all__ = ["Transmission"]


class Transmission:
    """Bytes sent in one go, without a pause, from ``start`` to ``end`` (ns) by ``sender``.

    ``ninth`` holds a 0 or 1 for each byte where a line has ninth bits. ``number`` is unique on its
    medium. ``data`` is what the sender sent. What arrives is
    :meth:`arrived`; the two differ where another transmission overlapped (``hits``: from-to pairs
    in ns). ``cuts`` are the offsets at which nodes hear it, ``step`` how many of them have passed,
    ``to_nodes`` and ``to_listeners`` how many bytes each have heard.
    """

    __slots__ = (
        "_settled",
        "_wire",
        "cuts",
        "data",
        "end",
        "framing",
        "hits",
        "lane",
        "ninth",
        "number",
        "passage",
        "rate",
        "sender",
        "start",
        "step",
        "to_listeners",
        "to_nodes",
    )

    def __init__(
        self,
        number: int,
        sender: object,
        lane: int,
        start: Ns,
        data: bytes,
        rate: LineRate,
        end: Ns,
        cuts: Sequence[int],
        ninth: bytes | None = None,
    ) -> None:
        self.number = number
        self.sender = sender
        self.lane = lane
        self.start = start
        self.data = data
        self.rate = rate
        self.end = end
        self.cuts = cuts
        self.ninth = ninth
        #: A 1 for each byte that was sent without a stop bit; None where none was.
        self.framing: bytes | None = None
        self.step = 0
        self.to_nodes = 0
        self.to_listeners = 0
        self.hits: list[tuple[Ns, Ns]] | None = None
        #: What faults made of it; None where none touched it.
        self.passage: Passage | None = None
        #: What arrived, once hits have touched it, and how many bytes of that are settled.
        self._wire: bytearray | None = None
        self._settled = 0

    @property
    def collided(self) -> bool:
        """True once another transmission has overlapped this one."""
        return self.hits is not None

    def hit(self, begin: Ns, end: Ns) -> bool:
        """Another transmission overlaps from ``begin`` to ``end``; True the first time."""
        if self.hits is None:
            self.hits = [(begin, end)]
            return True
        self.hits.append((begin, end))
        return False

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of the faults that acted on it; none on nearly all."""
        return () if self.passage is None else self.passage.by

    def outcome(self, seed: int) -> bytes:
        """All that arrived of it where nothing but the line was between, once it is over.

        Where faults kept it from somebody, :attr:`passage` knows from whom.
        """
        if self.passage is None:
            return self.arrived(0, len(self.data), seed)
        return self.passage.outcome(seed)

    def outcome_ninth(self, seed: int) -> bytes | None:
        """The ninth bits that belong to :meth:`outcome`; None where none were sent."""
        if self.passage is None:
            return self.ninth_bits(0, len(self.data), seed)
        return self.passage.outcome_ninth(seed)

    def arrived(self, first: int, last: int, seed: int) -> bytes:
        """What arrived of bytes ``first`` to ``last`` (exclusive), all of which have ended by now.

        A byte that any part of another transmission overlapped comes out as another value: drivers
        that fight give no defined level, so no rule of combination would be truer than chance. The
        chance hangs on ``seed``, the transmission and the byte alone, so that everyone hears the
        same, whoever listens.
        """
        if self.hits is None:
            return self.data[first:last]
        if self._wire is None:
            self._wire = bytearray(self.data)
        if last > self._settled:
            for index in sorted(self._struck(self.hits, self._settled, last)):
                self._wire[index] ^= crc32(b"%d %d %d" % (seed, self.number, index)) % 255 + 1
            self._settled = last
        return bytes(self._wire[first:last])

    def ninth_bits(self, first: int, last: int, seed: int) -> bytes | None:
        """The ninth bits of bytes ``first`` to ``last`` (exclusive); None where none were sent.

        Those of overlapped bytes are as likely to be wrong as right.
        """
        if self.ninth is None or self.hits is None:
            return self.ninth and self.ninth[first:last]
        bits = bytearray(self.ninth[first:last])
        for index in self._struck(self.hits, first, last):
            bits[index - first] ^= crc32(b"%d %d %d" % (seed, self.number, index)) >> 16 & 1
        return bytes(bits)

    def framing_errors(self, first: int, last: int, seed: int) -> bytes | None:
        """A 1 for each of bytes ``first`` to ``last`` (exclusive) that has no stop bit.

        None where all have theirs. Of overlapped bytes half have none.
        """
        if self.hits is None:
            return self.framing and self.framing[first:last]
        found = bytearray(last - first if self.framing is None else self.framing[first:last])
        for index in self._struck(self.hits, first, last):
            found[index - first] |= crc32(b"%d %d %d" % (seed, self.number, index)) >> 17 & 1
        return bytes(found)

    def _struck(self, hits: list[tuple[Ns, Ns]], first: int, last: int) -> set[int]:
        """Indices in ``first``..``last`` of the bytes that a hit touches, however briefly."""
        struck: set[int] = set()
        for begin, end in hits:
            # The byte that was on its way as the hit began, and the first that begins after it.
            low = self.rate.bytes_begun(begin - self.start + 1) - 1
            high = self.rate.bytes_begun(end - self.start)
            struck.update(range(max(low, first), min(high, last)))
        return struck
