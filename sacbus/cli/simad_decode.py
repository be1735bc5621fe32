"""``sacbus simad decode``: what drivers make of the lines in a dump."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import click

from sacbus.cli.options import STANDARD, WrongInput, verbose
from sacbus.cli.recordings import fresh_text, refuse_missing_directories, refuse_shared_files
from sacbus.fresh import fresh_file

if TYPE_CHECKING:
    from sacbus.simad import Steps

__all__ = ["decode_command"]


@click.command("decode")
@click.argument("place", metavar="FILE.vcd")
@click.option("--dir", "direction", default="", metavar="NAME", help="The wire that DIR is.")
@click.option(
    "--steps",
    default="",
    metavar="NAME,NAME...",
    help="The wires that step lines are. [default: dir and step_... of one scope]",
)
@click.option(
    "--csv",
    "table",
    metavar="FILE",
    help="Write the steps: time_ns,axis,direction a line; - is standard output.",
)
@click.option(
    "--npy",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write the steps as an array for numpy.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the axes as JSON.")
@verbose
def decode_command(
    place: str,
    direction: str,
    steps: str,
    table: str | None,
    npy: Path | None,
    as_json: bool,
) -> int:
    """Tell the steps that drivers make of lines: ours, or those that an analyser has seen.

    FILE.vcd of - is standard input. A step is where a step line falls from high to low.

    \b
    Example: sacbus simad decode lines.vcd
             sacbus simad decode capture.vcd --dir D0 --steps D1,D2 --csv steps.csv
    """
    from sacbus.simad import Decoder, SimadError
    from sacbus.simad.dump import read_dump
    from sacbus.simad.edges import UNKNOWN

    if bool(direction) != bool(steps):
        raise click.UsageError("expected --dir and --steps together, or none of them")
    if table == STANDARD and as_json:
        raise click.UsageError("--csv: expected a file together with --json, got -")
    outputs = {"--csv": None if table == STANDARD else table, "--npy": npy}
    refuse_shared_files(outputs, [place] if place != STANDARD else [])
    refuse_missing_directories(outputs)
    chosen = tuple(one.strip() for one in steps.split(",")) if steps else ()
    try:
        with _opened(place) as file:
            wires, parts = read_dump(file, direction, chosen)
            decoder = Decoder(UNKNOWN, UNKNOWN)
            found = _Found(map(decoder.take, parts), wires.axes, keep=npy is not None)
            if table == STANDARD:
                found.write(sys.stdout)
            elif table is not None:
                with fresh_text(Path(table)) as out:
                    found.write(out)
            else:
                found.run()
    except SimadError as fault:
        raise WrongInput(f"{place}: {fault}") from fault
    if npy is not None:
        found.save(npy)
    if as_json:
        click.echo(json.dumps(found.as_json()))
    elif table != STANDARD:
        for one in found.as_json()["axes"]:
            steps = "1 step" if one["steps"] == 1 else f"{one['steps']} steps"
            click.echo(f"axis {one['axis']}: {steps} to {one['position']}")
    return 0


@contextmanager
def _opened(place: str) -> Iterator[BinaryIO]:
    """A file, or standard input."""
    if place == STANDARD:
        yield sys.stdin.buffer
        return
    with ExitStack() as stack:
        try:
            file = stack.enter_context(Path(place).open("rb"))
        except OSError as fault:
            raise WrongInput(f"{place}: {fault.strerror}, name a value change dump") from fault
        yield file


class _Found:
    """The steps of a file while they go by; ``keep``: whether they are kept."""

    def __init__(self, parts: Iterator[Steps], names: Sequence[str], *, keep: bool) -> None:
        self._parts = parts
        self._names = names
        self._kept: list[Steps] | None = [] if keep else None
        self._positions = [0] * len(names)
        self._counts = [0] * len(names)

    def run(self) -> None:
        """All of them, for who wants to know where they lead."""
        for _ in self._passing():
            pass

    def write(self, out: Any) -> None:  # noqa: ANN401 (any text file)
        """All of them, as CSV."""
        from sacbus.simad.step_files import write_csv

        write_csv(self._passing(), out, self._names)

    def save(self, path: Path) -> None:
        """Those that were kept, as an array; axes by their number if all have one."""
        from sacbus.simad.step_files import write_npy
        from sacbus.simad.steps import joined

        names = self._names
        decimal = all(name.isascii() and name.isdecimal() for name in names)
        with fresh_file(path) as file:
            numbers = [int(name) for name in names] if decimal else range(len(names))
            write_npy(joined(self._kept or []), file, numbers)

    def as_json(self) -> dict[str, Any]:
        """How many there were, and where they lead. ``Any``: the shapes of JSON."""
        axes = zip(self._names, self._counts, self._positions, strict=True)
        return {
            "steps": sum(self._counts),
            "axes": [
                {"axis": name, "steps": count, "position": position}
                for name, count, position in axes
            ],
        }

    def _passing(self) -> Iterator[Steps]:
        for part in self._parts:
            if self._kept is not None:
                self._kept.append(part)
            for axis in range(len(self._names)):
                signs = part.of_axis(axis)[1]
                self._counts[axis] += signs.size
                self._positions[axis] += int(signs.sum())
            yield part
