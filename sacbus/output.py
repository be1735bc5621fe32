"""What ``serve`` says while it runs, in three forms: live table, plain lines, JSON lines.

Owns the words and the fields. Who says it, and when, is ``serve.py``'s business; the look of the
table is ``live.py``'s. A leaf beside the command line.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

from sacbus import __version__
from sacbus.config.notation import ranges
from sacbus.daemon import HostedBus
from sacbus.feed.lines import report_fields
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.lateness import Lateness
from sacbus.links import Link
from sacbus.links.link import Server
from sacbus.links.places import terminal_path
from sacbus.live import Screen, table
from sacbus.node import Report
from sacbus.spare import Job
from sacbus.writer import Writer

__all__ = ["Json", "Lines", "Output", "Table", "output_for"]

#: The table is drawn this often; faster than this the eye does not read numbers.
REFRESH: Final = 0.2

#: Reports that are put above the table between two drawings at most; the rest are counted.
REPORTS_A_REFRESH: Final = 5


class Lines:
    """Plain lines, for a pipe, a log, or who does not want the table."""

    interval: float | None = None

    def __init__(self, buses: Sequence[HostedBus], lost: Callable[[OSError], None]) -> None:
        """``lost`` is told once when nothing can be written any more."""
        self._buses = buses
        self._writer = Writer(lost, self.missed)
        self.say = self._writer.say

    def missed(self, count: int) -> str:
        """What stands where ``count`` texts were not read in time."""
        return f"… {count} lines were not read in time and are missing here\n"

    def close(self) -> None:
        """Nothing more comes."""
        self._writer.close()

    def ready(self) -> None:
        """Everything is open: where to connect."""
        several = len(self._buses) > 1
        self.say(f"sacbus {__version__}" + (f": {len(self._buses)} buses\n" if several else ": "))
        for bus in self._buses:
            self.say((f"bus {bus.bus.name}: " if several else "") + f"{_population(bus)}\n")
            for link in bus.links:
                way = "on" if link.kind == "adapter" else "connect to"
                self.say(("  " if several else "") + f"{way} {link.where}\n")
            for line in _terminal_lines(bus):
                self.say(("  " if several else "") + f"{line}\n")
        self.say("Ctrl-C ends it\n")

    def report(self, bus: HostedBus, report: Report) -> None:
        """A report from a bus, as it is made."""
        self.say(f"{self._told(bus, report)}\n")

    def late(self, bus: HostedBus, late: Ns) -> None:
        """The machine cannot keep up: what was due on a bus ran so late, in wall time."""
        self.say(f"{self._told_late(bus, late)}\n")

    def drawing(self) -> Job[None]:
        """Nothing to draw."""
        yield from ()

    def stopped(self) -> None:
        """Everything is closed: what it has been."""
        several = len(self._buses) > 1
        for bus in self._buses:
            counters = bus.bus.medium.counters()
            name = f"bus {bus.bus.name}: " if several else ""
            if bus.host.lateness.count:
                self.say(f"{name}{_late(bus.host.lateness)}\n")
            self.say(
                f"{name}stopped; port closed; {counters.transmissions} transmissions, "
                f"{counters.bytes} bytes, {counters.collided} collided\n"
            )

    def _told(self, bus: HostedBus, report: Report) -> str:
        name = f"{bus.bus.name}: " if len(self._buses) > 1 else ""
        return f"{report.when / SECOND:.6f} {_printable(f'{name}{report}')}"

    def _told_late(self, bus: HostedBus, late: Ns) -> str:
        name = f"{bus.bus.name}: " if len(self._buses) > 1 else ""
        return (
            f"{bus.bus.kernel.now / SECOND:.6f} {name}this machine cannot keep up: the line ran "
            f"{late / MS:.1f} ms late; end other programs, or lower --speed"
        )


class Json(Lines):
    """One JSON object a line."""

    _ways: list[list[dict[str, object]]]

    def ready(self) -> None:
        """First of all, ``ready``; every link once for all buses, and again with its bus."""
        # Where a link was is not known any more once it is closed.
        self._ways = [_links(bus) for bus in self._buses]
        self._write(
            {
                "event": "ready",
                "version": __version__,
                "links": [way for ways in self._ways for way in ways],
                # Of two nodes with one address on two buses, the first one's; see the buses.
                "terminals": {
                    address: path
                    for bus in reversed(self._buses)
                    for address, path in _terminals(bus).items()
                },
                "buses": [
                    {
                        "name": bus.bus.name,
                        "protocol": bus.bus.protocol.name,
                        "baud": bus.bus.rate.baud,
                        "nodes": [
                            {"node": one.address, "kind": one.kind}
                            for one in bus.configuration.every_node
                        ],
                        "links": ways,
                        "terminals": _terminals(bus),
                    }
                    for bus, ways in zip(self._buses, self._ways, strict=True)
                ],
            }
        )

    def report(self, bus: HostedBus, report: Report) -> None:
        """Event ``report``, as in the feed."""
        self._write(report_fields(report, bus.bus.name))

    def late(self, bus: HostedBus, late: Ns) -> None:
        """Event ``late``."""
        now = bus.bus.kernel.now
        self._write(
            {
                "event": "late",
                "bus": bus.bus.name,
                "time_us": now / US,
                "late_us": late / US,
            }
        )

    def stopped(self) -> None:
        """Last of all, ``stopped``."""
        self._write(
            {
                "event": "stopped",
                "buses": [
                    _ended(bus, ways) for bus, ways in zip(self._buses, self._ways, strict=True)
                ],
            }
        )

    def missed(self, count: int) -> str:
        """As its own event."""
        return json.dumps({"event": "missed", "lines": count}) + "\n"

    def _write(self, what: dict[str, object]) -> None:
        self.say(json.dumps(what) + "\n")


class Table(Lines):
    """The live table, with reports above it."""

    interval: float | None = REFRESH

    def __init__(self, buses: Sequence[HostedBus], lost: Callable[[OSError], None]) -> None:
        super().__init__(buses, lost)
        self._screen = Screen()
        self._reports = 0
        self._unseen = 0
        self._loads = [_Load(bus) for bus in buses]

    def report(self, bus: HostedBus, report: Report) -> None:
        """Above the table, as many as can be read."""
        self._reports += 1
        if self._reports > REPORTS_A_REFRESH:
            self._unseen += 1
        else:
            self.say(self._screen.above(self._told(bus, report), _columns()))

    def late(self, bus: HostedBus, late: Ns) -> None:
        """Above the table too."""
        self.say(self._screen.above(self._told_late(bus, late), _columns()))

    def drawing(self) -> Job[None]:
        """Draw it again."""
        self._reports = 0
        if self._unseen:
            self.say(self._screen.above(f"… and {self._unseen} more reports", _columns()))
            self._unseen = 0
        size = shutil.get_terminal_size()
        columns = size.columns - 1
        rows = max((size.lines - 6) // len(self._buses), 3)
        lines: list[str] = []
        for bus, load in zip(self._buses, self._loads, strict=True):
            nodes = tuple(bus.bus.nodes)
            if nodes:
                lines += yield from table(nodes, bus.now, columns, rows, colour=True)
            yield
            name = f"{bus.bus.name}: " if len(self._buses) > 1 else ""
            lines.append(load.line(name, columns))
        yield
        self.say(self._screen.draw(lines, _columns()))


class _Load:
    """The line's load since the last look, and its counts."""

    def __init__(self, bus: HostedBus) -> None:
        self._bus = bus
        self._busy = 0
        self._when = 0
        self._load = 0.0

    def line(self, name: str, columns: int) -> str:
        """As one line of at most ``columns`` characters, with how late the bus's events run."""
        counters = self._bus.bus.medium.counters()
        now = self._bus.bus.kernel.now
        # Short looks would jump between 0 and 100 %: average over a fifth of a second or more.
        if now - self._when >= 150 * MS:
            self._load = min((counters.busy - self._busy) / (now - self._when), 1)
            self._busy, self._when = counters.busy, now
        lateness = self._bus.host.lateness
        parts = [
            f"{name}line {self._load:.0%} busy",
            f"{counters.transmissions} transmissions",
            f"{counters.bytes} bytes",
            f"{counters.collided} collided",
        ]
        if lateness.count:
            parts.append(f"late p50 {lateness.p50 // US} p99 {lateness.p99 // US} us")
        if len(", ".join(parts)) > columns:
            del parts[2]  # what is least missed
        return ", ".join(parts)[:columns]


