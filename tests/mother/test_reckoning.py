"""When a block is over for certain, and how long all stood still before the next."""

from __future__ import annotations

from sacbus.kernel import MS, SECOND
from sacbus.mother import Streamed
from sacbus.mother.reckoning import Reckoning
from tests.mother.blocks import block


def test_a_node_may_be_slow_by_its_drift_and_a_margin() -> None:
    assert Reckoning(500, 2 * MS).lasts(2_000_000) == SECOND + SECOND // 2000 + 2 * MS
    # However long it is: no float has so many digits.
    assert Reckoning(0, 0).lasts(10**17 + 1) == 500 * (10**17 + 1)


def test_a_block_without_motion_is_over_at_once_and_a_pause_later() -> None:
    reckoning = Reckoning()
    reckoning.released(7, block({}))
    assert reckoning.over == 7
    reckoning.pause(SECOND)
    assert reckoning.over == 7 + SECOND


def test_what_all_stand_still_beyond_the_plan_is_counted_and_when_nothing_was_ready() -> None:
    moved = block({0: [(100, 3000)]})
    reckoning, streamed = Reckoning(0, 2 * MS), Streamed()
    reckoning.count_wait(5 * SECOND, streamed)  # before the first block nobody waits
    assert (streamed.barriers, streamed.late) == (0, 0)
    streamed.blocks = 1
    reckoning.released(0, moved)
    planned = moved.duration * 500
    assert reckoning.over == planned + 2 * MS
    reckoning.count_wait(reckoning.over + 4 * MS, streamed)
    assert (streamed.barriers, streamed.late) == (6 * MS, 0)
    reckoning.count_wait(reckoning.over + 5 * MS, streamed)
    assert (streamed.barriers, streamed.late, streamed.late_by) == (13 * MS, 1, 5 * MS)
