"""One transmission on a lane: who sent what, from when, and what became of it.

Owns the bytes on the wire and which of them were hit when transmissions overlapped.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

from sacbus.kernel import LineRate, Ns

__all__ = ["Transmission"]


@dataclass(slots=True, eq=False)
class Transmission:
    """Bytes sent in one go, without a pause, from ``start`` to ``end`` (ns) by ``sender``.

    ``data`` is what the sender sent. What arrives is :meth:`arrived`; the two differ where another
    transmission overlapped (``hits``: from-to pairs in ns).
    """

    sender: object
    start: Ns
    data: bytes
    rate: LineRate
    end: Ns
    hits: list[tuple[Ns, Ns]] = field(default_factory=list)
    #: Bytes of ``data`` whose fate is settled, and what arrived of them when hits touched them.
    _wire: bytearray | None = None
    _settled: int = 0

    def arrived(self, first: int, last: int, noise: Random) -> bytes:
        """What arrived of bytes ``first`` to ``last`` (exclusive), all of which have ended by now.

        A byte that any part of another transmission overlapped comes out as another value, drawn
        once from ``noise``: everyone hears the same. Drivers that fight give no defined level, so
        no rule of combination would be truer than chance.
        """
        if not self.hits:
            return self.data if first == 0 and last == len(self.data) else self.data[first:last]
        if self._wire is None:
            self._wire = bytearray(self.data)
        if last > self._settled:
            for index in sorted(self._struck(self._settled, last)):
                self._wire[index] ^= noise.randrange(1, 256)
            self._settled = last
        return bytes(self._wire[first:last])

    def _struck(self, first: int, last: int) -> set[int]:
        """Indices in ``first``..``last`` of the bytes that a hit touches, however briefly."""
        struck: set[int] = set()
        for begin, end in self.hits:
            # The first byte that ends after the hit began, and the first that begins after it.
            low = self.rate.bytes_begun(begin - self.start + 1) - 1
            high = self.rate.bytes_begun(end - self.start)
            struck.update(range(max(low, first), min(high, last)))
        return struck
