"""How far the tool is from its path: against a slow walk, and told with a reason."""

from __future__ import annotations

import tracemalloc
from math import hypot, inf
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.motion import REST, Drive, Left, begin, plan
from sacbus.toolpath import (
    Axis,
    AxisRun,
    Block,
    Law,
    Machine,
    Phase,
    deviation,
    follow,
    plan_line,
)
from tests.toolpath.lines import random_line


def events(machine: Machine, block: Block) -> list[tuple[int, int, float]]:
    """Every pulse as (tick, axis, mm), walked one by one through every command."""
    found: list[tuple[int, int, float]] = []
    for run in block.runs:
        axis = machine.axes[run.axis]
        before, end = REST, 0
        for at, motion in enumerate(run.motions):
            beginning = begin(motion, before, end)
            profile = plan(motion, axis.drive, beginning.start_rpm)
            assert beginning.start == run.starts[at]
            mm = 1 / axis.steps_per_mm / axis.drive.m
            forward = motion.cw is not axis.inverted
            for pulse in range(profile.pulses or 0):
                tick = beginning.start + profile.time_of(pulse)
                found.append((tick, run.axis, mm if forward else -mm))
            before, end = Left.by(profile), beginning.start + (profile.duration or 0)
    return sorted(found)


def distance(place: list[float], side: list[float]) -> float:
    """From a point to the stretch between 0 and another."""
    square = sum(one * one for one in side)
    along = sum(a * b for a, b in zip(place, side, strict=True)) / square
    along = min(max(along, 0.0), 1.0)
    return hypot(*(a - along * b for a, b in zip(place, side, strict=True)))


def walked(machine: Machine, block: Block, steps: tuple[int, ...]) -> float:
    """The largest distance from a line, pulse by pulse."""
    side = [count / axis.steps_per_mm for count, axis in zip(steps, machine.axes, strict=True)]
    place = [0.0] * len(side)
    worst = 0.0
    all_pulses = events(machine, block)
    for at, (tick, axis, mm) in enumerate(all_pulses):
        place[axis] += mm
        following = all_pulses[at + 1][0] if at + 1 < len(all_pulses) else inf
        if following > tick:  # what comes at one instant is one move
            worst = max(worst, distance(place, side))
    return worst


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32))
def test_it_is_what_a_walk_through_every_pulse_finds(seed: int) -> None:
    machine, steps, feed = random_line(Random(seed))
    steps = tuple(count // 40 or count for count in steps)  # type: ignore[assignment]
    block = plan_line(machine, steps, feed)
    assert block.deviation.mm == pytest.approx(walked(machine, block, steps), abs=1e-9)
    coarsest = min(machine.axes[run.axis].steps_per_mm for run in block.runs)
    assert block.deviation.steps == pytest.approx(block.deviation.mm * coarsest)


def square(*feeds: float) -> tuple[Machine, Law]:
    """A machine with two axes, and a law of so many segments of a second."""
    machine = Machine((Axis("X", 10, 10.0), Axis("Y", 11, 10.0)))
    return machine, tuple(Phase(at, 0.0, 1.0, 1.0, v, v) for at, v in enumerate(feeds))


def runs_of(machine: Machine, way: tuple[tuple[int, int], ...], law: Law) -> list[AxisRun]:
    found = [
        follow(axis, at, [side[at] for side in way], law) for at, axis in enumerate(machine.axes)
    ]
    return [run for run in found if run is not None]


def test_a_path_with_a_corner_is_measured_from_the_segments_nearby() -> None:
    machine, law = square(1.0, 1.0)
    way = ((10, 0), (0, 10))
    far = deviation(machine, way, law, runs_of(machine, way, law))
    # Steps of one axis at a time are on the path, wherever they are.
    assert far.steps == pytest.approx(0, abs=1e-9)


def test_a_path_that_comes_back_over_itself_is_not_taken_for_another_part_of_it() -> None:
    machine, law = square(1.0, 1.0, 1.0, 1.0)
    way = ((10, 0), (0, 10), (-10, 0), (0, -10))
    runs = runs_of(machine, way, law)
    assert deviation(machine, way, law, runs).steps == pytest.approx(0, abs=1e-9)
    # The other way round the square it would be on the path, too, but not when it should.
    around = ((0, 10), (10, 0), (0, -10), (-10, 0))
    assert deviation(machine, around, law, runs).steps > 5


def test_what_is_more_than_a_step_away_has_a_reason_that_names_the_axes() -> None:
    machine, law = square(1.0)
    way = ((10, 10),)
    (x, y) = runs_of(machine, way, law)
    assert deviation(machine, way, law, [x, y]).reason == ""
    # X alone is not what the way is.
    far = deviation(machine, way, law, [x])
    assert far.steps == pytest.approx(10 / 2**0.5)
    assert far.reason.startswith("a cruise of whole us at 0.950 s: X +0.50 steps from where")


def test_of_a_ramp_it_says_which_way() -> None:
    axis = Axis("X", 10, 10.0, drive=Drive())
    machine = Machine((axis, Axis("Y", 11, 10.0)))
    law: Law = (Phase(0, 0.0, 0.5, 2.0, 0.0, 10.0), Phase(0, 0.5, 1.0, 2.0, 10.0, 0.0))
    run = follow(axis, 0, [100], law)
    assert run is not None
    far = deviation(machine, ((100, 100),), law, [run])
    assert far.reason.startswith("a ramp down of whole steps and RPM")


@pytest.mark.slow
def test_a_line_of_a_million_pulses_takes_no_more_memory_than_a_short_one() -> None:
    machine = Machine((Axis("X", 10, 400.0, drive=Drive(ustep=3)), Axis("Y", 11, 100.0)))
    tracemalloc.start()
    block = plan_line(machine, (130_000, 26_001), 10_000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert sum(len(run.motions) for run in block.runs) < 20
    assert peak < 16_000_000
