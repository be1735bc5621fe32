"""Whole paths: where blocks end, what they come to, and that they stream."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from itertools import islice

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.motion import NO_RAMP, TICKS_PER_US, Drive, load_ticks
from sacbus.toolpath import Axis, Block, Dwell, Halt, Machine, PathItem, Straight, Survey, plan_path
from sacbus.toolpath.corner import Corner
from sacbus.toolpath.piece import Piece
from sacbus.toolpath.stretch import Stretch
from tests.toolpath.paths import (
    COMMAND_SECONDS,
    XYZ,
    circle,
    commanded,
    destination,
    moved,
    planned,
    spiral,
    straights,
    wanderings,
    zigzag,
)

TICKS = TICKS_PER_US * 1_000_000


def rpms(block: Block) -> dict[int, int]:
    """The highest velocity commanded of each axis, in RPM."""
    return {run.axis: max(motion.rpm for motion in run.motions) for run in block.runs}


# ------------------------------------------------------------------------ where blocks end


def test_a_square_is_four_blocks_from_rest_to_rest() -> None:
    square = [(5, 0, 0), (5, 5, 0), (0, 5, 0), (0, 0, 0)]
    blocks = planned(straights(square))
    assert [(block.runs[0].axis, block.runs[0].steps) for block in blocks] == [
        (0, 2000),
        (1, 2000),
        (0, -2000),
        (1, -2000),
    ]
    assert [block.lines for block in blocks] == [(1, 1), (2, 2), (3, 3), (4, 4)]


def test_a_coarse_circle_is_one_stretch_of_motion_cut_by_the_queues_alone() -> None:
    blocks = planned(straights(circle(10, 72)))
    counts = [max(len(run.motions) for run in block.runs) for block in blocks]
    assert len(blocks) < 72 / 10
    assert all(20 <= count <= 29 for count in counts[:-1])


def test_a_dwell_ends_a_block_and_is_told_with_it() -> None:
    items: list[PathItem] = [
        Straight((1.0, 0.0, 0.0), 30, 1),
        Dwell(0.5, 2),
        Dwell(1.0, 3),
        Straight((2.0, 0.0, 0.0), 30, 4),
    ]
    first, second = planned(items)
    assert (first.dwell, first.lines) == (1.5, (1, 3))
    assert (second.dwell, second.lines) == (0.0, (4, 4))


def test_a_halt_is_told_with_the_block_before_it() -> None:
    items: list[PathItem] = [
        Straight((1.0, 0.0, 0.0), 30, 1),
        Halt("M5", line=2),
        Halt("M0", waits=True, line=2),
    ]
    (block,) = planned(items)
    assert block.halts == (("M5", False), ("M0", True))


def test_what_follows_a_halt_is_not_told_before_it() -> None:
    items: list[PathItem] = [Dwell(1.0, 1), Halt("M0", waits=True, line=2), Dwell(2.0, 3)]
    first, second = planned(items)
    assert (first.dwell, first.halts, first.runs) == (1.0, (("M0", True),), ())
    assert (second.dwell, second.halts) == (2.0, ())


def test_a_path_of_nothing_has_no_blocks() -> None:
    assert planned([]) == []
    assert planned([Straight((0.0, 0.0, 0.0), 30), Straight((0.0005, 0.0, 0.0), 30)]) == []


def test_an_axis_that_stands_still_has_no_run() -> None:
    (block,) = planned([Straight((0.0, -2.0, 0.0), 30)])
    (run,) = block.runs
    assert (run.axis, run.steps) == (1, -800)


def test_an_inverted_axis_turns_the_other_way_for_the_same_steps() -> None:
    on = Machine((Axis("X", 10, 400, inverted=True),), feed=30)
    (block,) = planned([Straight((2.0,), 30)], on)
    (run,) = block.runs
    assert run.steps == 800
    assert not any(motion.cw for motion in run.motions)


def test_a_reversal_of_a_long_way_is_a_rest() -> None:
    assert len(planned(straights([(5, 0, 0), (-5, 0, 0)]))) == 2


def test_a_zigzag_of_tiny_ways_needs_no_rest_at_its_corners() -> None:
    blocks = planned(straights(zigzag(40, 0.02, 0.01)), join_steps=-1)
    assert len(blocks) < 10
    assert moved(blocks) == (0, 160, 0)


def test_a_way_too_short_for_its_feed_gathers_speed_by_ramps_however_many_points_it_has() -> None:
    # Its ramps meet in the middle. The point by the way makes it a stretch of a path, not a line.
    axes = (Axis("X", 10, 400, max_rpm=600, drive=Drive(ustep=3)), Axis("Y", 11, 400))
    bent = Machine(axes, acceleration=20)
    for steps in range(3235, 3250):
        way = [Straight((4.0, 0.0004), 400, 1), Straight((steps / 400, 0.0), 400, 2)]
        (block,) = planned(way, bent)
        (run,) = block.runs
        assert run.motions[0].acc100 < NO_RAMP
        assert run.motions[-1].dec100 < 99_800


# ------------------------------------------------------------------------ properties


@pytest.mark.slow
@settings(max_examples=60)
@given(wanderings(), st.integers(3, 29), st.sampled_from([0.0, COMMAND_SECONDS]))
def test_any_path_ends_on_its_last_position_by_blocks_that_nodes_and_line_can_take(
    items: list[PathItem], commands_max: int, command_seconds: float
) -> None:
    blocks = planned(items, commands_max=commands_max, command_seconds=command_seconds)
    assert moved(blocks) == destination(items)
    for block in blocks:
        commands = 0
        for run in block.runs:
            commands += len(run.motions)
            assert 1 <= len(run.motions) <= commands_max
            assert [motion.sync for motion in run.motions] == [True] + [False] * (
                len(run.motions) - 1
            )
        assert all(rpm <= 300 for rpm in rpms(block).values())
        if block.runs:
            assert block.duration >= (commands + 2) * command_seconds * TICKS


@pytest.mark.slow
@settings(max_examples=40)
@given(wanderings())
def test_the_times_of_a_block_are_those_of_its_commands(items: list[PathItem]) -> None:
    for block in planned(items):
        for run in block.runs:
            starts, end = commanded(run, XYZ.axes[run.axis])
            assert (list(run.starts), run.end) == (starts, end)
            assert run.loaded[0] == 0
            # Where a command goes on seamlessly, it is being loaded while it begins, at the latest.
            for loaded, start in zip(run.loaded, run.starts, strict=True):
                assert loaded <= start + load_ticks(acceleration_changes=True)
        assert block.duration == max((run.end for run in block.runs), default=0)


@pytest.mark.slow
@settings(max_examples=40)
@given(wanderings())
def test_all_dwells_and_halts_of_a_path_are_told_in_their_order(items: list[PathItem]) -> None:
    told: list[float | str] = []
    for block in planned(items):
        told += [block.dwell] * bool(block.dwell) + [text for text, _ in block.halts]
    expected: list[float | str] = []
    # Dwells without motion or a halt between them are one.
    dwelt = 0.0
    at = destination([])
    for item in [*items, Halt("")]:
        moves = isinstance(item, Straight) and destination([item]) != at
        if isinstance(item, Dwell):
            dwelt += item.seconds
        elif moves or isinstance(item, Halt):
            expected += [dwelt] * bool(dwelt)
            dwelt = 0.0
        if isinstance(item, Halt):
            expected.append(item.text)
        elif moves:
            at = destination([item])
    assert told == expected[:-1]


@pytest.mark.slow
@pytest.mark.parametrize("feed", [10, 30, 60, 120])
def test_a_feed_is_kept_to_and_no_path_gets_slower_by_a_higher_one(feed: float) -> None:
    square = [(5.0, 0.0, 0.0), (5.0, 5.0, 0.0), (0.0, 5.0, 0.0), (0.0, 0.0, 0.0)]
    for points in (list(circle(5, 400)), list(spiral(5, 60, 3)), square):
        slow, fast = Survey(), Survey()
        for survey, at in ((slow, feed), (fast, feed * 1.5)):
            for block in planned(straights(points, at)):
                survey.add(block)
        assert slow.planned >= slow.asked * 0.999
        # Where blocks end is found by estimates: what that costs may differ a little.
        assert slow.planned >= fast.planned * 0.98


# ------------------------------------------------------------------------ the line


def test_a_feed_comes_down_to_what_the_line_carries_and_that_is_said() -> None:
    points = list(circle(3, 400))[:60]
    free = planned(straights(points, 60), join_steps=-1)
    held = planned(straights(points, 60), join_steps=-1, command_seconds=COMMAND_SECONDS * 4)
    assert sum(block.duration for block in held) > sum(block.duration for block in free)
    told = [block for block in held if block.lowered_by]
    assert told
    for block in told:
        assert block.lowered_by == "the line carries 23 commands a second"
        assert 0 < block.lowered < 1


def test_a_line_that_is_over_before_its_commands_are_sent_is_run_slower() -> None:
    (free,) = planned([Straight((0.1, 0.07, 0.05), 60)])
    (held,) = planned([Straight((0.1, 0.07, 0.05), 60)], command_seconds=COMMAND_SECONDS * 10)
    assert held.duration >= (len(held.runs) + 2) * COMMAND_SECONDS * 10 * TICKS
    assert held.lowered == pytest.approx(1 - free.duration / held.duration)
    assert held.lowered_by == "the line carries 9 commands a second"


def test_a_feed_beyond_an_axis_is_lowered_and_that_is_said() -> None:
    (block,) = planned([Straight((10.0, 0.0, 0.0), 300)])
    assert rpms(block) == {0: 300}
    assert block.lowered == pytest.approx(0.5)
    assert block.lowered_by == "X turns at 300 RPM at most"


def test_a_feed_beyond_the_pulses_of_microsteps_is_lowered() -> None:
    # 52 us a pulse at 32 microsteps: 601 steps a second, 180 RPM.
    on = Machine((Axis("X", 10, 400, drive=Drive(ustep=5)),))
    (block,) = planned([Straight((10.0,), 300)], on)
    assert block.lowered_by == "X turns at 180 RPM at most"


def test_a_rapid_asks_for_no_feed_that_could_be_lowered() -> None:
    on = Machine(XYZ.axes, rapid=300)
    (block,) = planned([Straight((10.0, 0.0, 0.0), None)], on)
    assert rpms(block) == {0: 300}
    assert (block.lowered, block.lowered_by) == (0.0, "")


# ------------------------------------------------------------------------ streams


def endless(chords: int = 200) -> Iterator[Straight]:
    """A path without an end."""
    line = 0
    while True:
        for point in circle(3, chords):
            line += 1
            yield Straight(point, 30, line)


def test_blocks_come_while_the_path_is_being_read() -> None:
    read = 0

    def counted() -> Iterator[Straight]:
        nonlocal read
        for item in endless():
            read += 1
            yield item

    first = next(plan_path(counted(), XYZ, command_seconds=0.0))
    # A window of 29 commands for each of three axes, of pieces of some items each.
    assert first.lines[1] <= read < 29 * 3 * 20


@pytest.mark.slow
def test_a_long_path_is_let_go_of_as_it_is_planned() -> None:
    parts = (Straight, Piece, Stretch, Corner, Block)
    held = []
    blocks = plan_path(endless(chords=4_000), XYZ, command_seconds=0.0, commands_max=6)
    for _ in range(3):
        last = [block.lines[1] for block in islice(blocks, 12)][-1]
        gc.collect()
        held.append((last, sum(isinstance(one, parts) for one in gc.get_objects())))
    (_, _), (before, few), (after, no_more) = held
    assert after - before > 500
    assert no_more < few + 60


def test_queues_of_two_commands_make_no_line() -> None:
    with pytest.raises(ValueError, match="a line takes 3 commands of an axis, got room for 2"):
        planned([], commands_max=2)


@pytest.mark.slow
@given(st.tuples(*(st.floats(-30, 30) for _ in range(3))), st.floats(1, 200))
def test_no_line_takes_more_than_three_commands_of_an_axis_if_it_must(
    to: tuple[float, float, float], feed: float
) -> None:
    for block in planned([Straight(to, feed)], commands_max=3):
        assert all(len(run.motions) <= 3 for run in block.runs)


def test_an_item_that_makes_no_sense_is_refused_when_it_is_reached() -> None:
    blocks = plan_path(
        [Straight((5.0, 0.0, 0.0), 30, 1), Halt("M0", line=2), Straight((1.0,), 30, 3)],
        XYZ,
        command_seconds=0.0,
    )
    with pytest.raises(ValueError, match="line 3"):
        list(blocks)
