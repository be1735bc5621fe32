"""``sacbus serve`` at run time: one bus, its signals, and what the terminal shows of it.

Owns the life of the serving process from the first line printed to the exit status, and the output
in its three forms: live table, plain lines, JSON lines. A leaf beside the command line.
"""

from __future__ import annotations

import asyncio
import json
import shutil
import signal
from typing import Final

import click

from sacbus import __version__
from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.kernel import MS, SECOND
from sacbus.live import Screen, table
from sacbus.node import Report

__all__ = ["serve"]

#: Status after Ctrl-C, as a shell expects it (128 + SIGINT).
INTERRUPTED: Final = 130

#: The table is drawn this often; faster than this the eye does not read numbers.
REFRESH: Final = 0.2

#: Reports that stand above the table each second at most; the rest are counted.
REPORTS_A_REFRESH: Final = 5


async def serve(configuration: Configuration, *, as_json: bool, show_table: bool) -> int:
    """Host a bus until SIGINT (status 130) or SIGTERM (status 0)."""
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[int] = loop.create_future()

    def end(status: int) -> None:
        if not ended.done():
            ended.set_result(status)

    # Before anything is opened: a signal at any instant ends in an orderly close.
    loop.add_signal_handler(signal.SIGINT, end, INTERRUPTED)
    loop.add_signal_handler(signal.SIGTERM, end, 0)
    async with open_bus(configuration) as bus:
        output = _output(bus, as_json=as_json, show_table=show_table)
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
    return status


class _Lines:
    """Plain lines, for a pipe, a log, or who does not want the table."""

    interval: float | None = None

    def __init__(self, bus: HostedBus) -> None:
        self._bus = bus

    def ready(self) -> None:
        configuration = self._bus.configuration
        count = len(configuration.nodes)
        click.echo(
            f"sacbus {__version__}: {count} {configuration.kind} "
            f"node{'s' if count != 1 else ''} ({_ranges(configuration.nodes)}) "
            f"at {configuration.baud} baud"
        )
        for link in self._bus.links:
            click.echo(f"connect to {link.where}")
        click.echo("Ctrl-C ends it")
        click.get_text_stream("stdout").flush()

    def report(self, report: Report) -> None:
        click.echo(f"{report.when / SECOND:.6f} {report}")

    def refresh(self) -> None:
        """Nothing to draw."""

    def stopped(self) -> None:
        click.echo("stopped; port closed")


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
            }
        )

    @staticmethod
    def _write(what: dict[str, object]) -> None:
        click.echo(json.dumps(what))
        click.get_text_stream("stdout").flush()


class _Table(_Lines):
    """The live table, with reports above it."""

    interval: float | None = REFRESH

    def __init__(self, bus: HostedBus) -> None:
        super().__init__(bus)
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
            click.echo(self._screen.above(str(report)), nl=False)

    def refresh(self) -> None:
        self._reports = 0
        if self._unseen:
            click.echo(self._screen.above(f"… and {self._unseen} more reports"), nl=False)
            self._unseen = 0
        size = shutil.get_terminal_size()
        lines = table(
            self._bus.snapshots(), size.columns - 1, max(size.lines - 6, 3), colour=True
        )
        lines.append(self._line()[: size.columns - 1])
        click.echo(self._screen.draw(lines), nl=False)

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


def _output(bus: HostedBus, *, as_json: bool, show_table: bool) -> _Lines:
    if as_json:
        return _Json(bus)
    if show_table and click.get_text_stream("stdout").isatty():
        return _Table(bus)
    return _Lines(bus)


def _ranges(addresses: tuple[int, ...]) -> str:
    """``10-12, 85`` for (10, 11, 12, 85)."""
    runs: list[list[int]] = []
    for address in addresses:
        if runs and runs[-1][1] == address - 1:
            runs[-1][1] = address
        else:
            runs.append([address, address])
    return ", ".join(str(low) if low == high else f"{low}-{high}" for low, high in runs)
