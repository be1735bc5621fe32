"""Blocks: what becomes of a few stretches, held against the pulses that their commands make."""

from __future__ import annotations

from itertools import pairwise
from math import dist

import pytest

from sacbus.toolpath import AxisRun, Block, Dwell, Pulses, Straight
from tests.toolpath.paths import COMMAND_SECONDS, XYZ, circle, planned, spiral, straights

Point = tuple[float, ...]

ARC = list(circle(2, 60))[:12]
CURVES = {
    "a coarse circle": list(circle(10, 72)),
    "a fine circle": list(circle(4, 1500)),
    "a small circle": list(circle(2, 1500)),
    "a spiral": list(spiral(6, 80, 3)),
}


def changes(run: AxisRun) -> list[float]:
    """By how many RPM an axis changes its velocity where a command goes on from the last."""
    profiles = Pulses(XYZ.axes[run.axis], run).profiles
    found = []
    for (start, one), (following, two) in pairwise(zip(run.starts, profiles, strict=True)):
        if following != start + (one.duration or 0):
            continue
        before = one.drive.real_rpm(one.last_period) * (1 if one.motion.cw else -1)
        after = two.drive.real_rpm(two.time_of(1)) * (1 if two.motion.cw else -1)
        found.append(abs(after - before))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("points", CURVES.values(), ids=CURVES)
def test_commands_change_velocity_by_little_more_than_the_jump(points: list[Point]) -> None:
    found = sorted(
        change
        for block in planned(straights(points, 100))
        for run in block.runs
        for change in changes(run)
    )
    # Whole steps in whole us: what the law has as 10 RPM is not quite that.
    assert found[len(found) * 95 // 100] < 11.5
    assert found[-1] < 16


def positions(block: Block) -> list[Point]:
    """Where the axes are after each pulse of any, in mm from where the block begins."""
    events = []
    for run in block.runs:
        axis = XYZ.axes[run.axis]
        pulses = Pulses(axis, run)
        before = 0.0
        for ticks, place in zip(
            pulses.times(0, run.end).tolist(), pulses.places(0, run.end).tolist(), strict=True
        ):
            events.append((ticks, run.axis, (place - before) / axis.steps_per_mm))
            before = place
    at = [0.0] * 3
    found: list[Point] = []
    last = -1
    for ticks, axis_index, way in sorted(events):
        at[axis_index] += way
        if ticks == last:
            found.pop()
        found.append(tuple(at))
        last = ticks
    return found


def distance(point: Point, begin: Point, end: Point) -> float:
    """From a point to a line, as at school."""
    way = [b - a for a, b in zip(begin, end, strict=True)]
    square = sum(one * one for one in way)
    along = sum((p - a) * w for p, a, w in zip(point, begin, way, strict=True)) / square
    along = min(max(along, 0.0), 1.0)
    return dist(point, [a + along * w for a, w in zip(begin, way, strict=True)])


def test_the_deviation_of_an_arc_is_that_of_its_pulses_from_its_points() -> None:
    (block,) = planned(straights(ARC, 20))
    way = [(0.0, 0.0, 0.0), *ARC]
    worst = max(min(distance(at, *line) for line in pairwise(way)) for at in positions(block))
    assert block.deviation.mm == pytest.approx(worst, rel=1e-9)
    assert block.deviation.steps == pytest.approx(worst * 400)


def test_points_that_were_left_out_count_as_path() -> None:
    bulge = 0.9 / 400
    (block,) = planned(straights([(2, bulge, 0), (4, 0, 0)], 20), join_steps=1)
    # Y has no command at all: the tool goes straight on, below the bulge.
    assert [run.axis for run in block.runs] == [0]
    assert block.deviation.steps == pytest.approx(0.9, rel=1e-3)


def test_a_block_that_begins_between_steps_is_off_from_the_beginning() -> None:
    _, block = planned(
        [Straight((5.0, 0.4 / 400, 0.0), 20), Dwell(1.0), Straight((9.0, 0.0, 0.0), 20)]
    )
    assert block.deviation.steps == pytest.approx(0.4, rel=1e-2)


def test_a_path_between_steps_is_no_nearer_for_being_rounded() -> None:
    (block,) = planned(straights([(5, 0.4 / 400, 0)], 20))
    assert block.deviation.steps == pytest.approx(0.4, rel=1e-2)
    assert block.deviation.reason == ""


@pytest.mark.parametrize("carried", [0.0, COMMAND_SECONDS, 6 * COMMAND_SECONDS])
@pytest.mark.parametrize("curve", ["a coarse circle", "a small circle"])
def test_blocks_are_as_full_as_their_queues_and_no_faster_than_their_line(
    curve: str, carried: float
) -> None:
    blocks = planned(straights(CURVES[curve], 100), command_seconds=carried)
    fullest = [max(len(run.motions) for run in block.runs) for block in blocks]
    assert max(fullest) <= 29
    assert min(fullest[:-1]) >= 20
    for block in blocks:
        commands = sum(len(run.motions) for run in block.runs)
        assert block.duration >= (commands + 2) * carried * 2_000_000


def test_a_long_stretch_behind_tiny_ones_gets_to_its_feed_by_stairs() -> None:
    tiny = [(0.02 * i, 0.0, 0.0) for i in range(1, 8)]
    (block,) = planned(straights([*tiny, (20.0, 0.0, 0.0)], 100), join_steps=-1)
    assert max(motion.rpm for motion in block.runs[0].motions) == 200
    assert max(changes(block.runs[0])) < 16


@pytest.mark.parametrize(("length", "ends"), [(0.2, [15]), (0.8, [7, 15])])
def test_a_stretch_that_tiny_ones_would_hold_up_begins_a_block(
    length: float, ends: list[int]
) -> None:
    tiny = [0.02 * i for i in range(1, 8)]
    along = [*tiny, *(tiny[-1] + length + one for one in (0.0, *tiny))]
    blocks = planned(straights(((x, 0.0, 0.0) for x in along), 100), join_steps=-1)
    assert [block.lines[1] for block in blocks] == ends


def test_lines_slow_enough_for_every_corner_are_one_block() -> None:
    square = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)]
    (block,) = planned(straights(square, 4))
    assert block.duration / 2_000_000 == pytest.approx(block.asked, rel=0.01)
    assert block.length == 4
    assert block.lowered == 0
