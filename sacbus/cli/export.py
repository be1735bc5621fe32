"""``sacbus export``: a recording in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TextIO

import click

from sacbus.cli.options import verbose
from sacbus.cli.recordings import opened, span

__all__ = ["export_command"]


@click.command("export")
@click.argument("recording", metavar="RECORDING")
@click.option(
    "--vcd",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Every node's pins against time, for GTKWave and its like.",
)
@click.option(
    "--csv",
    "events",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="What happened, a row an event.",
)
@click.option(
    "--positions",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Where the nodes were, as CSV, a row a node every so often.",
)
@click.option(
    "--every",
    callback=span,
    default="10ms",
    show_default=True,
    metavar="TIME",
    help="How often, for --positions: 10ms, 250us, 1s.",
)
@verbose
def export_command(
    recording: str, vcd: Path | None, events: Path | None, positions: Path | None, every: int
) -> int:
    """Write a recording in other formats; several at once if wanted.

    \b
    Example: sacbus export run.jsonl --vcd run.vcd --csv run.csv
    """
    from sacbus.trace.tables import write_events, write_positions
    from sacbus.trace.vcd import write_vcd

    if vcd is None and events is None and positions is None:
        raise click.UsageError("nothing to write: give --vcd, --csv or --positions a file")
    if every == 0:
        raise click.BadParameter("expected a time above 0, got '0'", param_hint="--every")
    read = opened(recording)
    jobs: list[tuple[Path | None, str, Callable[[TextIO], int]]] = [
        (vcd, "changes of level", lambda out: write_vcd(read, out)),
        (events, "events", lambda out: write_events(read, out)),
        (positions, "positions", lambda out: write_positions(read, out, every)),
    ]
    for path, what, write in jobs:
        if path is not None:
            with path.open("w", encoding="utf-8", newline="") as out:
                written = write(out)
            click.echo(f"{path}: {written} {what}")
    if not read.whole:
        click.echo(
            f"note: {recording} was cut off at {read.end / 1e9:.6f} s: it was not closed", err=True
        )
    return 0
