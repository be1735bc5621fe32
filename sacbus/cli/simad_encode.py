"""``sacbus simad encode``: the steps of axes on one DIR line and a step line each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from sacbus.cli.axes import AxisName, Source, read_axes, source_of
from sacbus.cli.options import WrongInput, read_parameters, verbose
from sacbus.cli.recordings import (
    fresh_text,
    note_cut_off,
    picture_form,
    refuse_missing_directories,
    refuse_shared_files,
    span,
)
from sacbus.fresh import fresh_file

if TYPE_CHECKING:
    from sacbus.simad import Edges, Encoded, Encoder, Report, Steps

__all__ = ["RULES", "encode_command"]

#: The defaults of these options, for their help; a test holds them to those of the room.
RULES: Final = (
    ("low", "500ns", "How long a step line is low for a step."),
    ("high", "4us", "How long it is high before the next step, at least."),
    ("setup", "4us", "How long DIR is set before a step, at least."),
    ("hold", "500ns", "How long DIR stays after a step's fall, at least."),
)


class Infeasible(click.ClickException):
    """Steps that come too fast for the lines."""

    exit_code = 1


def _rules(command: Any) -> Any:  # noqa: ANN401 (click's decorators)
    for name, default, told in reversed(RULES):
        command = click.option(
            f"--{name}",
            callback=span,
            default=default,
            show_default=True,
            metavar="TIME",
            help=told,
        )(command)
    return command


@click.command("encode")
@click.argument("place", metavar="SCENARIO.toml|RECORDING|STEPS.csv|STEPS.npy")
@click.option(
    "--axes",
    callback=read_axes,
    metavar="LIST",
    help="Which nodes, 10-12, of several buses BUS:10; of a file of steps all unless given.",
)
@click.option(
    "--vcd",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write the lines, for GTKWave and PulseView.",
)
@click.option("--pins", is_flag=True, help="With --vcd: all nodes' own pins too, on one clock.")
@click.option(
    "--plot",
    "picture",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Draw a few steps on the lines: .png or .svg.",
)
@click.option(
    "--at",
    callback=lambda ctx, param, given: None if given is None else span(ctx, param, given),
    metavar="TIME",
    help="With --plot: draw the first ones from then on. [default: the first that had to move]",
)
@click.option(
    "--max-delay",
    callback=span,
    default="1ms",
    show_default=True,
    metavar="TIME",
    help="How late a step may fall.",
)
@_rules
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    callback=read_parameters,
    help="A parameter's value, of a scenario. Repeats.",
)
@click.option("--seed", type=int, help="In place of the scenario's own seeds.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
@verbose
def encode_command(
    place: str,
    axes: tuple[AxisName, ...],
    vcd: Path | None,
    pins: bool,
    picture: Path | None,
    at: int | None,
    max_delay: int,
    low: int,
    high: int,
    setup: int,
    hold: int,
    parameters: dict[str, object],
    seed: int | None,
    as_json: bool,
) -> int:
    """Put the steps of axes on one DIR line and a step line each, and tell what that cost.

    A scenario is played in virtual time. A file of steps has time_ns,axis,direction a line, or is
    an array of numpy's with these fields. Status 1 when a step would be too late, or when a
    scenario's expectations are not met.

    \b
    Example: sacbus simad encode two-axes.toml --set speed=60 --axes 10,11 --vcd lines.vcd
             sacbus simad encode run.jsonl --axes 10-12 --plot steps.svg
             sacbus simad encode steps.csv --max-delay 50us --json
    """
    from sacbus.simad import DelayTooLong, Encoder, SimadError, Timing

    if pins and vcd is None:
        raise click.UsageError("--pins: expected only with --vcd")
    if at is not None and picture is None:
        raise click.UsageError("--at: expected only with --plot")
    outputs = {"--vcd": vcd, "--plot": picture}
    refuse_shared_files(outputs, [place])
    refuse_missing_directories(outputs)
    form = None if picture is None else picture_form(picture)
    try:
        timing = Timing(low, high, setup, hold)
        with source_of(place, axes, parameters, seed) as source:
            if pins and source.recording is None:
                raise click.UsageError("--pins: expected a scenario or a recording, got steps")
            encoder = Encoder(len(source.names), timing, max_delay, source.names)
            lines = _Lines(source, encoder, keep=pins or picture is not None)
            if vcd is not None and pins:
                lines.run()
                _write_with_pins(source, lines.edges(), vcd)
            elif vcd is not None:
                _write(lines, source, vcd)
            else:
                lines.run()
            if picture is not None and form is not None:
                _draw(lines, source.names, picture, form, at)
            _tell(encoder.report, lines.positions, source.positions(), as_json)
            return _verdict(source, lines.positions)
    except DelayTooLong as fault:
        raise Infeasible(str(fault)) from fault
    except SimadError as fault:
        raise WrongInput(str(fault)) from fault


class _Lines:
    """The lines of a source while they are encoded, and what drivers at their ends come to.

    ``keep``: whether steps and edges are kept, for who looks at them afterwards.
    """

    def __init__(self, source: Source, encoder: Encoder, *, keep: bool) -> None:
        from sacbus.simad import Decoder

        self._source = source
        self._encoder = encoder
        self._decoder: Decoder | None = None
        self._kept: tuple[list[Steps], list[Encoded]] | None = ([], []) if keep else None
        #: Where the drivers are, by axis.
        self.positions = [0] * encoder.axes

    def parts(self) -> Iterator[Edges]:
        """The edges as they come."""
        yield from map(self._driven, self._encoder.all_of(self._given()))

    def run(self) -> None:
        """All of it, for whom the edges themselves are of no use, or are kept."""
        for _ in self.parts():
            pass

    def edges(self) -> Edges:
        """Those that were kept."""
        from sacbus.simad.edges import joined_edges

        assert self._kept is not None
        return joined_edges([part.edges for part in self._kept[1]])

    def steps(self) -> tuple[Steps, Any]:
        """Those that were kept, and when each falls. ``Any``: an array, of a room loaded late."""
        import numpy as np

        from sacbus.simad.steps import joined

        assert self._kept is not None
        return joined(self._kept[0]), np.concatenate([part.falls for part in self._kept[1]])

    def _given(self) -> Iterator[Steps]:
        for steps in self._source.parts:
            if self._kept is not None:
                self._kept[0].append(steps)
            yield steps

    def _driven(self, part: Encoded) -> Edges:
        from sacbus.simad import Decoder

        if self._kept is not None:
            self._kept[1].append(part)
        edges = part.edges
        if edges.count:
            if self._decoder is None:
                self._decoder = Decoder(edges.direction)
            _advance(self.positions, self._decoder.take(edges))
        return edges


def _advance(positions: list[int], steps: Steps) -> None:
    """Add steps to where drivers are."""
    for axis in range(len(positions)):
        positions[axis] += int(steps.of_axis(axis)[1].sum())


def _write(lines: _Lines, source: Source, vcd: Path) -> None:
    from sacbus.simad.dump import write_dump

    end = 0 if source.recording is None else source.recording.end
    with fresh_file(vcd) as file:
        write_dump(lines.parts(), file, source.names, end=end)


def _write_with_pins(source: Source, edges: Edges, vcd: Path) -> None:
    from sacbus.simad.dump import SCOPE, wire_names
    from sacbus.simad.edges import DIR, HIGH
    from sacbus.trace.vcd import Signal, write_vcd

    assert source.recording is not None
    wires = wire_names(source.names)
    first = (edges.direction, *[HIGH] * len(source.names))
    signals = [
        Signal(SCOPE, wires[line], first[line], *edges.of_line(line))
        # DIR last: at one instant a step line is high before DIR turns.
        for line in (*range(1, len(wires)), DIR)
    ]
    with fresh_text(vcd) as out:
        write_vcd(source.recording, out, signals=signals)


def _draw(lines: _Lines, names: Sequence[str], picture: Path, form: str, at: int | None) -> None:
    from sacbus.simad.excerpt import excerpt
    from sacbus.simad.picture import draw_lines

    steps, falls = lines.steps()
    found = excerpt(steps, falls, lines.edges(), at)
    with fresh_file(picture) as file:
        draw_lines(found, names, file, form)


def _tell(report: Report, driven: Sequence[int], own: Sequence[int | None], as_json: bool) -> None:
    if as_json:
        told = report.as_json()
        for axis, position, node in zip(told["axes"], driven, own, strict=True):
            axis["decoded_position"] = position
            axis["node_position"] = node
        click.echo(json.dumps(told))
        return
    for one, node in zip(report.axes, own, strict=True):
        moved = "none moved"
        if one.moved:
            moved = (
                f"{one.moved} moved, late by {one.delay_max / 1_000:g} µs at most, "
                f"{one.delay_mean / 1_000:.3f} µs in the mean, {one.delay_rms / 1_000:.3f} µs rms"
            )
        where = f"to {one.position}" + ("" if node is None else f", the node to {node}")
        click.echo(
            f"axis {one.axis}: {one.steps} step{'' if one.steps == 1 else 's'} {where}, {moved}"
        )
    rates = report.as_json()["highest_rate"]
    click.echo(
        f"{report.steps} steps on {report.lines} lines in place of {report.lines_without}, "
        f"DIR turns {report.dir_changes} times"
    )
    click.echo(
        f"at most {rates['one_direction']:.0f} steps/s an axis in one direction, "
        f"{rates['both_directions']:.0f} in both"
    )


def _verdict(source: Source, driven: Sequence[int]) -> int:
    """The exit status; what else there is to be told about the source goes to standard error."""
    status = 0
    for name, lines, node in zip(source.names, driven, source.positions(), strict=True):
        if node is not None and node != lines:
            click.echo(
                f"error: axis {name}: the lines lead to {lines}, the node to {node}", err=True
            )
            status = 1
    if source.result is not None:
        for failure in source.result.failures:
            click.echo(f"note: {failure}", err=True)
            status = 1
    elif source.recording is not None:
        note_cut_off(source.recording)
    return status
