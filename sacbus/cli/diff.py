"""``sacbus diff``: whether two recordings tell the same."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from sacbus.cli.options import WholeNumber, verbose
from sacbus.cli.recordings import note_cut_off, opened, span

__all__ = ["diff_command"]

#: Status when they differ.
DIFFERENT = 1


@click.command("diff")
@click.argument("expected", metavar="EXPECTED")
@click.argument("got", metavar="GOT")
@click.option(
    "--time",
    "within",
    callback=span,
    default="0",
    show_default=True,
    metavar="TIME",
    help="By how much an instant may differ: 1us, 10ms.",
)
@click.option(
    "--steps",
    type=click.FloatRange(0),
    default=0.0,
    show_default=True,
    help="By how many full steps a position may differ.",
)
@click.option(
    "--most",
    type=WholeNumber(1),
    default=20,
    show_default=True,
    help="How many differences to print.",
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line instead of text.")
@verbose
def diff_command(
    expected: str, got: str, within: int, steps: float, most: int, as_json: bool
) -> int:
    """Compare two recordings: packets, states, positions. Status 1 when they differ.

    \b
    Example: sacbus diff golden.jsonl run.jsonl --time 1us --steps 1
    """
    from sacbus.trace.difference import differences

    both = [opened(expected), opened(got)]
    found = differences(*both, within=within, steps=steps)
    for recording in both:
        if not recording.end:  # of other buses, say: whether it was cut off is not known yet
            for _ in recording:
                pass
    for one in found[:most]:
        click.echo(json.dumps(asdict(one)) if as_json else str(one))
    if len(found) > most and not as_json:
        click.echo(f"and {len(found) - most} more")
    for recording in both:
        note_cut_off(recording)
    return DIFFERENT if found else 0
