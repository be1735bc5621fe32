"""``sacbus gcode``: a part program as commands of the axes, simulated or run."""

from __future__ import annotations

import asyncio
import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from sacbus.cli.machine_operator import Operator, ask, check_somebody_there, go_on
from sacbus.cli.options import STANDARD, USAGE_STATUS, WrongInput, baud, verbose
from sacbus.cli.part_program import PartProgram
from sacbus.cli.recordings import (
    fresh_text,
    picture_form,
    refuse_missing_directories,
    refuse_shared_files,
)
from sacbus.cli.spoken import check_spoken
from sacbus.fresh import fresh_file

if TYPE_CHECKING:
    from sacbus.gcode import Checked
    from sacbus.machining import Course, Machined
    from sacbus.toolpath import Axis, Machine

__all__ = ["gcode_command"]

_AXIS: Final = re.compile(r"([A-Za-z])=(\d{1,3}):(\d{1,9}(?:\.\d{1,9})?)")


def _read_axes(
    _ctx: click.Context, _param: click.Parameter, given: Sequence[str]
) -> tuple[Axis, ...]:
    """Each ``X=10:400``; the rules are those of a machine file."""
    from sacbus.config.machine import AXIS, LETTERS
    from sacbus.toolpath import Axis

    fits = {key.name: key for key in AXIS}
    axes: list[Axis] = []
    for text in given:
        found = _AXIS.fullmatch(text)
        if found is None:
            raise click.BadParameter(f"expected LETTER=NODE:STEPS_PER_MM as X=10:400, got {text!r}")
        values = {
            "name": found[1].upper(),
            "node": int(found[2]),
            "steps_per_mm": float(found[3]),
        }
        for name, value in values.items():
            if not fits[name].fits(value):
                allowed = fits[name].allowed
                raise click.BadParameter(f"expected {name} {allowed} in {text!r}, got {value}")
        axes.append(Axis(found[1].upper(), int(found[2]), float(found[3])))
    for what, those in (("letter", [a.name for a in axes]), ("node", [a.node for a in axes])):
        if len(set(those)) < len(those):
            raise click.BadParameter(f"expected each axis's own {what}, got {' '.join(given)}")
    return tuple(sorted(axes, key=lambda axis: LETTERS.index(axis.name)))


def _read_tolerance(
    _ctx: click.Context, _param: click.Parameter, given: float | None
) -> float | None:
    """As of a machine file."""
    from sacbus.config.machine import MACHINE

    (key,) = (key for key in MACHINE if key.name == "tolerance")
    if given is not None and not key.fits(given):
        raise click.BadParameter(f"expected {key.allowed}, got {given:g}")
    return given


