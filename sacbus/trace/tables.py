"""A recording as CSV, for spreadsheets and other people's programs.

Owns two tables: what happened, a row an event, and where the nodes were, a row a node every so
often. Times are whole ns.
"""

from __future__ import annotations

import csv
from typing import Final, TextIO

from sacbus.kernel import Ns
from sacbus.node import MASTER, find_protocol
from sacbus.trace.ear import Ear
from sacbus.trace.reading import Recording
from sacbus.trace.records import (
    BusAt,
    Changed,
    Driven,
    FaultSet,
    Mark,
    Moved,
    Outcome,
    Record,
    Sent,
    Switched,
    Told,
    Turned,
)
from sacbus.trace.track import Track

__all__ = ["EVENTS", "POSITIONS", "write_events", "write_positions"]

EVENTS: Final = ("time_ns", "bus", "node", "event", "value", "text")
POSITIONS: Final = ("time_ns", "bus", "node", "pulses", "steps", "rpm", "state")


def write_events(recording: Recording, out: TextIO) -> int:
    """What happened, in the order in which it was recorded; how many rows."""
    table = csv.writer(out, lineterminator="\n")
    table.writerow(EVENTS)
    ears = [_Words(bus) for bus in recording.buses]
    rows = 0
    for record in recording.events():
        row = _row(record, ears)
        if row is not None:
            table.writerow((record.when, recording.buses[record.bus].name, *row))
            rows += 1
    return rows


def write_positions(recording: Recording, out: TextIO, every: Ns) -> int:
    """Where each node was, every so often from the first record to the last; how many rows."""
    table = csv.writer(out, lineterminator="\n")
    table.writerow(POSITIONS)
    tracks = {(node.bus, node.address): Track(node) for node in recording.nodes}
    at: Ns | None = None
    rows = 0

    def sample(moment: Ns) -> int:
        written = 0
        for (bus, address), track in tracks.items():
            if track.segments:
                track.forget(moment)
                where = track.position(moment), track.steps(moment), f"{track.rpm(moment):.3f}"
                name = recording.buses[bus].name
                table.writerow((moment, name, address, *where, track.state(moment)))
                written += 1
        return written

    for record in recording:
        if at is None:
            at = record.when
        while record.when > at:
            rows += sample(at)
            at += every
        if type(record) is Moved:
            tracks[record.bus, record.node].segments.append(record.segment)
    if at is not None:
        rows += sample(at) if at <= recording.end else 0
    return rows


class _Words:
    """What the transmissions on a bus say."""

    def __init__(self, bus: BusAt) -> None:
        self._ear: Ear | None = None
        if bus.nodes:
            kinds = [node.kind for node in bus.nodes]
            self._ear = Ear(find_protocol(bus.protocol, kinds), bus.rate)

    def hear(self, sent: Sent) -> str:
        """What a transmission completes, in words."""
        ear = self._ear
        if ear is None:
            return ""
        said = [ear.protocol.tell(event) for event, _, _ in ear.hear(sent)]
        return "; ".join(
            one.words
            if one.source is None
            else f"{_name(one.source)}>{_name(one.destination)} {one.words}"
            + (f" ({one.verdict} check)" if one.verdict not in ("", "right") else "")
            for one in said
        )


def _name(address: int | None) -> str:
    return "" if address in (MASTER, None) else str(address)


def _row(record: Record | Changed, ears: list[_Words]) -> tuple[object, ...] | None:
    """Node, event, value and text; None for what is no event of its own."""
    match record:
        case Sent(sender=sender, arrived=arrived):
            return sender, "sent", arrived.hex(), ears[record.bus].hear(record)
        case Changed(node=node, state=state):
            return node, "state", state, ""
        case Told(node=node, kind=kind, text=text, line=line):
            return "" if node is None else node, kind, line, text
        case Driven(node=node, pin=pin, level=level):
            return node, "pin", level, pin
        case Turned(node=node, detents=detents):
            return node, "turn", detents, ""
        case Switched(node=node, on=on):
            return node, "power", int(on), ""
        case FaultSet(name=name, on=on):
            return "", "fault", int(on), name
        case Outcome(node=node, body=body, result=result):
            return node, "outcome", result, body.decode("latin-1")
        case Mark(text=text):
            return "", "mark", "", text
        case _:
            return None
