"""Part programs on virtual nodes: where they arrive, and how the nodes got there."""

from __future__ import annotations

import asyncio
import io
import math
import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from examples import relief
from sacbus.config.machine import read_machine
from sacbus.gcode import read_program
from sacbus.machining import Course, Machined, Told, plan_only, rehearse
from sacbus.mother import Streamed
from sacbus.toolpath import Machine
from sacbus.trace import Recording
from tests.machining.seen import check_that_it_ran_as_listed, listed

EXAMPLES = Path(__file__).parents[2] / "examples"
ROUTER = read_machine(EXAMPLES / "router.toml")

#: The router's axes follow 20 RPM without a ramp; the steps of a short command are whole ones, so
#: their velocity is a little more or less than the path's.
JUMP = 30.0


def at(machined: Machined) -> list[float]:
    """Where the nodes were in the end."""
    return list(machined.reached or ())


async def _go_on(_text: str, _waits: bool) -> None:
    pass


def told(lines: list[int] | None = None, stopped: list[Streamed] | None = None) -> Told:
    return Told(
        (lambda _: None) if lines is None else lines.append,
        _go_on,
        (lambda _: None) if stopped is None else stopped.append,
    )


def circle(radius: float = 6.0) -> list[str]:
    return ["F600", f"G2 X0 Y0 I{radius}"]


def test_a_circle_comes_back_to_where_it_began_seamlessly() -> None:
    listing, sink = io.StringIO(), io.BytesIO()
    course = Course(read_program(circle(), ROUTER), ROUTER, write=listing.write)
    machined = rehearse(course, told(), watch=True, record=sink)
    assert at(machined) == [0, 0, 0]
    assert machined.streamed is not None
    blocks = listed(listing.getvalue())
    check_that_it_ran_as_listed(Recording(sink), blocks, jump=JUMP)
    assert machined.streamed.blocks == len(blocks) == course.survey.blocks
    assert machined.done is not None
    # The tool was on the circle all the time: a step is 0.025 mm.
    away = [abs(math.hypot(x - 6, y) - 6) for x, y, _ in machined.done.points]
    assert max(away) < 0.04
    assert len(away) > 500


@pytest.mark.slow
@pytest.mark.parametrize("name", ["circle", "spiral"])
def test_the_examples_run(name: str) -> None:
    listing, sink = io.StringIO(), io.BytesIO()
    program = (EXAMPLES / f"{name}.ngc").read_text().splitlines()
    course = Course(read_program(program, ROUTER), ROUTER, write=listing.write)
    machined = rehearse(course, told(), record=sink)
    assert at(machined) == [0, 0, 0]
    check_that_it_ran_as_listed(Recording(sink), listed(listing.getvalue()), jump=JUMP)


@pytest.mark.slow
def test_a_relief_of_some_thousand_lines_runs_and_its_feed_is_what_the_line_carries() -> None:
    lines = list(relief.program(1_200))
    listing, sink, passed = io.StringIO(), io.BytesIO(), list[int]()
    course = Course(read_program(lines, ROUTER), ROUTER, write=listing.write)
    machined = rehearse(course, told(passed), record=sink)
    assert at(machined) == [0, 0, 0]
    streamed, survey = machined.streamed, course.survey
    assert streamed is not None
    check_that_it_ran_as_listed(Recording(sink), listed(listing.getvalue()), jump=JUMP)
    assert passed == sorted(passed)
    assert passed[-1] == len(lines) - 1
    assert (streamed.commands, streamed.blocks) == (survey.commands, survey.blocks)
    assert streamed.deepest <= 30
    # What the line carried in the time there was.
    assert streamed.moving > 0.5 * streamed.packets * machined.command_seconds * 1e9
    # Between blocks all stand still for some ms, no more.
    assert streamed.late_by < 0.02 * streamed.moving


def test_a_slow_line_lowers_the_feed_and_says_so() -> None:
    fast, slow = (Course(read_program(circle(), ROUTER), ROUTER) for _ in range(2))
    quick = rehearse(fast, told(), baud=115_200)
    tardy = rehearse(slow, told(), baud=2_400)
    assert at(tardy) == at(quick) == [0, 0, 0]
    assert slow.survey.planned > 2 * fast.survey.planned
    assert [reason for reason in slow.survey.reasons if "the line carries" in reason]
    assert 0 < slow.survey.lowered < 1
    assert tardy.streamed is not None
    assert tardy.streamed.late_by < 0.1 * tardy.streamed.moving


def test_inverted_axes_go_the_other_way_and_settings_arrive_at_the_nodes() -> None:
    course = Course(read_program(["G0 X2 Y3 Z-1"], ROUTER), ROUTER)
    assert at(rehearse(course, told())) == [80, -120, -100]
    x = ROUTER.axes[0]
    fine = Machine((replace(x, drive=replace(x.drive, sprf=400)),))
    course = Course(read_program(["G0 X2"], fine), fine)
    machined = rehearse(course, told())
    assert at(machined) == [80]
    assert machined.reports == {}


def test_a_plan_alone_comes_to_the_same_commands() -> None:
    planned, run = io.StringIO(), io.StringIO()
    course = Course(read_program(circle(), ROUTER), ROUTER, write=planned.write)
    lines: list[int] = []
    machined = plan_only(course, baud=38_400, progress=lines.append)
    assert machined == Machined(machined.command_seconds)
    rehearse(Course(read_program(circle(), ROUTER), ROUTER, write=run.write), told())
    assert planned.getvalue() == run.getvalue()
    assert set(lines) == {2}


def test_a_program_of_any_length_takes_no_more_memory() -> None:
    def lines(count: int) -> Iterator[str]:
        yield "F900"
        for number in range(count):
            yield f"G1 X{number % 7} Y{number % 5}"

    def peak(count: int) -> int:
        course = Course(read_program(lines(count), ROUTER), ROUTER)
        tracemalloc.start()
        plan_only(course, baud=38_400, progress=lambda _: None)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(20)  # what is imported and remembered once
    assert peak(160) < peak(40) + 200_000


def test_a_rehearsal_that_is_cancelled_says_how_far_it_came() -> None:
    stopped: list[Streamed] = []
    course = Course(read_program(["F100", "G1 X100"], ROUTER), ROUTER)

    def interrupt(_line: int) -> None:
        task = asyncio.current_task()
        assert task is not None
        task.cancel()

    with pytest.raises(asyncio.CancelledError):
        rehearse(course, replace(told(stopped=stopped), progress=interrupt))
    assert [(one.blocks, one.over) for one in stopped] == [(1, False)]
