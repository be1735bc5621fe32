"""Who listens to the recorded transmissions of a bus: a decoder for each lane, in order of time.

Owns that a decoder begins anew after the silence in which a device would have given up what had
not come whole.
"""

from __future__ import annotations

from collections.abc import Sequence

from sacbus.kernel import LineRate, Ns
from sacbus.node import Decoder, Protocol
from sacbus.trace.records import Sent

__all__ = ["Ear"]


class Ear:
    """Hears what was sent on a line of ``rate``; each lane for itself."""

    def __init__(self, protocol: Protocol, rate: LineRate) -> None:
        self.protocol = protocol
        self._patience = protocol.patience(rate.span(1))
        #: By lane, with the end of what was heard last.
        self._decoders: dict[int, tuple[Decoder, Ns]] = {}

    def hear(self, sent: Sent) -> Sequence[tuple[object, int, int]]:
        """What it completes, as :meth:`Decoder.locate` gives it."""
        decoder, until = self._decoders.get(sent.lane, (None, sent.start))
        if decoder is None or (self._patience is not None and sent.start - until >= self._patience):
            decoder = self.protocol.decoder(sent.lane)
        self._decoders[sent.lane] = decoder, sent.end
        return decoder.locate(sent.arrived, sent.ninth)
