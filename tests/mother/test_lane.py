"""A lane knows which positions of its node's queue may be written over, and what stands in them."""

from __future__ import annotations

import pytest

from sacbus.kernel import MS
from sacbus.mother.lane import Lane
from sacbus.toolpath import Axis
from tests.mother.blocks import run


@pytest.fixture
def lane() -> Lane:
    return Lane(0, Axis("X", 10, 100.0))


def test_thirty_commands_have_room_and_no_more_before_a_release(lane: Lane) -> None:
    (motion, *_) = run(0, [(5, 3000)]).motions
    positions = []
    while lane.room_at(0) == 0:
        position, _ = lane.write(motion)
        positions.append(position)
    assert positions == list(range(1, 31))
    assert lane.room_at(0) is None
    assert lane.deepest == 30


def test_a_position_is_free_when_its_command_is_loaded_for_certain(lane: Lane) -> None:
    first, second = run(0, [(5, 3000), (6, 3000)]).motions
    for _ in range(15):
        lane.write(first)
        lane.write(second)
    lane.release([10 * MS, 25 * MS], over=40 * MS)
    assert (lane.room_at(0), lane.written, lane.over) == (10 * MS, 28, 40 * MS)
    assert lane.room_at(10 * MS) == 10 * MS
    assert lane.write(first)[0] == 1
    assert lane.room_at(10 * MS) == 25 * MS


def test_only_the_first_time_round_every_field_is_named(lane: Lane) -> None:
    motions = run(0, [(5, 3000)] + [(7, 3500)] * 30).motions
    lines = [lane.write(motion)[1] for motion in motions[:30]]
    assert lines[0] == ["q1m5v100a999d999l1u0t0fs"]
    assert lines[29] == ["q30m7vc3500a999d999l1u0t0fs0"]
    lane.release([0] * 30, over=0)
    assert lane.room_at(0) == 0
    assert lane.write(motions[30])[1] == ["q1m7vc3500s0"]
    assert lane.write(motions[30])[1] == []


def test_a_bar_is_remembered_and_taken_away_by_what_comes_there(lane: Lane) -> None:
    motions = run(0, [(5, 3000)] * 31).motions
    for motion in motions[:30]:
        lane.write(motion)
    lane.release([0] * 30, over=0)
    lane.room_at(0)
    lane.write(motions[0])
    barred = [lane.barred]
    assert lane.bar() == "q2s"
    barred.append(lane.barred)
    assert lane.write(motions[1])[1] == ["q2s0"]
    assert [*barred, lane.barred] == [False, True, False]


@pytest.mark.parametrize(
    ("position", "lines"), [(1, ("ls1", "lf30")), (2, ("ls2", "lf1")), (30, ("ls30", "lf29"))]
)
def test_the_loop_goes_over_all_positions(
    lane: Lane, position: int, lines: tuple[str, str]
) -> None:
    assert lane.loop_from(position) == lines
