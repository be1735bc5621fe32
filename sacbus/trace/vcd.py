"""A recording as a Value Change Dump: every node's pins against time, for GTKWave and its like.

Owns which signals there are, and their order in time. Written as the recording is read, so a long
one takes no more memory than a short one. The one place that meets pyvcd, two of whose traits
matter: signals are declared before time goes on, and the end of the last one is written only when
closing is told the time.

Signals of a node: clk, those that its kind knows (of a SAC dir, ms1 to ms3, op_sa, op_sb), inputs
as they are driven (of a SAC sync), and tx_en, which is high while its bytes are on the line.
Whoever has more to show on the same clock gives it as a ``Signal`` each.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TextIO

import numpy as np
from vcd import VCDWriter
from vcd.writer import Variable

from sacbus.kernel import MS, SECOND, Ns
from sacbus.node import find_kind
from sacbus.trace.reading import Recording
from sacbus.trace.records import BusAt, Driven, Moved, NodeOf, Record, Sent
from sacbus.trace.track import Track

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sacbus.movement import Times

    Bytes = NDArray[np.uint8]

__all__ = ["Signal", "write_vcd"]

Wire = Variable[Any]  # pyvcd's: a level of 0 or 1 here

#: Bus time that is written at once: no longer, and no shorter, whatever happens in it.
LONGEST: Final[Ns] = SECOND
SHORTEST: Final[Ns] = MS

#: Edges that are held at a time, about.
MANY: Final = 400_000

#: Bytes of a transmission that may be on its way, whose beginning is known only at its end.
LONG: Final = 512

_CLK: Final = "clk"
_TX_EN: Final = "tx_en"


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """A wire that is no node's: its level at the beginning, and its changes in the order of time.

    times: int64, ns of the recording's clock; levels: 0 or 1, as many.
    """

    scope: str
    name: str
    level: int
    times: Times
    levels: Times | Bytes


def write_vcd(
    recording: Recording,
    out: TextIO,
    nodes: Collection[tuple[int, int]] | None = None,
    signals: Sequence[Signal] = (),
) -> int:
    """Write a recording as VCD, a tick a ns; how many changes of level were written.

    ``nodes``: only those, by bus and address. ``signals``: what is written besides; at one instant
    they change in the order given, behind the nodes' own.
    """
    records = iter(recording)
    first = _of_the_first_instant(records)
    since = first[0].when if first else 0
    writer = VCDWriter(
        out, timescale="1 ns", date="", version="sacbus", init_timestamp=since, check_values=False
    )
    wires: dict[tuple[int, int | str], _Wires] = {
        (node.bus, node.address): _Wires(node, bus, writer, since, first)
        for bus in recording.buses
        for node in bus.nodes
        if nodes is None or (node.bus, node.address) in nodes
    }
    others = [_Other(one, writer) for one in signals]
    page = _Page(writer, [*wires.values(), *others], since)
    delay = max((bus.rate.span(LONG) for bus in recording.buses), default=0)
    for record in chain(first, records):
        page.write_until(record.when - delay)
        wire = wires.get(_whose(record))
        if wire is not None:
            wire.take(record)
    end = max([recording.end, *(int(one.times[-1]) for one in signals if one.times.size)])
    page.write_until(end + 1, last=True)
    writer.close(end)
    return page.changes


def _whose(record: Record) -> tuple[int, int | str]:
    """Bus and address of the node whose signals a record is about."""
    match record:
        case Moved(node=node) | Driven(node=node) | Sent(sender=node):
            return record.bus, node
        case _:
            return record.bus, ""


def _of_the_first_instant(records: Iterator[Record]) -> list[Record]:
    """The first records, as far as they are of one instant, and one more."""
    first: list[Record] = []
    for record in records:
        first.append(record)
        if record.when > first[0].when:
            break
    return first


class _Edges(NamedTuple):
    """When a wire changes, and to which levels."""

    times: Times
    wire: Wire
    levels: Times | Bytes


class _Wires:
    """The signals of one node."""

    def __init__(
        self, node: NodeOf, bus: BusAt, writer: VCDWriter, since: Ns, first: Iterable[Record]
    ) -> None:
        self._track = Track(node)
        #: Edges of what is not told by how it moves: when, which, level.
        self._edges: list[tuple[Ns, Wire, int]] = []
        #: Up to when clk's edges have been written, so that they stay in order.
        self._clk_until = since
        levels: Mapping[str, int] = {}
        for one in first:
            if type(one) is Moved and (one.bus, one.node) == (node.bus, node.address):
                levels = one.segment.levels(since)
        scope = (f"{_word(bus.name)}", f"node_{node.address}")

        def wire(name: str, level: int) -> Wire:
            return writer.register_var(scope, name, "wire", size=1, init=level)

        self.clk = wire(_CLK, 0)
        self.levels = {name: wire(name, level) for name, level in levels.items()}
        #: Inputs, at rest until they are driven.
        drawn = find_kind(node.kind).drawn
        self.inputs = {name: wire(name, level) for name, level in drawn.items()}
        self.tx_en = wire(_TX_EN, 0)

    def take(self, record: Record) -> None:
        """Something of this node's has happened."""
        match record:
            case Moved(segment=segment):
                self._track.segments.append(segment)
            case Driven(when, pin=pin, level=level) if pin in self.inputs:
                self._edges.append((when, self.inputs[pin], level))
            case Sent(start=start, end=end):
                self._edges += [(start, self.tx_en, 1), (end, self.tx_en, 0)]
            case _:
                pass  # another input

    def edges(self, since: Ns, until: Ns) -> Iterator[_Edges]:
        """What changes in [since, until): when, which, and its levels then."""
        if self._edges:
            for when, wire, level in self._edges:
                # What began before that was on its way too long: its edge comes late.
                if when < until:
                    yield _Edges(np.array([max(when, since)]), wire, np.array([level]))
            self._edges = [one for one in self._edges if one[0] >= until]
        track = self._track
        if not track.segments or not _moves(track, since):
            return
        yield from self._clk(since, until)
        places = {
            place
            for segment in track.segments
            for place in (segment.since, segment.started, segment.end)
            if place is not None and since <= place < until
        }
        for place in sorted(places):
            for name, level in track.levels(place).items():
                yield _Edges(np.array([place]), self.levels[name], np.array([level]))
        track.forget(until)

    def _clk(self, since: Ns, until: Ns) -> Iterator[_Edges]:
        rises, falls = self._track.edges(since, until)
        if not rises.size:
            return
        both = np.column_stack((rises, falls)).ravel()
        # Single pulses that a command follows before they are over: each edge has its own ns.
        number = np.arange(both.size)
        both = np.maximum.accumulate(np.maximum(both, self._clk_until + 1) - number) + number
        self._clk_until = int(both[-1])
        yield _Edges(both, self.clk, number % 2 ^ 1)


