"""``sacbus export``: a recording in the formats of other programs."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click
from click.core import ParameterSource

from sacbus.cli.options import STANDARD, WrongInput, read_addresses, verbose
from sacbus.cli.recordings import (
    fresh_or_standard,
    fresh_text,
    note_cut_off,
    opened,
    picture_form,
    refuse_shared_files,
    span,
)
from sacbus.fresh import fresh_file

if TYPE_CHECKING:
    from sacbus.trace import Recording

__all__ = ["export_command"]


def _pair(
    _ctx: click.Context, _param: click.Parameter, given: str | None
) -> tuple[int, int] | None:
    """Two addresses: ``10,11``."""
    if given is None:
        return None
    found = re.fullmatch(r"\s*(\d{1,9})\s*,\s*(\d{1,9})\s*", given)
    if found is None or found[1] == found[2]:
        raise click.BadParameter(f"expected two nodes such as 10,11, got {given!r}")
    return int(found[1]), int(found[2])


def _several(ctx: click.Context, param: click.Parameter, given: str | None) -> tuple[int, ...]:
    """Addresses; none where none are given."""
    return () if given is None else read_addresses(ctx, param, given)


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
    "--pcap",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="What was said, as a capture for Wireshark (pcapng).",
)
@click.option(
    "--plot",
    "picture",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Velocity and position against time, and who talked when: .png or .svg.",
)
@click.option(
    "--nodes",
    callback=_several,
    metavar="LIST",
    help="With --plot: only these, 10-12,85. [default: the first 12 that moved]",
)
@click.option(
    "--xy",
    callback=_pair,
    metavar="X,Y",
    help="With --plot: the path of two nodes, and how straight it was.",
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
    recording: str,
    vcd: Path | None,
    events: Path | None,
    positions: Path | None,
    pcap: Path | None,
    picture: Path | None,
    nodes: tuple[int, ...],
    xy: tuple[int, int] | None,
    every: int,
) -> int:
    """Write a recording in other formats; several at once if wanted.

    A FILE of - is standard output, for one of them; pictures take a file.

    \b
    Example: sacbus export run.jsonl --vcd run.vcd --csv run.csv
             sacbus export run.jsonl --pcap - | wireshark -k -i -
    """
    from sacbus.trace import write_pcapng
    from sacbus.trace.tables import write_events, write_positions
    from sacbus.trace.vcd import write_vcd

    outputs = {
        "--vcd": vcd,
        "--csv": events,
        "--positions": positions,
        "--pcap": pcap,
        "--plot": picture,
    }
    if picture is None and (xy is not None or nodes):
        raise click.UsageError(f"{'--nodes' if nodes else '--xy'}: expected only with --plot")
    if every == 0:
        raise click.BadParameter("expected a time above 0, got '0'", param_hint="--every")
    given = click.get_current_context().get_parameter_source("every")
    if positions is None and given is not ParameterSource.DEFAULT:
        raise click.UsageError("--every: expected only with --positions")
    if all(path is None for path in outputs.values()):
        raise click.UsageError(
            "nothing to write: give --vcd, --csv, --positions, --pcap or --plot a file"
        )
    standard = [option for option, path in outputs.items() if _is_standard(path)]
    if len(standard) > 1:
        raise click.UsageError(
            f"expected one on standard output, got {' and '.join(standard)}, give others a file"
        )
    if standard == ["--pcap"] and sys.stdout.isatty():
        raise click.UsageError(
            "--pcap - writes bytes that are not for a terminal, "
            "pipe them to a program (| wireshark -k -i -) or give --pcap a file"
        )
    if xy is not None and nodes:
        raise click.UsageError("expected --nodes or --xy, got both")
    refuse_shared_files(
        {option: path for option, path in outputs.items() if option not in standard}, [recording]
    )
    form = None if picture is None else picture_form(picture)
    read = opened(recording)

    def tell(path: Path, what: str) -> None:
        if not _is_standard(path):
            click.echo(f"{path}: {what}", err=bool(standard))

    jobs: list[tuple[Path | None, str, Callable[[TextIO], int]]] = [
        (vcd, "changes of level", lambda out: write_vcd(read, out)),
        (events, "events", lambda out: write_events(read, out)),
        (positions, "positions", lambda out: write_positions(read, out, every)),
    ]
    for path, what, write in jobs:
        if path is not None:
            with fresh_text(path) as out:
                written = write(out)
            tell(path, f"{written} {what}")
    if pcap is not None:
        with fresh_or_standard(pcap) as file:
            written = write_pcapng(read, file)
        tell(pcap, f"{written} packets")
    if picture is not None and form is not None:
        _draw(read, picture, form, nodes, xy)
        tell(picture, "drawn")
    note_cut_off(read)
    return 0


def _is_standard(path: Path | None) -> bool:
    return path is not None and str(path) == STANDARD


def _draw(
    recording: Recording,
    picture: Path,
    form: str,
    nodes: tuple[int, ...],
    xy: tuple[int, int] | None,
) -> None:
    from sacbus.picture_format import PictureError
    from sacbus.trace.plots import draw_axes, draw_path

    try:
        with fresh_file(picture) as file:
            if xy is None:
                draw_axes(recording, file, form, nodes=nodes)
            else:
                draw_path(recording, file, form, xy)
    except PictureError as fault:
        raise WrongInput(str(fault)) from fault
