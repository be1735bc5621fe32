"""Loops over the queue and the xRef array: which position comes next."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac.loop import Loop

positions = st.integers(1, 30)


def taken(loop: Loop, count: int) -> list[int | None]:
    """What comes next, so many times; a loop that is over gives None."""
    return [loop.take() for _ in range(count)]


def over_queue(start: int, finish: int, count: int = 0) -> Loop:
    loop = Loop()
    loop.count_to(count)
    assert loop.start_at(start)
    assert loop.finish_at(finish)
    return loop


def over_references(*entries: int, count: int = 0) -> Loop:
    loop = Loop()
    for index, position in enumerate(entries):
        loop.refer(index, position)
    assert loop.run_references(count)
    return loop


# ---- over the queue -----------------------------------------------------------------------------


@pytest.mark.parametrize("start_first", [True, False])
def test_a_loop_runs_once_both_its_ends_are_set_in_either_order(start_first: bool) -> None:
    loop = Loop()
    assert loop.start_at(3) if start_first else loop.finish_at(5)
    assert loop.set
    assert taken(loop, 1) == [None]
    loop.end()
    assert loop.start_at(3) if start_first else loop.finish_at(5)
    assert loop.finish_at(5) if start_first else loop.start_at(3)
    assert taken(loop, 7) == [3, 4, 5, 3, 4, 5, 3]


def test_a_finish_below_the_start_goes_round() -> None:
    assert taken(over_queue(29, 2), 6) == [29, 30, 1, 2, 29, 30]


def test_the_whole_queue_is_any_start_with_the_finish_one_before() -> None:
    loop = over_queue(7, 6)
    assert taken(loop, 31) == [*range(7, 31), *range(1, 7), 7]


def test_the_ends_must_differ_and_what_was_set_stays() -> None:
    loop = Loop()
    assert loop.start_at(4)
    assert not loop.finish_at(4)
    assert not loop.running
    assert loop.finish_at(5)
    assert not loop.start_at(5)
    assert taken(loop, 3) == [4, 5, 4]


@pytest.mark.parametrize("count", [1, 2, 65_535])
def test_a_counted_loop_runs_so_often_and_all_is_clear_then(count: int) -> None:
    loop = over_queue(1, 2, count)
    assert taken(loop, 2 * count + 1) == [1, 2] * count + [None]
    assert not loop.running
    assert not loop.set
    # The count is clear too: the next one goes on for ever.
    loop.start_at(1)
    loop.finish_at(2)
    assert taken(loop, 2 * count + 4)[-1] == 2


def test_new_ends_count_from_the_end_of_the_present_command() -> None:
    loop = over_queue(1, 5)
    assert taken(loop, 3) == [1, 2, 3]
    loop.finish_at(4)
    loop.start_at(10)
    assert taken(loop, 3) == [4, 10, 11]


def test_a_finish_that_has_been_passed_is_reached_the_long_way() -> None:
    loop = over_queue(1, 5)
    taken(loop, 3)
    loop.finish_at(2)
    assert taken(loop, 31) == [*range(4, 31), 1, 2, 1, 2]


def test_a_new_count_counts_the_iterations_that_are_done() -> None:
    loop = over_queue(1, 2)
    taken(loop, 5)
    loop.count_to(3)
    assert taken(loop, 2) == [2, None]
    loop = over_queue(1, 2, 100)
    taken(loop, 5)
    loop.count_to(1)
    assert taken(loop, 2) == [2, None]


def test_a_loop_of_one_position_is_autoruns_alone() -> None:
    loop = Loop()
    loop.run(1, 1)
    assert taken(loop, 3) == [1, 1, 1]


def test_what_did_not_run_is_next_again_and_counts_no_iteration() -> None:
    loop = over_queue(29, 2, 2)
    for _ in range(8):
        first = loop.take()
        loop.again()
        assert loop.take() == first
    assert loop.take() is None


@given(positions, positions, st.integers(1, 5), st.integers(0, 60))
def test_one_more_is_the_next_one_and_then_it_is_over(
    start: int, finish: int, count: int, before: int
) -> None:
    if start == finish:
        return
    loop, twin = over_queue(start, finish, count), over_queue(start, finish, count)
    taken(loop, before)
    taken(twin, before)
    loop.only_one_more()
    following = twin.take()
    if following is None:
        assert not loop.running
    else:
        assert loop.take() == following
        loop.again()
        assert loop.take() == following
    assert loop.take() is None


# ---- over the xRef array ------------------------------------------------------------------------


def test_the_manuals_array_runs_in_its_order_and_from_the_start_again() -> None:
    # Manual, "xRef": x_ 0 1, x_ 1 3, x_ 2 7, x_ 3 5, x_ 4 0.
    assert taken(over_references(1, 3, 7, 5, 0), 6) == [1, 3, 7, 5, 1, 3]


def test_it_runs_so_many_times() -> None:
    assert taken(over_references(1, 3, 0, count=2), 5) == [1, 3, 1, 3, None]


def test_what_stands_behind_the_end_does_not_count() -> None:
    assert taken(over_references(1, 0, 7), 3) == [1, 1, 1]


@pytest.mark.parametrize("entries", [(), (1, 2), (0, 1, 0)])
def test_an_array_that_is_empty_or_has_no_end_does_not_run(entries: tuple[int, ...]) -> None:
    loop = Loop()
    for index, position in enumerate(entries):
        loop.refer(index, position)
    assert not loop.run_references(3)
    assert not loop.running


def test_all_31_places_can_be_used() -> None:
    loop = over_references(*range(1, 31), 0)
    assert taken(loop, 31) == [*range(1, 31), 1]


def test_a_gap_in_the_array_is_an_end() -> None:
    loop = Loop()
    loop.refer(2, 9)
    assert loop.references == (0, 0, 9)
    loop.refer(0, 4)
    assert loop.run_references(0)
    assert taken(loop, 2) == [4, 4]


def test_an_array_that_is_changed_while_it_runs_counts_as_it_is() -> None:
    loop = over_references(1, 2, 3, 0)
    assert taken(loop, 2) == [1, 2]
    loop.refer(2, 0)
    assert taken(loop, 2) == [1, 2]
    loop.refer(0, 0)
    assert taken(loop, 1) == [None]


def test_one_kind_of_loop_takes_the_place_of_the_other() -> None:
    loop = over_queue(1, 3)
    taken(loop, 2)
    loop.refer(0, 8)
    loop.refer(1, 0)
    assert loop.run_references(1)
    assert taken(loop, 2) == [8, None]
    loop = over_references(8, 0)
    taken(loop, 1)
    loop.run(4, 5)
    assert taken(loop, 3) == [4, 5, 4]


def test_the_array_outlives_the_loop() -> None:
    loop = over_references(8, 0, count=1)
    taken(loop, 2)
    assert loop.references == (8, 0)
    assert loop.run_references(0)
    assert taken(loop, 1) == [8]
