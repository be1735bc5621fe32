"""A recording as a capture: from recorded transmissions to what was said, and into a pcapng file.

Owns the way from a record to what the watch takes. Who talked over whom is not recorded; it follows
from the times.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import BinaryIO, Final

from sacbus import feed
from sacbus.kernel import Ns
from sacbus.node import KindError, Protocol, find_protocol
from sacbus.trace.capture import Capture, CapturedLine
from sacbus.trace.reading import Recording
from sacbus.trace.records import BusAt, Record, Sent
from sacbus.watch import Watch

__all__ = ["write_pcapng"]

#: Bytes that are written together.
TOGETHER: Final = 1 << 16

_Hits = Mapping[int, list[tuple[Ns, Ns]]]


def write_pcapng(recording: Recording, file: BinaryIO) -> int:
    """Write what was said on the recorded lines, for Wireshark; how many packets that were.

    Packets, answers and garbage count alike. Times are bus time, counted from 1970 on. Reads the
    recording twice. KindError when no kind that is installed speaks a line's protocol; else as
    reading it and writing the file.
    """
    capture = Capture()
    lines = [_Line(bus, capture) for bus in recording.buses]
    file.write(capture.header + b"".join(line.captured.header for line in lines))
    for line, hits in zip(lines, _hits(recording, len(lines)), strict=True):
        line.hits = hits
    batch = bytearray()
    for record in recording:
        if type(record) is Sent:
            batch += lines[record.bus].blocks(record)
        if len(batch) >= TOGETHER:
            file.write(batch)
            batch.clear()
    for line in lines:
        batch += line.end(recording.end)
    file.write(batch)
    return sum(line.captured.count for line in lines)


class _Line:
    """One recorded line on its way into the capture."""

    def __init__(self, bus: BusAt, capture: Capture) -> None:
        self._watch = Watch(_protocol_of(bus), bus.rate, lanes=bus.lanes)
        self.captured: CapturedLine = capture.line(
            bus.name, bus.protocol, bus.rate, lanes=bus.lanes, times="bus time since 1970"
        )
        #: By the number of the transmission on this bus: when others talked over it.
        self.hits: _Hits = {}
        self._count = 0

    def blocks(self, sent: Sent) -> bytes:
        """What this transmission completes."""
        hits = self.hits.get(self._count, ())
        self._count += 1
        is_node = isinstance(sent.sender, int)
        entries = self._watch.sent(
            feed.Sent(
                sent.start,
                sent.end,
                sent.lane,
                f"node {sent.sender}" if is_node else str(sent.sender),
                sent.sender if isinstance(sent.sender, int) else None,
                sent.arrived,
                tuple(hits),
                sent.ninth,
            )
        )
        return b"".join(map(self.captured.blocks, entries))

    def end(self, now: Ns) -> bytes:
        """What is left over."""
        return b"".join(map(self.captured.blocks, self._watch.end(now)))


def _protocol_of(bus: BusAt) -> Protocol:
    try:
        return find_protocol(bus.protocol, [node.kind for node in bus.nodes])
    except KindError as fault:
        raise KindError(f"{fault}, bus {bus.name}, install the package of its nodes") from fault


def _hits(records: Iterable[Record], buses: int) -> list[_Hits]:
    """Of each bus, when others talked over a transmission, by its number there."""
    counts = [0] * buses
    collided: defaultdict[tuple[int, int], list[tuple[Ns, Ns, int]]] = defaultdict(list)
    for record in records:
        if type(record) is Sent:
            if record.collided:
                place = collided[record.bus, record.lane]
                place.append((record.start, record.end, counts[record.bus]))
            counts[record.bus] += 1
    hits: list[defaultdict[int, list[tuple[Ns, Ns]]]] = [defaultdict(list) for _ in range(buses)]
    for (bus, _), several in collided.items():
        several.sort()
        for at, (start, end, one) in enumerate(several):
            for begin, until, other in several[at + 1 :]:
                if begin >= end:
                    break
                overlap = max(start, begin), min(end, until)
                hits[bus][one].append(overlap)
                hits[bus][other].append(overlap)
    return list(hits)
