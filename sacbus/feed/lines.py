"""The lines of the feed: what each says, and the JSON that it is written as.

Owns the format, which ``docs/feed.md`` describes for other people's programs: one object a line,
named by ``event``. Fields and events may be added without a new number; so whoever reads them lets
pass what it does not know. Times are in ns of bus time.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Final

from sacbus.kernel import US, Ns
from sacbus.node import Report, ReportKind

__all__ = [
    "FORMAT",
    "Hello",
    "Line",
    "Missed",
    "Reached",
    "Sent",
    "Stopped",
    "Way",
    "decode",
    "encode",
    "report_fields",
]

#: Counts changes that old readers cannot bear.
FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class Way:
    """A link of the bus. ``device`` is where the path leads in the end; None for a URL."""

    kind: str
    where: str
    device: str | None


@dataclass(frozen=True, slots=True)
class Hello:
    """The first line: what the bus is, and what time it is there.

    ``clock`` is the wall clock's time at ``time``, ns since 1970; ``speed`` bus seconds pass in one
    of its seconds. ``nodes`` are addresses with kinds.
    """

    version: str
    bus: str
    protocol: str
    baud: int
    bits: int
    lanes: int
    speed: float
    nodes: tuple[tuple[int, str], ...]
    links: tuple[Way, ...]
    time: Ns
    clock: int


@dataclass(frozen=True, slots=True)
class Sent:
    """A transmission, told when it is over.

    ``sender`` in words; ``node`` its address if it is a node of this bus. ``data`` is what arrived.
    ``hits``: from when to when others talked over it. ``ninth``: a 0 or 1 for each byte where it
    was sent with ninth bits. ``faults``: names of those that acted on it; then ``sent`` is what was
    sent, nothing of which need have arrived.
    """

    start: Ns
    end: Ns
    lane: int
    sender: str
    node: int | None
    data: bytes
    hits: tuple[tuple[Ns, Ns], ...] = ()
    ninth: bytes | None = None
    faults: tuple[str, ...] = ()
    sent: bytes | None = None


@dataclass(frozen=True, slots=True)
class Reached:
    """Bus time has come so far: all that was over by then has been told."""

    time: Ns
    clock: int


@dataclass(frozen=True, slots=True)
class Missed:
    """So many lines are missing here, which were not read in time."""

    lines: int


@dataclass(frozen=True, slots=True)
class Stopped:
    """The last line: the bus has been closed."""


Line = Hello | Sent | Report | Reached | Missed | Stopped


def encode(line: Line, bus: str) -> bytes:
    """A line of the feed of that bus, with its line end."""
    return json.dumps(_fields(line, bus), separators=(",", ":")).encode() + b"\n"


def _fields(line: Line, bus: str) -> dict[str, object]:
    match line:
        case Sent():
            return _sent(line)
        case Report():
            return report_fields(line, bus)
        case Reached(time, clock):
            return {"event": "time", "time_ns": time, "clock_ns": clock}
        case Missed(lines):
            return {"event": "missed", "lines": lines}
        case Stopped():
            return {"event": "stopped"}
        case Hello():
            return {
                "event": "hello",
                "format": FORMAT,
                "version": line.version,
                "bus": line.bus,
                "protocol": line.protocol,
                "baud": line.baud,
                "bits": line.bits,
                "lanes": line.lanes,
                "speed": line.speed,
                "nodes": [{"node": node, "kind": kind} for node, kind in line.nodes],
                "links": [
                    {"kind": way.kind, "where": way.where, "device": way.device}
                    for way in line.links
                ],
                "time_ns": line.time,
                "clock_ns": line.clock,
            }


def report_fields(report: Report, bus: str) -> dict[str, object]:
    """A report as an object of JSON, in the feed of that bus and wherever else it is printed."""
    return {
        "event": "report",
        "bus": bus,
        "time_us": report.when / US,
        "node": report.address,
        "what": report.kind.value,
        "line": report.line,
        "column": report.column,
        "text": report.text,
    }


def _sent(line: Sent) -> dict[str, object]:
    fields: dict[str, object] = {
        "event": "transmission",
        "start_ns": line.start,
        "end_ns": line.end,
        "lane": line.lane,
        "sender": line.sender,
        "node": line.node,
        "collided": bool(line.hits),
        "data": line.data.hex(),
    }
    if line.hits:
        fields["hits_ns"] = line.hits
    if line.ninth is not None:
        fields["ninth"] = "".join("1" if bit else "0" for bit in line.ninth)
    if line.faults:
        fields["faults"] = line.faults
    if line.sent is not None:
        fields["sent"] = line.sent.hex()
    return fields


def decode(text: bytes) -> Line | None:
    """What a line says; None for an event that this version does not know.

    ValueError for what is no line of a feed, or of a format that this version cannot read.
    """
    try:
        fields = json.loads(text)
        return _line(fields["event"], fields)
    except (
        KeyError,
        TypeError,
        LookupError,
        AttributeError,
        OverflowError,
        RecursionError,
    ) as fault:
        raise ValueError(f"not a line of a feed: {text[:80]!r}") from fault


def _line(event: str, fields: dict[str, Any]) -> Line | None:
    """``Any``: whatever JSON holds; :func:`decode` takes what that may raise here."""
    match event:
        case "transmission":
            ninth, sent = fields.get("ninth"), fields.get("sent")
            return Sent(
                fields["start_ns"],
                fields["end_ns"],
                fields["lane"],
                fields["sender"],
                fields["node"],
                bytes.fromhex(fields["data"]),
                tuple((begin, end) for begin, end in fields.get("hits_ns", ())),
                None if ninth is None else bytes(bit == "1" for bit in ninth),
                tuple(str(fault) for fault in fields.get("faults", ())),
                None if sent is None else bytes.fromhex(sent),
            )
        case "report":
            return Report(
                round(fields["time_us"] * US),
                fields["node"],
                ReportKind(fields["what"]),
                fields["text"],
                fields["line"],
                fields["column"],
            )
        case "time":
            return Reached(fields["time_ns"], fields["clock_ns"])
        case "missed":
            return Missed(fields["lines"])
        case "stopped":
            return Stopped()
        case "hello":
            if fields["format"] != FORMAT:
                raise ValueError(
                    f"a feed of format {fields['format']}, this version reads {FORMAT}"
                )
            return Hello(
                fields["version"],
                fields["bus"],
                fields["protocol"],
                fields["baud"],
                fields["bits"],
                fields["lanes"],
                fields["speed"],
                tuple((one["node"], one["kind"]) for one in fields["nodes"]),
                tuple(Way(one["kind"], one["where"], one["device"]) for one in fields["links"]),
                fields["time_ns"],
                fields["clock_ns"],
            )
        case _:
            return None