@click.command("gcode")
@click.argument("file", metavar="FILE.ngc")
@click.option(
    "--axis",
    "axes",
    multiple=True,
    metavar="X=NODE:STEPS",
    callback=_read_axes,
    help="An axis: its letter, its node, full steps a mm. Repeats.",
)
@click.option(
    "--machine", "machine_file", metavar="FILE.toml", help="Axes and limits: a machine file."
)
@click.option(
    "--tolerance",
    type=float,
    metavar="MM",
    callback=_read_tolerance,
    help="By how much chords may part from an arc. [default: the machine's, 0.01]",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="Write the commands, block by block.",
)
@click.option("--link", metavar="LINK", help="Run it on this line, in real time.")
@baud
@click.option("--plan-only", is_flag=True, help="Neither run nor simulate it.")
@click.option(
    "--plot",
    "picture",
    type=click.Path(dir_okay=False),
    metavar="FILE",
    help="Draw the path asked for, the path done, and the deviation: .png or .svg.",
)
@click.option(
    "--record",
    type=click.Path(dir_okay=False),
    metavar="FILE",
    help="Keep a recording of the simulation.",
)
@click.option("--json", "as_json", is_flag=True, help="Print what came of it as JSON.")
@verbose
def gcode_command(
    file: str,
    axes: tuple[Axis, ...],
    machine_file: str | None,
    tolerance: float | None,
    output: str | None,
    link: str | None,
    baud: int,
    plan_only: bool,
    picture: str | None,
    record: str | None,
    as_json: bool,
) -> int:
    """Translate a part program into commands of the axes, and run it.

    Without --link it is simulated: on virtual nodes, in virtual time, over a line of --baud. The
    whole file is checked first; nothing moves when anything in it is wrong (status 2). A FILE of -
    is standard input. The words of G-code, machine files and what happens on the line are in
    docs/gcode.md. Ctrl-C stops all axes, status 130.

    \b
    Example: sacbus gcode part.ngc --axis X=10:400 --axis Y=11:400
             sacbus gcode part.ngc --machine examples/router.toml --plot part.png
             sacbus gcode part.ngc --machine examples/router.toml --link /dev/ttyUSB0
    """
    from sacbus.machining import Course, rehearse, run_on_link
    from sacbus.machining import plan_only as plan
    from sacbus.machining.account import account
    from sacbus.machining.account import as_json as account_as_json

    if link is not None and plan_only:
        raise click.UsageError("expected --link or --plan-only, got both")
    if as_json and output == STANDARD:
        raise click.UsageError("--json: expected -o to be a file, got standard output")
    if machine_file == STANDARD == file:
        raise click.UsageError("expected one of FILE and --machine from standard input, got both")
    machine = _machine(axes, machine_file, tolerance)
    if record is not None and (link is not None or plan_only):
        raise click.UsageError("--record: expected a simulation, see sacbus serve --record")
    outputs = {
        "-o": None if output == STANDARD else output,
        "--plot": picture,
        "--record": record,
    }
    refuse_shared_files(
        outputs, [one for one in (file, machine_file) if one not in (None, STANDARD)]
    )
    refuse_missing_directories(outputs)
    form = "" if picture is None else picture_form(picture)
    if link is not None:
        asyncio.run(check_spoken(link))
    with ExitStack() as stack:
        program = stack.enter_context(PartProgram.opened(file))
        checked = _checked(program, machine)
        if checked is None:
            return USAGE_STATUS
        write = None if output is None else stack.enter_context(_listing(output, program.name))
        course = Course(program.items(machine), machine, write=write)
        with Operator(program.name, checked.lines) as operator, _too_far_told(program.name):
            if plan_only:
                machined = plan(course, baud=baud, progress=operator.come_to)
            elif link is not None:
                if checked.waits:
                    check_somebody_there()  # before anything moves
                machined = run_on_link(course, operator.told(ask), link, baud=baud)
            else:
                sink = None
                if record is not None:
                    sink = stack.enter_context(Path(record).open("wb", buffering=0))
                machined = rehearse(
                    course,
                    operator.told(go_on),
                    baud=baud,
                    watch=picture is not None,
                    record=sink,
                )
    if picture is not None:
        from sacbus.machining.picture import draw_course

        with fresh_file(Path(picture)) as opened:
            draw_course(program.name, course, machined, opened, form)
    if as_json:
        click.echo(json.dumps(account_as_json(program.name, checked, course, machined)))
    elif output != STANDARD:
        for line in account(program.name, checked, course, machined):
            click.echo(line)
    if machined.cut_off is not None:
        raise machined.cut_off
    return 0 if _arrived(course, machined) else 1


def _machine(axes: tuple[Axis, ...], machine_file: str | None, tolerance: float | None) -> Machine:
    from dataclasses import replace

    from sacbus.config.machine import read_machine
    from sacbus.toolpath import Machine

    if machine_file is None and not axes:
        raise click.UsageError("expected --axis or --machine, got neither")
    if machine_file is not None and axes:
        raise click.UsageError("expected --axis or --machine, got both")
    machine = Machine(axes) if machine_file is None else read_machine(machine_file)
    return machine if tolerance is None else replace(machine, tolerance=tolerance)


def _checked(program: PartProgram, machine: Machine) -> Checked | None:
    """What the program comes to; None when it is wrong, which has been told then."""
    from sacbus.gcode import GcodeError, check_program

    try:
        return check_program(program.lines(), machine, program.name)
    except GcodeError as wrong:
        for mistake in wrong.mistakes:
            click.echo(f"error: {mistake}", err=True)
        return None


@contextmanager
def _listing(output: str, name: str) -> Iterator[Callable[[str], object]]:
    """Where the commands are written."""
    head = f"# {name}: node and command, block by block; each block's axes start together\n"
    if output == STANDARD:
        sys.stdout.write(head)
        yield sys.stdout.write
        return
    with fresh_text(Path(output)) as text:
        text.write(head)
        yield text.write


@contextmanager
def _too_far_told(name: str) -> Iterator[None]:
    from sacbus.machining import TooFar

    try:
        yield
    except TooFar as fault:
        raise WrongInput(f"{name}, {fault}") from fault


def _arrived(course: Course, machined: Machined) -> bool:
    """Whether all axes are where the plan has them, as far as anybody can tell."""
    if machined.reached is None:
        return True
    planned = [course.survey.steps.get(index, 0) for index in range(len(machined.reached))]
    return list(machined.reached) == planned