class _Other:
    """A signal that is no node's, on its way into the file."""

    def __init__(self, signal: Signal, writer: VCDWriter) -> None:
        self._signal = signal
        self._wire: Wire = writer.register_var(
            _word(signal.scope), _word(signal.name), "wire", size=1, init=signal.level
        )

    def edges(self, since: Ns, until: Ns) -> Iterator[_Edges]:
        """What changes in [since, until)."""
        times = self._signal.times
        low, high = np.searchsorted(times, (since, until))
        if high > low:
            yield _Edges(times[low:high], self._wire, self._signal.levels[low:high])


def _moves(track: Track, since: Ns) -> bool:
    """Whether anything but rest is to be expected of it from an instant on."""
    last = track.segments[-1]
    at_rest = last.started is None or (last.end is not None and last.end < since)
    return last.since >= since or not at_rest


class _Page:
    """What is written at a time, in order."""

    def __init__(self, writer: VCDWriter, wires: Sequence[_Wires | _Other], since: Ns) -> None:
        self._writer = writer
        self._wires = wires
        self._until = since
        self._span = LONGEST
        #: What was found with the pulses of a page and comes after it: falls of clk.
        self._late: list[_Edges] = []
        self.changes = 0

    def write_until(self, moment: Ns, *, last: bool = False) -> None:
        """Write what changed before ``moment``, by whole pages unless it is the ``last``."""
        while moment - self._until >= self._span:
            self._write(self._until + self._span)
        if last and moment > self._until:
            self._write(moment)

    def _write(self, until: Ns) -> None:
        found, self._late = self._late, []
        for one in self._wires:
            found += one.edges(self._until, until)
        self._until = until
        if not found:
            self._span = LONGEST
            return
        times = np.concatenate([edges.times for edges in found])
        levels = np.concatenate([edges.levels for edges in found])
        which = np.repeat(np.arange(len(found)), [edges.times.size for edges in found])
        # Stable: what one wire does at one instant stays in order.
        order = np.argsort(times, kind="stable")
        order = order[: int(np.searchsorted(times[order], until))]
        change, wires = self._writer.change, [edges.wire for edges in found]
        for when, number, level in zip(
            times[order].tolist(), which[order].tolist(), levels[order].tolist(), strict=True
        ):
            wire = wires[number]
            if wire.value != level:
                change(wire, when, level)
                self.changes += 1
        for edges in found:
            late = edges.times >= until
            if late.any():
                self._late.append(_Edges(edges.times[late], edges.wire, edges.levels[late]))
        if times.size > MANY:
            self._span = max(self._span // 2, SHORTEST)
        elif times.size < MANY // 4:
            self._span = min(self._span * 2, LONGEST)


def _word(name: str) -> str:
    """A name as VCD can have it."""
    return re.sub(r"[^A-Za-z0-9_]", "_", name) or "bus"
