"""A recording, read back: its records as values.

Owns the way from a line to a record, and what is no recording. A file that ends in the middle of a
line was written by a process that was killed: what is whole counts.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from io import BufferedReader, RawIOBase
from pathlib import Path
from typing import Any, BinaryIO, Final

from sacbus.kernel import LineRate, Ns
from sacbus.node import NodeKind, find_kind
from sacbus.trace.packets import Packet, packets
from sacbus.trace.records import (
    FORMAT,
    BusAt,
    Changed,
    Driven,
    Ended,
    FaultSet,
    Mark,
    Moved,
    NodeOf,
    Outcome,
    Record,
    Sent,
    Switched,
    Told,
    Turned,
)
from sacbus.trace.states import with_states
from sacbus.trace.track import Track

__all__ = ["Recording", "RecordingError", "read"]

#: What JSON gives for an object; ``Any``: whatever stands in it, which is checked as it is used.
Stored = Mapping[str, Any]

#: What a line may lack, or have wrong, that is no recording's.
_WRONG: Final = (LookupError, TypeError, ValueError, AttributeError, RecursionError)


class RecordingError(ValueError):
    """A file that is no recording, or holds what none does; the text is a line for users."""


def read(source: Path | str | BinaryIO) -> Recording:
    """A recording from a file, or from an open one that can be read again from its beginning.

    RecordingError for what is none, KindError for nodes of a kind that is not installed, OSError
    for what cannot be read.
    """
    return Recording(source)


class Recording:
    """What was recorded. It is read from its file each time that it is walked through.

    ::

        recording = read("run.jsonl")
        for record in recording: ...                 # all of it, in the order of bus time
        track = recording.track(10)
        track.position(2 * SECOND)                   # pulses at that instant
        track.pulses(0, 2 * SECOND)                  # int64 array: ns of each
        for packet in recording.packets(): ...
    """

    def __init__(self, source: Path | str | BinaryIO) -> None:
        self._source = Path(source) if isinstance(source, str) else source
        #: How it is called in messages.
        self.name = str(source) if isinstance(source, str | Path) else "the recording"
        #: Whether the last walk found it closed in order, not cut off.
        self.whole = False
        #: The time of the last record of the last walk.
        self.end: Ns = 0
        self.buses = self._buses()

    @property
    def nodes(self) -> tuple[NodeOf, ...]:
        """All nodes of all buses."""
        return tuple(node for bus in self.buses for node in bus.nodes)

    def __iter__(self) -> Iterator[Record]:
        """All records, in the order in which they were made."""
        reader = _Reader(self.buses)
        self.whole = False
        for number, line in self._lines():
            if number == 1:
                continue
            try:
                record = reader.record(json.loads(line))
            except _WRONG as fault:
                raise self._wrong(number, "expected a record", line) from fault
            if record is not None:
                self.end = record.when
                self.whole = type(record) is Ended
                yield record

    def events(self) -> Iterator[Record | Changed]:
        """All records, and each change of a node's state at its time."""
        return with_states(self)

    def packets(self, bus: int = 0) -> Iterator[Packet]:
        """What was said on a bus, as a receiver that hears everything understands it."""
        return packets(self.buses[bus], (one for one in self if one.bus == bus))

    def track(self, address: int, bus: int = 0) -> Track:
        """Where a node was; KeyError when it is not in the recording."""
        try:
            return self.tracks[bus, address]
        except KeyError:
            raise KeyError(f"no node {address} on bus {bus} of {self.name}") from None

    @cached_property
    def tracks(self) -> Mapping[tuple[int, int], Track]:
        """Where every node was, by bus and address."""
        found = {(node.bus, node.address): Track(node) for node in self.nodes}
        for record in self:
            if type(record) is Moved:
                found[record.bus, record.node].segments.append(record.segment)
        return found

    def _buses(self) -> tuple[BusAt, ...]:
        for number, line in self._lines():
            try:
                head = json.loads(line)
                if head["sacbus"] != "recording":
                    raise ValueError(head["sacbus"])
            except _WRONG as fault:
                raise self._wrong(number, "expected a recording of sacbus", line) from fault
            if head.get("format") != FORMAT:
                raise RecordingError(
                    f"{self.name}: expected format {FORMAT}, got {head.get('format')!r}: "
                    "read it with the version of sacbus that wrote it"
                )
            try:
                return tuple(_bus(one) for one in head["buses"])
            except _WRONG as fault:
                raise self._wrong(number, "expected the buses of a recording", line) from fault
        raise RecordingError(f"{self.name}: expected a recording of sacbus, it is empty")

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        """Numbered, from 1; a last line that was not written to its end is left out."""
        if isinstance(self._source, Path):
            with self._source.open("rb") as file:
                yield from _whole_lines(file)
            return
        self._source.seek(0)
        if not isinstance(self._source, RawIOBase):
            yield from _whole_lines(self._source)
            return
        # By itself it would read a line byte by byte.
        buffer = BufferedReader(self._source)
        try:
            yield from _whole_lines(buffer)
        finally:
            if not self._source.closed:  # as it is when who reads has given up on an error
                buffer.detach()  # the file is not this one's to close

    def _wrong(self, number: int, expected: str, line: bytes) -> RecordingError:
        shown = line[:40].decode("utf-8", "backslashreplace").strip()
        return RecordingError(f"{self.name}, line {number}: {expected}, got {shown!r}")


