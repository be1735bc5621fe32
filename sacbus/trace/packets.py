"""From recorded transmissions to what was said.

Owns the meeting of a protocol's decoder with the recorded bytes and their times.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from sacbus.kernel import Ns
from sacbus.node import Said, find_protocol
from sacbus.trace.ear import Ear
from sacbus.trace.records import BusAt, Record, Sent

__all__ = ["Packet", "packets"]


@dataclass(frozen=True, slots=True)
class Packet:
    """A packet, an answer, or garbage, in the words of ``sacbus.node.Said``.

    ``sent`` is the transmission that completed it, ``first`` and ``last`` the places of its bytes
    there (``first`` is negative for one that began earlier).
    """

    start: Ns
    end: Ns
    said: Said
    sent: Sent
    first: int
    last: int


def packets(bus: BusAt, records: Iterable[Record]) -> Iterator[Packet]:
    """What the transmissions among some records say, each lane for itself.

    A bus without nodes says nothing: nobody knows its protocol.
    """
    if not bus.nodes:
        return
    protocol = find_protocol(bus.protocol, [node.kind for node in bus.nodes])
    ear = Ear(protocol, bus.rate)
    for sent in records:
        if type(sent) is not Sent:
            continue
        for event, first, last in ear.hear(sent):
            start = sent.start + bus.rate.span(max(first, 0))
            yield Packet(
                start, sent.start + bus.rate.span(last), protocol.tell(event), sent, first, last
            )
