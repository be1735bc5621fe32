"""``sacbus queue put``: a queue file goes into a node, or through it.

Owns the reading of the file (whole, before anything is sent), what is shown meanwhile, and what is
said in the end.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from sacbus.cli.drive import drive_options, tuned_drive, tuning_options
from sacbus.cli.mothers_line import mothers_line
from sacbus.cli.options import WholeNumber, WrongInput, baud, verbose
from sacbus.cli.outcomes import failures, told
from sacbus.cli.rows import Rows, opened_rows, positions, shown_progress

if TYPE_CHECKING:
    from sacbus.language import Defaults
    from sacbus.motion import Drive

__all__ = ["put_command"]


@click.command("put")
@click.argument("link")
@click.argument("node", type=WholeNumber(4, 255))
@click.argument("file", metavar="FILE.csv")
@click.option("--save", is_flag=True, help="Have the node save its queue to EEPROM.")
@click.option("--stream", is_flag=True, help="Run the rows as they are sent, few as they are.")
@drive_options
@tuning_options
@click.option(
    "--dir",
    "direction",
    type=click.Choice(["CW", "CCW"], case_sensitive=False),
    default="CW",
    show_default=True,
    help="The node's default direction.",
)
@click.option(
    "--gap/--no-gap",
    default=True,
    show_default=True,
    help="Whether the node loses a kept velocity when the next command comes too late.",
)
@click.option(
    "--drift",
    type=WholeNumber(0, 100_000),
    default=500,
    show_default=True,
    metavar="PPM",
    help="By how much its oscillator may be off.",
)
@baud
@click.option("--json", "as_json", is_flag=True, help="Report as JSON.")
@verbose
def put_command(link: str, node: int, file: str, **given: Any) -> int:  # noqa: ANN401 (options)
    """Write a queue file into the queue of NODE; a FILE of - is standard input.

    A file of up to 30 rows is written, each into its position, and nothing runs. One of more is
    streamed: the node runs its rows in their order while they are sent, from where it stands, and
    what its queue held is lost. Its pace is planned from --ustep, --sprf, --slow, --ihd and --xclk,
    which must be as in the node. Ctrl-C stops the node and says in which row. Status: 3 when the
    node says NAK, 4 when it does not answer, 130 after Ctrl-C.

    \b
    Example: sacbus queue put /tmp/sacbus 10 queue.csv --save
             sacbus queue put /tmp/sacbus 10 long.csv --ustep 3
    """
    from sacbus.language import QUEUE_LENGTH, Defaults
    from sacbus.mother import RowRefused

    drive = tuned_drive(given)
    defaults = Defaults(sprf=drive.steps_per_rev, cw=given["direction"].upper() == "CW")
    with opened_rows(file, defaults) as rows:
        wanted = _Wanted(link, node, given["baud"], rows, drive, defaults)
        try:
            if rows.count > QUEUE_LENGTH or given["stream"]:
                if given["save"]:
                    raise click.UsageError("--save is for files that are not streamed")
                report = _stream(wanted, gap=given["gap"], drift_ppm=given["drift"])
            else:
                report = _put(wanted, save=given["save"])
        except failures() as failure:
            return told(failure)
        except RowRefused as fault:
            raise WrongInput(f"{fault.what}, {rows.where(fault.row)}, {fault.remedy}") from fault
    if pauses := report.get("pauses"):
        how_often = "once" if pauses == 1 else f"{pauses} times"
        click.echo(
            f"warning: node {node} paused {how_often}, since rows came too late; longer rows, or a "
            "quicker line, run without a stop",
            err=True,
        )
    if given["as_json"]:
        click.echo(json.dumps({"link": link, "node": node, "file": file} | report))
    else:
        click.echo(_words(node, report))
    return 0


@dataclass(frozen=True)
class _Wanted:
    """What goes where, and the node's settings."""

    link: str
    node: int
    baud: int
    rows: Rows
    drive: Drive
    defaults: Defaults


def _put(wanted: _Wanted, *, save: bool) -> dict[str, object]:
    from sacbus.mother import put_queue

    rows = list(wanted.rows)

    async def put(progress: Callable[[int], object]) -> None:
        async with mothers_line(wanted.link, wanted.baud) as mother:
            await put_queue(
                mother, wanted.node, rows, defaults=wanted.defaults, save=save, progress=progress
            )

    with shown_progress("writing", len(rows)) as progress:
        asyncio.run(put(progress))
    return {"rows": len(rows), "streamed": False, "saved": save}


def _stream(wanted: _Wanted, *, gap: bool, drift_ppm: int) -> dict[str, object]:
    from sacbus.kernel import SECOND
    from sacbus.mother import MotherError, QueueStream

    at, stopped = 0, False

    async def stream(progress: Callable[[int], object]) -> dict[str, object]:
        nonlocal at, stopped
        async with mothers_line(wanted.link, wanted.baud) as mother:
            stream = QueueStream(
                mother,
                wanted.node,
                drive=wanted.drive,
                defaults=wanted.defaults,
                gap=gap,
                drift_ppm=drift_ppm,
            )
            count, duration = stream.survey(motions())
            try:
                await stream.run(motions(), progress=progress)
            finally:
                at, stopped = stream.row, stream.stopped
            return {
                "rows": count,
                "streamed": True,
                "seconds": duration / SECOND,
                "pauses": stream.pauses,
            }

    def motions() -> Iterator[Any]:
        return (row.motion for row in wanted.rows)

    try:
        with shown_progress("running", wanted.rows.count) as progress:
            return asyncio.run(stream(progress))
    except KeyboardInterrupt:
        silent = "has not acknowledged S, so it may go on; it was, as far as is known, at"
        _tell_where(wanted, at, "was stopped with S at" if stopped else silent)
        raise
    except MotherError:
        _tell_where(wanted, at, "was, as far as is known, at")
        raise


def _tell_where(wanted: _Wanted, row: int, how: str) -> None:
    """In which row the node was when it ended early; nothing if it had not begun."""
    if row:
        where = f"{wanted.rows.where(row)}, row {row} of {wanted.rows.count}"
        click.echo(f"node {wanted.node} {how} {where}", err=True)


def _words(node: int, report: dict[str, object]) -> str:
    rows = report["rows"]
    assert isinstance(rows, int), "a count"
    if not report["streamed"]:
        saved = ", and saved to its EEPROM" if report["saved"] else ""
        return f"{positions(rows)} written to node {node}{saved}"
    what = "row" if rows == 1 else "rows"
    return f"node {node} has run {rows} {what}, {report['seconds']:.3f} s"