def _columns() -> int:
    """How wide the terminal is, asked for each time: who looks at it may change that."""
    return shutil.get_terminal_size().columns


Output = Lines | Json | Table


def output_for(
    buses: Sequence[HostedBus], lost: Callable[[OSError], None], *, as_json: bool, show_table: bool
) -> Output:
    """The form that was asked for; a table only on a terminal."""
    if as_json:
        return Json(buses, lost)
    # A dumb terminal cannot move its cursor.
    if show_table and sys.stdout.isatty() and os.environ.get("TERM") != "dumb":
        return Table(buses, lost)
    return Lines(buses, lost)


def _population(bus: HostedBus) -> str:
    """``3 sac nodes (10-12) at 38400 baud``; kinds apart."""
    by_kind: dict[str, list[int]] = {}
    for node in bus.configuration.every_node:
        by_kind.setdefault(node.kind, []).append(node.address)
    kinds = [
        f"{len(nodes)} {kind} node{'s' if len(nodes) != 1 else ''} ({ranges(nodes)})"
        for kind, nodes in by_kind.items()
    ]
    return f"{', '.join(kinds) or 'no nodes'} at {bus.bus.rate.baud} baud"


def _terminals(bus: HostedBus) -> dict[str, str]:
    return {str(address): link.where for address, link in bus.terminals.items()}