def _whole_lines(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    for number, line in enumerate(file, start=1):
        # The first is judged whatever it is: no recording was ever killed before it was whole.
        if line.endswith(b"\n") or number == 1:
            yield number, line


def _bus(stored: Stored) -> BusAt:
    number = stored["bus"]
    return BusAt(
        number=number,
        name=stored["name"],
        protocol=stored["protocol"],
        rate=LineRate(stored["baud"], stored["bits"]),
        lanes=stored["lanes"],
        seed=stored["seed"],
        nodes=tuple(
            NodeOf(number, one["address"], one["kind"], one["settings"]) for one in stored["nodes"]
        ),
    )


class _Reader:
    """Objects to records; what it does not know it lets pass, as newer versions may write more."""

    def __init__(self, buses: tuple[BusAt, ...]) -> None:
        self._buses = buses
        nodes = [node for bus in buses for node in bus.nodes]
        self._by_name = {name: find_kind(name) for name in sorted({one.kind for one in nodes})}
        #: By bus and address.
        self._kinds: dict[tuple[int, int], NodeKind] = {
            (node.bus, node.address): self._by_name[node.kind] for node in nodes
        }
        self._shapes: dict[int, object] = {}
        self._makers: Mapping[str, Callable[[Stored], Record | None]] = {
            "sent": self._sent,
            "moves": self._moves,
            "shape": self._shape,
            "report": _told,
            "pin": _driven,
            "turn": _turned,
            "power": _switched,
            "fault": _fault,
            "outcome": _outcome,
            "mark": _mark,
            "end": _ended,
        }

    def record(self, stored: Stored) -> Record | None:
        """One line's; None for one that is no record by itself."""
        maker = self._makers.get(stored["is"])
        record = None if maker is None else maker(stored)
        if record is not None:
            _check(record, len(self._buses))
        return record

    def _sent(self, stored: Stored) -> Sent:
        data = bytes.fromhex(stored["data"])
        arrived = stored.get("arrived")
        ninth = stored.get("ninth")
        start = stored["start"]
        return Sent(
            when=stored["t"],
            bus=stored["bus"],
            start=start,
            end=stored.get("end", start + self._buses[stored["bus"]].rate.span(len(data))),
            lane=stored["lane"],
            sender=stored["from"],
            data=data,
            arrived=data if arrived is None else bytes.fromhex(arrived),
            collided=stored.get("collided", False),
            ninth=None if ninth is None else bytes.fromhex(ninth),
            faults=tuple(stored.get("faults", ())),
            missed=tuple(stored.get("missed", ())),
            heard={int(one): bytes.fromhex(what) for one, what in stored.get("heard", {}).items()},
        )

    def _shape(self, stored: Stored) -> None:
        self._shapes[stored["shape"]] = self._by_name[stored["kind"]].shape(stored)

    def _moves(self, stored: Stored) -> Moved:
        bus, node, when = stored["bus"], stored["node"], stored["t"]
        shape = self._shapes[stored["shape"]]
        return Moved(when, bus, node, self._kinds[bus, node].segment(when, shape, stored))


def _check(record: Record, buses: int) -> None:
    """TypeError or ValueError where what every reader relies on is of another kind, or nowhere."""
    if type(record.when) is not int or type(record.bus) is not int:
        raise TypeError(record.when, record.bus)
    if record.when < 0 or not 0 <= record.bus < buses:
        raise ValueError(record.when, record.bus)
    if type(record) is Sent and not (
        type(record.start) is type(record.end) is int and isinstance(record.sender, int | str)
    ):
        raise TypeError(record.start, record.end, record.sender)


def _told(stored: Stored) -> Told:
    return Told(
        stored["t"],
        stored["bus"],
        stored["node"],
        stored["kind"],
        stored["text"],
        stored.get("line", ""),
        stored.get("column", 0),
    )


def _driven(stored: Stored) -> Driven:
    return Driven(stored["t"], stored["bus"], stored["node"], stored["pin"], stored["level"])


def _turned(stored: Stored) -> Turned:
    return Turned(stored["t"], stored["bus"], stored["node"], stored["detents"])


def _switched(stored: Stored) -> Switched:
    return Switched(stored["t"], stored["bus"], stored["node"], stored["on"])


def _fault(stored: Stored) -> FaultSet:
    details = stored.get("details", {})
    return FaultSet(stored["t"], stored["bus"], stored["name"], stored["on"], details)


def _outcome(stored: Stored) -> Outcome:
    return Outcome(
        stored["t"],
        stored["bus"],
        stored["node"],
        stored["body"].encode("latin-1"),
        stored["result"],
        stored["attempts"],
    )


def _mark(stored: Stored) -> Mark:
    return Mark(stored["t"], stored["bus"], stored["text"], stored.get("details", {}))


def _ended(stored: Stored) -> Ended:
    return Ended(stored["t"], stored["bus"])
