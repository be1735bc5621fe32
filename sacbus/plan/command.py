"""What ``sacbus plan`` does with its arguments.

Owns the order of things: the input is read and checked whole, files are written, and only then is
anything said; so that what is wrong leaves nothing half done. Shows progress on a terminal.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import click

from sacbus.fresh import fresh_file
from sacbus.language import Defaults
from sacbus.motion import Drive
from sacbus.picture_format import PictureError, picture_format
from sacbus.plan.entries import Commands, ListFile, PlanError, QueueFile, Source, Spool
from sacbus.plan.pulses import PulseFormat, format_of, write_pulses
from sacbus.plan.report import json_pieces, text_lines
from sacbus.plan.sequence import Plan, Survey
from sacbus.plan.table import table_as_json, table_as_text

__all__ = ["Request", "carry_out"]

STANDARD: Final = "-"
"""The name of standard input and output."""

LONG: Final = 2_000
"""Commands from which on progress is shown: some tenths of a second."""

MANY_PULSES: Final = 1_000_000

IN_ONE_WRITE: Final = 500
"""Lines written to standard output at a time."""


@dataclass(frozen=True, slots=True)
class Request:
    """What was asked for. Paths are as they were given; ``-`` is standard input or output."""

    commands: tuple[str, ...]
    drive: Drive
    queue: str | None = None
    one_shots: str | None = None
    start_rpm: int = 0
    gap: bool = True
    loops: int = 1
    pulses: str | None = None
    picture: str | None = None
    table: bool = False
    as_json: bool = False


def carry_out(request: Request) -> None:
    """Plan, write the files asked for, and say on standard output what comes out.

    :class:`PlanError` for what cannot be planned or read, OSError for what cannot be written.
    """
    if request.table:
        _tell_table(request)
        return
    # What can be refused at a glance is, before an input of any length is read.
    form = _pulse_format(request.pulses)
    drawing = _drawing(request.picture)
    with ExitStack() as inputs:
        source, lines = _source(request, inputs)
        plan = Plan(
            source,
            request.drive,
            start_rpm=request.start_rpm,
            gap=request.gap,
            loops=request.loops,
        )
        with _progress("reading", lines, shown=lines > LONG) as step:
            survey = plan.survey(lambda: step(1))
        if drawing is not None and request.picture is not None:
            with fresh_file(Path(request.picture)) as file:
                drawing(plan, survey, file)
        if form is not None and request.pulses is not None:
            _write_pulses(request.pulses, form, plan, survey)
            if request.pulses == STANDARD:
                return
        _tell(request, plan, survey)


def _tell_table(request: Request) -> None:
    if request.as_json:
        click.echo(json.dumps(table_as_json(request.drive)))
    else:
        click.echo("\n".join(table_as_text(request.drive)))


def _tell(request: Request, plan: Plan, survey: Survey) -> None:
    """The report; commands are counted while it goes to a file or a pipe."""
    whole = survey.commands > LONG and not sys.stdout.isatty()
    with _progress("planning", survey.commands, shown=whole) as step:
        if request.as_json:
            pieces = json_pieces(plan, survey)
        else:
            pieces = (line + "\n" for line in text_lines(plan, survey))
        waiting: list[str] = []
        for piece in pieces:
            waiting.append(piece)
            if len(waiting) == IN_ONE_WRITE:
                click.echo("".join(waiting), nl=False)
                waiting.clear()
            step(1)
        click.echo("".join(waiting), nl=False)


def _write_pulses(place: str, form: PulseFormat, plan: Plan, survey: Survey) -> None:
    pulses = survey.pulses or 0
    with _progress("pulses", pulses, shown=pulses > MANY_PULSES) as step:
        if place == STANDARD:
            write_pulses(plan, survey, sys.stdout.buffer, form, step)
            sys.stdout.buffer.flush()
        else:
            with fresh_file(Path(place)) as file:
                write_pulses(plan, survey, file, form, step)


def _pulse_format(place: str | None) -> PulseFormat | None:
    if place is None:
        return None
    return PulseFormat.CSV if place == STANDARD else format_of(Path(place))


def _drawing(place: str | None) -> Callable[[Plan, Survey, BinaryIO], None] | None:
    """What draws in the format asked for; None when nothing is to be drawn."""
    if place is None:
        return None
    try:
        form = picture_format(Path(place))
    except PictureError as fault:
        raise PlanError(str(fault)) from fault
    try:
        # matplotlib is an extra, and takes longer to import than most plans to make.
        from sacbus.plan import picture  # noqa: PLC0415
    except ImportError as fault:
        raise PlanError(
            f"drawing needs matplotlib ({fault}), --plot, "
            "install it: python -m pip install 'sacbus[plot]'"
        ) from fault
    return lambda plan, survey, file: picture.draw_plan(plan, survey, file, form)


def _source(request: Request, inputs: ExitStack) -> tuple[Source, int]:
    """Where the commands come from, and how many lines that is, roughly."""
    given = [request.queue is not None, request.one_shots is not None, bool(request.commands)]
    if sum(given) != 1:
        raise PlanError(
            "commands, --list and --queue exclude each other, sacbus plan, give one of them"
            if any(given)
            else "nothing to plan, sacbus plan, give commands such as m400v120, --list, --queue "
            "or --table"
        )
    if request.queue is not None:
        spool = inputs.enter_context(_read(request.queue))
        return QueueFile(spool, Defaults(sprf=request.drive.steps_per_rev)), spool.lines
    if request.one_shots is not None:
        spool = inputs.enter_context(_read(request.one_shots))
        return ListFile(spool), spool.lines
    spools: list[Spool] = []
    parts: list[str | Source] = []
    for command in request.commands:
        if command == STANDARD:
            if not spools:
                spools.append(inputs.enter_context(_read(STANDARD)))
            parts.append(ListFile(spools[0]))
        else:
            parts.append(command)
    return Commands(parts), sum(spool.lines for spool in spools)


def _read(place: str) -> Spool:
    if place == STANDARD:
        return Spool(sys.stdin.buffer, "standard input")
    try:
        with Path(place).open("rb") as file:
            return Spool(file, place)
    except OSError as fault:
        raise PlanError(
            f"the input cannot be read ({fault.strerror or fault}), {place}, check the path"
        ) from fault


@contextmanager
def _progress(what: str, length: int, *, shown: bool) -> Iterator[Callable[[int], object]]:
    """A bar on standard error if that is a terminal; what is done is told to what is given."""
    if not shown or not sys.stderr.isatty():
        yield lambda _done: None
        return
    with click.progressbar(
        length=length,
        label=what,
        file=sys.stderr,
        update_min_steps=max(1, length // 200),
    ) as bar:
        yield bar.update
