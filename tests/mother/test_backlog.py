"""What of a plan is taken, and which command is written next."""

from __future__ import annotations

import pytest

from sacbus.mother.backlog import Backlog
from sacbus.mother.lane import Lane
from tests.mother.blocks import block, machine


def lanes() -> list[Lane]:
    return [Lane(index, axis) for index, axis in enumerate(machine(10, 11).axes)]


def test_first_commands_are_written_before_all_others_and_those_by_when_they_are_due() -> None:
    plan = [block({0: [(10, 3000), (10, 3000)], 1: [(4, 3000)] * 3}), block({1: [(5, 3000)]})]
    backlog = Backlog(lanes(), plan)
    while backlog.take():
        pass
    order = []
    while (lane := backlog.first(0)) is not None:
        passage, position, lines = backlog.write(lane)
        assert lines[0].startswith(f"q{position}")
        passage.written(lane.index, position)
        order.append((backlog.passages.index(passage), lane.index, position))
    assert order == [(0, 0, 1), (0, 1, 1), (0, 1, 2), (0, 1, 3), (0, 0, 2), (1, 1, 4)]
    assert [passage.left for passage in backlog.passages] == [0, 0]
    assert [passage.firsts for passage in backlog.passages] == [{0: 1, 1: 1}, {1: 4}]


def test_a_lane_without_room_is_not_written_into() -> None:
    queues = lanes()
    backlog = Backlog(queues, [block({0: [(1, 3000)] * 16}), block({0: [(1, 3000)] * 16})])
    while backlog.take():
        pass
    for _ in range(30):
        assert backlog.first(0) is queues[0]
        backlog.write(queues[0])
    assert backlog.first(0) is None
    assert backlog.has(queues[0])
    assert not backlog.has(queues[1])


def test_a_plan_that_has_ended_is_not_asked_again() -> None:
    backlog = Backlog(lanes(), iter([block({0: [(1, 3000)]})]))
    assert [backlog.take(), backlog.take(), backlog.take()] == [True, False, False]


def test_a_block_that_no_queue_holds_is_refused_and_not_taken() -> None:
    backlog = Backlog(lanes(), [block({0: [(1, 3000)] * 30}, lines=(3, 4))])
    with pytest.raises(ValueError, match=r"block of lines \(3, 4\): expected at most 29 commands"):
        backlog.take()
    assert not backlog.passages
