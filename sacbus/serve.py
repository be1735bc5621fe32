"""``sacbus serve`` at run time: one bus, its signals, and what the terminal shows of it.

Owns the life of the serving process from the first line printed to the exit status, and the output
in its three forms: live table, plain lines, JSON lines. A leaf beside the command line.
"""

from __future__ import annotations

import asyncio
import json
import shutil
import signal
import sys
from collections.abc import Callable
from typing import Final

from sacbus import __version__
from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.kernel import MS, SECOND
from sacbus.live import Screen, table
from sacbus.node import Report
from sacbus.writer import Writer

__all__ = ["serve"]

#: Status after Ctrl-C, as a shell expects it (128 + SIGINT).
INTERRUPTED: Final = 130

#: Status after the terminal was closed (128 + SIGHUP).
HUNG_UP: Final = 129

#: The table is drawn this often; faster than this the eye does not read numbers.
REFRESH: Final = 0.2

#: Reports that are put above the table between two drawings at most; the rest are counted.
REPORTS_A_REFRESH: Final = 5


async def serve(configuration: Configuration, *, as_json: bool, show_table: bool) -> int:
    """Host a bus until SIGINT (status 130), SIGTERM (0) or a closed terminal (129).

    Raises what :func:`~sacbus.daemon.open_bus` does, and OSError when standard output cannot be
    written any more (BrokenPipeError: its reader has left); the bus is closed in order then too.
    """
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[int] = loop.create_future()

    def end(status: int) -> None:
        if not ended.done():
            ended.set_result(status)

    # Before anything is opened: a signal at any instant ends in an orderly close.
    loop.add_signal_handler(signal.SIGINT, end, INTERRUPTED)
    loop.add_signal_handler(signal.SIGTERM, end, 0)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as nohup leaves it
        loop.add_signal_handler(signal.SIGHUP, end, HUNG_UP)
    async with open_bus(configuration) as bus:

        def lost(fault: OSError) -> None:
            if not ended.done():
                ended.set_exception(fault)

        output = _output(bus, lost, as_json=as_json, show_table=show_table)
        output.ready()
        for report in bus.bus.reports:
            output.report(report)
        bus.bus.report_watchers.append(output.report)
        while not ended.done():
            output.refresh()
            await asyncio.wait([ended], timeout=output.interval)
        output.refresh()
        status = ended.result()
    output.stopped()
    output.close()
    return status


class _Lines:
    """Plain lines, for a pipe, a log, or who does not want the table."""

    interval: float | None = None

    def __init__(self, bus: HostedBus, lost: Callable[[OSError], None]) -> None:
        """``lost`` is told once when nothing can be written any more."""
        self._bus = bus
        self._writer = Writer(lost, self.missed)
        self.say = self._writer.say

    def missed(self, count: int) -> str:
        """What stands where ``count`` texts were not read in time."""
        return f"… {count} lines were not read in time and are missing here\n"

    def close(self) -> None:
        """Nothing more comes."""
        self._writer.close()

    def ready(self) -> None:
        configuration = self._bus.configuration
        count = len(configuration.nodes)
        self.say(
            f"sacbus {__version__}: {count} {configuration.kind} "
            f"node{'s' if count != 1 else ''} ({_ranges(configuration.nodes)}) "
            f"at {configuration.baud} baud\n"
        )
        for link in self._bus.links:
            self.say(f"connect to {link.where}\n")
        self.say("Ctrl-C ends it\n")

    def report(self, report: Report) -> None:
        self.say(f"{report.when / SECOND:.6f} {_printable(str(report))}\n")

    def refresh(self) -> None:
        """Nothing to draw."""

    def stopped(self) -> None:
        counters = self._bus.bus.medium.counters()
        self.say(
            f"stopped; port closed; {counters.transmissions} transmissions, "
            f"{counters.bytes} bytes, {counters.collided} collided\n"
        )