def _terminal_lines(bus: HostedBus) -> Iterator[str]:
    """Where the nodes' terminals are; stable paths differ by the address alone."""
    if not bus.terminals:
        return
    if (pattern := terminal_path(bus.configuration.links, "ADDRESS")) is not None:
        yield f"terminals at {pattern} ({ranges(bus.terminals)})"
        return
    for address, link in bus.terminals.items():
        yield f"terminal of node {address} at {link.where}"


def _links(bus: HostedBus) -> list[dict[str, object]]:
    return [{**_link(link), "bus": bus.bus.name} for link in bus.links]


def _link(link: Link | Server) -> dict[str, object]:
    """What a program needs to connect: a path, or a URL with host and port."""
    scheme, separator, rest = link.where.partition("://")
    if not separator:
        return {"kind": link.kind, "path": link.where}
    host, _, port = rest.rpartition(":")
    return {
        "kind": link.kind,
        "url": f"{scheme}://{rest}",
        "host": host.strip("[]"),
        "port": int(port),
    }


def _ended(bus: HostedBus, ways: list[dict[str, object]]) -> dict[str, Any]:
    counters = bus.bus.medium.counters()
    lateness = bus.host.lateness
    return {
        "name": bus.bus.name,
        "transmissions": counters.transmissions,
        "bytes": counters.bytes,
        "collided": counters.collided,
        "reports": dict(bus.bus.report_counts),
        "lateness": {
            "count": lateness.count,
            "p50_us": lateness.p50 / US,
            "p99_us": lateness.p99 / US,
            "worst_us": lateness.worst / US,
        },
        "links": [
            {
                **way,
                **{name: getattr(link.counters, name) for name in link.counters.__slots__},
            }
            for link, way in zip(bus.links, ways, strict=True)
        ],
        "nodes": [
            {
                "node": one.address,
                "state": one.state,
                "position_steps": one.position_steps,
                "position_pulses": one.position_pulses,
                **one.counters,
            }
            for one in bus.snapshots()
        ],
    }


def _late(lateness: Lateness) -> str:
    p50, p99, worst = (late // US for late in (lateness.p50, lateness.p99, lateness.worst))
    return f"the line ran late by {p50} us (p50), {p99} us (p99), {worst} us at worst"


def _printable(text: str) -> str:
    """``text`` without control characters: what nodes are sent may be anything, escapes too."""
    return "".join(one if one.isprintable() else f"\\x{ord(one):02x}" for one in text)
