"""``sacbus calibrate``: what a node's time is worth, and what would set it right."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import click

from sacbus.cli.drive import drive_options, tuned_drive, tuning_options
from sacbus.cli.mothers_line import mothers_line
from sacbus.cli.options import WholeNumber, baud, verbose
from sacbus.cli.outcomes import failures, told

if TYPE_CHECKING:
    from sacbus.mother import Calibration
    from sacbus.motion import Drive

__all__ = ["calibrate_command", "result_lines"]

#: Parts of the bar.
_PARTS: Final = 1_000


@click.command("calibrate")
@click.argument("link")
@click.argument("node", type=WholeNumber(4, 255))
@click.option(
    "--rpm",
    type=WholeNumber(1, 10_000),
    default=60,
    show_default=True,
    help="At which velocity; the companion offers 5, 20, 60 and 160.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(0.1, 86_400),
    default=60.0,
    show_default=True,
    help="For how long, about.",
)
@drive_options
@tuning_options
@click.option("--soft-ops", is_flag=True, help="Leave soft ops on afterwards.")
@baud
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@verbose
def calibrate_command(
    link: str,
    node: int,
    rpm: int,
    seconds: float,
    soft_ops: bool,
    as_json: bool,
    **given: Any,  # noqa: ANN401 (options)
) -> int:
    """Time NODE for a minute between its soft ops, and propose ihd and xclk.

    The motor must be free to turn: 60 revolutions at 60 RPM. Nothing else should move on the line
    meanwhile. --ihd, --xclk, --ustep, --sprf and --slow must be as in the node now, or the proposal
    is for another one. It holds for the velocity that was timed: ihd and xclk add the same time to
    every pulse. Ctrl-C stops the node with S. Status: 3 when the node says NAK, 4 when it does not
    answer or tell of its motion, 130 after Ctrl-C.

    \b
    Example: sacbus calibrate /dev/ttyUSB0 10 --rpm 60
             sacbus calibrate /tmp/sacbus 10 --rpm 5 --ihd 11 --json
    """
    drive = tuned_drive(given)
    try:
        with _progress() as progress:
            found = asyncio.run(
                _calibrate(link, given["baud"], node, rpm, seconds, drive, soft_ops, progress)
            )
    except failures() as failure:
        return told(failure)
    if as_json:
        click.echo(json.dumps(_report(found)))
    else:
        click.echo("\n".join(result_lines(found, drive)))
    return 0


async def _calibrate(
    link: str,
    baud: int,
    node: int,
    rpm: int,
    seconds: float,
    drive: Drive,
    soft_ops: bool,
    progress: Callable[[float], object],
) -> Calibration:
    from sacbus.mother import calibrate

    async with mothers_line(link, baud) as mother:
        return await calibrate(
            mother,
            node,
            rpm=rpm,
            seconds=seconds,
            drive=drive,
            soft_ops_after=soft_ops,
            progress=progress,
        )


def _report(found: Calibration) -> dict[str, object]:
    return {
        "node": found.node,
        "rpm": found.rpm,
        "steps": found.steps,
        "nominal_us": found.nominal_ns / 1_000,
        "measured_us": found.measured_ns / 1_000,
        "factor": found.factor,
        "clock_ppm": found.clock_ppm,
        "ihd": found.ihd,
        "xclk": found.xclk,
        "left_ppm": found.left_ppm,
    }


def result_lines(found: Calibration, drive: Drive) -> list[str]:
    """What was found, for people, with what to send; ``drive`` has the settings as they are."""
    second = 1_000_000_000
    what = f"node {found.node}: {found.steps} steps at {found.rpm} RPM"
    lines = [
        f"{what} took {found.measured_ns / second:.6f} s of {found.nominal_ns / second:.6f} s",
        f"factor {found.factor:.6f}; its clock is off by {found.clock_ppm:+.0f} ppm",
    ]
    if found.ihd is None or found.xclk is None:
        lines.append(
            "beyond what ihd and xclk can make up for: see that the settings given are the node's, "
            "and adjust its clock at the source"
        )
    elif (found.ihd, found.xclk) == (drive.ihd, drive.xclk):
        lines.append(f"ihd {found.ihd} and xclk {found.xclk} are as good as can be")
    else:
        lines.append(
            f"proposed: ihd {found.ihd}, xclk {found.xclk}, which leaves {found.left_ppm:+.0f} "
            f"ppm at {found.rpm} RPM"
        )
        changes = [
            f"$C{letter}{new}"
            for letter, new, old in (
                ("H", found.ihd, drive.ihd),
                ("I", found.xclk, drive.xclk),
            )
            if new != old
        ]
        sent = ", ".join(f"{found.node}{one}" for one in [*changes, "$R"])
        lines.append(f"to set them: {sent}")
    return lines


@contextmanager
def _progress() -> Iterator[Callable[[float], object]]:
    """A bar on standard error if that is a terminal; it is told which part is done."""
    if not sys.stderr.isatty():
        yield lambda _part: None
        return
    with click.progressbar(length=_PARTS, label="timing", file=sys.stderr) as bar:
        yield lambda part: bar.update(int(part * _PARTS) - bar.pos)