class _Json(_Lines):
    """One JSON object a line."""

    def ready(self) -> None:
        configuration = self._bus.configuration
        self._write(
            {
                "event": "ready",
                "version": __version__,
                "kind": configuration.kind,
                "nodes": list(configuration.nodes),
                "baud": configuration.baud,
                "links": [{"kind": link.kind, "path": link.where} for link in self._bus.links],
                "terminals": {},
            }
        )

    def report(self, report: Report) -> None:
        self._write(
            {
                "event": "report",
                "time_us": report.when / 1_000,
                "node": report.address,
                "what": report.kind.value,
                "line": report.line,
                "column": report.column,
                "text": report.text,
            }
        )

    def stopped(self) -> None:
        counters = self._bus.bus.medium.counters()
        self._write(
            {
                "event": "stopped",
                "transmissions": counters.transmissions,
                "bytes": counters.bytes,
                "collided": counters.collided,
                "reports": dict(self._bus.bus.report_counts),
                "nodes": [
                    {
                        "node": one.address,
                        "state": one.state,
                        "position_steps": one.position_steps,
                        "position_pulses": one.position_pulses,
                        **one.counters,
                    }
                    for one in self._bus.snapshots()
                ],
            }
        )

    def missed(self, count: int) -> str:
        """As its own event."""
        return json.dumps({"event": "missed", "lines": count}) + "\n"

    def _write(self, what: dict[str, object]) -> None:
        self.say(json.dumps(what) + "\n")


class _Table(_Lines):
    """The live table, with reports above it."""

    interval: float | None = REFRESH

    def __init__(self, bus: HostedBus, lost: Callable[[OSError], None]) -> None:
        super().__init__(bus, lost)
        self._screen = Screen()
        self._reports = 0
        self._unseen = 0
        self._busy = 0
        self._when = 0
        self._load = 0.0

    def report(self, report: Report) -> None:
        self._reports += 1
        if self._reports > REPORTS_A_REFRESH:
            self._unseen += 1
        else:
            text = _printable(f"{report.when / SECOND:.6f} {report}")
            self.say(self._screen.above(text))

    def refresh(self) -> None:
        self._reports = 0
        if self._unseen:
            self.say(self._screen.above(f"… and {self._unseen} more reports"))
            self._unseen = 0
        size = shutil.get_terminal_size()
        lines = table(self._bus.snapshots(), size.columns - 1, max(size.lines - 6, 3), colour=True)
        lines.append(self._line()[: size.columns - 1])
        self.say(self._screen.draw(lines))

    def _line(self) -> str:
        """The line's load since the last look, and its counts."""
        counters = self._bus.bus.medium.counters()
        now = self._bus.bus.kernel.now
        # Short looks would jump between 0 and 100 %: average over a fifth of a second or more.
        if now - self._when >= 150 * MS:
            self._load = min((counters.busy - self._busy) / (now - self._when), 1)
            self._busy, self._when = counters.busy, now
        return (
            f"line {self._load:.0%} busy, {counters.transmissions} transmissions, "
            f"{counters.bytes} bytes, {counters.collided} collided"
        )


def _output(
    bus: HostedBus, lost: Callable[[OSError], None], *, as_json: bool, show_table: bool
) -> _Lines:
    if as_json:
        return _Json(bus, lost)
    if show_table and sys.stdout.isatty():
        return _Table(bus, lost)
    return _Lines(bus, lost)


def _printable(text: str) -> str:
    """``text`` without control characters: what nodes are sent may be anything, escapes too."""
    return "".join(one if one.isprintable() else f"\\x{ord(one):02x}" for one in text)


def _ranges(addresses: tuple[int, ...]) -> str:
    """``10-12, 85`` for (10, 11, 12, 85)."""
    runs: list[list[int]] = []
    for address in addresses:
        if runs and runs[-1][1] == address - 1:
            runs[-1][1] = address
        else:
            runs.append([address, address])
    return ", ".join(str(low) if low == high else f"{low}-{high}" for low, high in runs)
