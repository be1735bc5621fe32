"""Encoding: the rules on every edge, no step lost, and the same as one step after the other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.simad import (
    DelayTooLong,
    Edges,
    Encoder,
    Encoding,
    SimadError,
    Steps,
    Timing,
    decode,
    encode,
    merge,
)
from sacbus.simad import encoder as encoder_file
from sacbus.simad.edges import joined_edges
from tests.simad.reference import Due, as_tuples, broken_rules, driven, slow_encode
from tests.simad.strategies import streams, timings

#: More than any stream of the tests needs.
ANY = 1 << 40


def stream(steps: list[Due]) -> Steps:
    times, axes, ways = zip(*steps, strict=True) if steps else ((), (), ())
    return Steps.of(list(times), list(axes), list(ways))


def encoded(steps: list[Due], timing: Timing | None = None, axes: int = 5) -> Encoding:
    return encode(stream(steps), axes, timing or Timing(), ANY)


@pytest.mark.slow
@settings(max_examples=1_000)
@given(streams(), timings())
def test_it_is_what_one_step_after_the_other_gives(steps: list[Due], timing: Timing) -> None:
    fast = encoded(steps, timing)
    slow = slow_encode(steps, timing)
    assert fast.falls.tolist() == slow.falls
    assert as_tuples(fast.edges) == slow.edges
    assert fast.report.dir_changes == slow.turns
    if steps:
        assert fast.edges.direction == slow.direction


@pytest.mark.slow
@settings(max_examples=100)
@given(streams(), timings())
def test_every_edge_keeps_the_rules_and_no_step_is_lost(steps: list[Due], timing: Timing) -> None:
    fast = encoded(steps, timing)
    edges = as_tuples(fast.edges)
    assert broken_rules(edges, timing) == []
    made = driven(edges, fast.edges.direction)
    for axis in range(5):
        assert [way for _, which, way in made if which == axis] == [
            way for _, which, way in steps if which == axis
        ]
    fallen = list(zip(fast.falls.tolist(), [one[1:] for one in steps], strict=True))
    assert sorted(made) == sorted((when, *what) for when, what in fallen)


@pytest.mark.slow
@settings(max_examples=100)
@given(streams(), timings())
def test_what_is_told_of_delays_is_true(steps: list[Due], timing: Timing) -> None:
    fast = encoded(steps, timing)
    late = fast.falls - np.array([one[0] for one in steps], dtype=np.int64)
    assert (late >= 0).all()
    for axis, told in enumerate(fast.report.axes):
        mine = [one for one, step in zip(late.tolist(), steps, strict=True) if step[1] == axis]
        assert told.steps == len(mine)
        assert told.moved == sum(one > 0 for one in mine)
        assert told.delay_max == max(mine, default=0)
        assert told.delay_mean == sum(mine) / max(len(mine), 1)
        mean_square = sum(one * one for one in mine) / max(len(mine), 1)
        assert told.delay_rms == pytest.approx(mean_square**0.5)
        assert told.position == sum(way for _, which, way in steps if which == axis)


@pytest.mark.slow
@settings(max_examples=100)
@given(streams(), timings(), st.data())
def test_pieces_make_no_difference(steps: list[Due], timing: Timing, data: st.DataObject) -> None:
    whole = encoded(steps, timing)
    pieces = sorted(data.draw(st.lists(st.integers(0, len(steps)), max_size=8)))
    encoder = Encoder(5, timing, ANY)
    parts = []
    for begin, end in zip([0, *pieces], [*pieces, len(steps)], strict=True):
        parts.append(encoder.take(stream(steps[begin:end])))
    parts.append(encoder.close())
    edges = joined_edges([part.edges for part in parts])
    assert as_tuples(edges) == as_tuples(whole.edges)
    assert np.concatenate([part.falls for part in parts]).tolist() == whole.falls.tolist()
    assert encoder.report == whole.report


@pytest.mark.slow
@settings(max_examples=100)
@given(streams(), timings(), st.integers(1, 7))
def test_neither_do_the_pieces_that_it_works_in(
    steps: list[Due], timing: Timing, piece: int
) -> None:
    whole = encoded(steps, timing)
    usual = encoder_file.PIECE
    encoder_file.PIECE = piece  # type: ignore[misc]  # a small one, so that there are many
    try:
        many = encoded(steps, timing)
    finally:
        encoder_file.PIECE = usual  # type: ignore[misc]
    assert as_tuples(many.edges) == as_tuples(whole.edges)
    assert many.falls.tolist() == whole.falls.tolist()
    assert many.report == whole.report


@pytest.mark.slow
@settings(max_examples=100)
@given(streams())
def test_decoding_gives_the_steps_again(steps: list[Due]) -> None:
    fast = encoded(steps)
    again = decode(fast.edges)
    given_steps = stream(steps)
    for axis in range(5):
        times, ways = again.of_axis(axis)
        mine = given_steps.axes == axis
        assert ways.tolist() == given_steps.directions[mine].tolist()
        assert times.tolist() == fast.falls[mine].tolist()


# ---- the rules one by one ----


def falls(steps: list[Due], timing: Timing | None = None) -> list[int]:
    return [int(one) for one in encoded(steps, timing).falls]


def test_steps_of_one_direction_fall_together() -> None:
    assert falls([(10_000, 0, 1), (10_000, 1, 1), (10_000, 2, 1)]) == [10_000] * 3


def test_one_of_the_other_direction_waits_for_dir() -> None:
    coded = encoded([(10_000, 0, 1), (10_000, 1, -1)])
    # DIR turns as the step line rises again, and is set up 4 us later.
    assert as_tuples(coded.edges) == [
        (10_000, 1, 0),
        (10_500, 1, 1),
        (10_500, 0, 0),
        (14_500, 2, 0),
        (15_000, 2, 1),
    ]
    assert coded.edges.direction == 1


def test_dir_is_set_for_the_next_step_right_after_the_present_one() -> None:
    coded = encoded([(10_000, 0, 1), (1_000_000, 1, -1)])
    times, levels = coded.edges.of_line(0)
    assert (times.tolist(), levels.tolist()) == ([10_500], [0])
    assert coded.falls.tolist() == [10_000, 1_000_000]
    assert coded.report.moved == 0


def test_before_the_first_step_dir_is_set_for_it() -> None:
    coded = encoded([(0, 3, -1)])
    assert coded.edges.direction == 0
    assert as_tuples(coded.edges) == [(0, 4, 0), (500, 4, 1)]


def test_an_axis_waits_for_its_own_line() -> None:
    assert falls([(0, 0, 1), (1_000, 0, 1), (2_000, 1, 1)]) == [0, 4_500, 2_000]


def test_of_one_instant_those_that_dir_fits_are_first_and_then_the_axes_decide() -> None:
    # DIR is counter-clockwise: axes 1 and 3 do not wait for axes 0 and 2.
    steps = [(0, 4, -1), (50_000, 0, 1), (50_000, 1, -1), (50_000, 2, 1), (50_000, 3, -1)]
    assert falls(steps) == [0, 54_500, 50_000, 54_500, 50_000]
    # At the beginning it is as the first axis has it.
    assert falls([(0, 1, -1), (0, 0, 1), (0, 2, -1)]) == [4_500, 0, 4_500]


def test_steps_of_one_axis_never_change_their_order() -> None:
    # Single pulses of one instant, one way and the other: axis 1 goes with the second of axis 0.
    steps = [(0, 0, 1), (0, 0, -1), (0, 0, 1), (0, 1, -1)]
    assert falls(steps) == [0, 4_500, 9_000, 4_500]


def test_a_stretch_that_is_over_is_not_begun_again() -> None:
    # Clockwise, the other way, and clockwise again within 2 us: the third follows the second.
    assert falls([(0, 0, 1), (1_000, 1, -1), (2_000, 2, 1)]) == [0, 4_500, 9_000]


def test_with_a_long_hold_time_dir_stays_after_the_step_line_is_high() -> None:
    coded = encoded([(0, 0, 1), (0, 1, -1)], Timing(hold=3_000))
    assert as_tuples(coded.edges)[1:4] == [(500, 1, 1), (3_000, 0, 0), (7_000, 2, 0)]


def test_a_period_longer_than_a_turn_is_kept_across_turns() -> None:
    slow = Timing(low=1_000, high=20_000, setup=500, hold=0)
    assert falls([(0, 0, 1), (0, 1, -1), (1, 0, 1)], slow) == [0, 1_500, 21_000]


@pytest.mark.parametrize("timing", [Timing(), Timing(high=9_000)])
def test_long_jams_that_hang_on_one_another_are_exact(timing: Timing) -> None:
    # Every step waits for another axis and for its own by turns, too long for rounds.
    steps = [(100 * number, number % 3, -1 if number % 2 else 1) for number in range(400)]
    fast, slow = encoded(steps, timing), slow_encode(steps, timing)
    assert as_tuples(fast.edges) == slow.edges


# ---- what cannot be ----


def test_a_step_that_would_be_too_late_is_refused_with_axis_and_time() -> None:
    steps = stream([(1_000, 0, 1), (2_000, 1, -1), (3_000, 0, 1)])
    with pytest.raises(DelayTooLong) as refused:
        encode(steps, 2, max_delay=6_999, names=("X", "Y"))
    assert (refused.value.axis, refused.value.time, refused.value.delay) == ("X", 3_000, 7_000)
    assert "axis X at 3000 ns" in str(refused.value)
    assert encode(steps, 2, max_delay=7_000).report.axes[0].delay_max == 7_000


def test_unless_something_else_is_said_a_delay_is_a_millisecond_at_most() -> None:
    # 1 ms is 222 periods: of 224 steps at one instant the last is too late.
    fine = merge([np.zeros(223, dtype=np.int64)], [1])
    assert encode(fine, 1).report.axes[0].delay_max == 999_000
    with pytest.raises(DelayTooLong, match="axis 0 at 0 ns cannot fall before 1003500 ns"):
        encode(merge([np.zeros(224, dtype=np.int64)], [1]), 1)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: encode(stream([(0, 2, 1)]), 2), "expected axes 0 to 1, got 2"),
        (lambda: encode(stream([]), 0), "expected 1 to 255 axes, got 0"),
        (lambda: encode(stream([]), 1, max_delay=-1), "max_delay: expected 0 ns or more, got -1"),
        (lambda: encode(stream([]), 2, names=("X",)), "expected names of 2 axes, got 1"),
    ],
)
def test_what_cannot_be_is_refused(make: object, told: str) -> None:
    with pytest.raises(SimadError) as refused:
        make()  # type: ignore[operator]
    assert str(refused.value) == told


def test_steps_before_those_that_were_taken_are_refused() -> None:
    encoder = Encoder(1)
    encoder.take(stream([(5_000, 0, 1)]))
    with pytest.raises(SimadError, match="expected steps from 5000 ns on, got 4999 ns"):
        encoder.take(stream([(4_999, 0, 1)]))


def test_nothing_gives_nothing() -> None:
    coded = encode(stream([]), 3)
    assert isinstance(coded.edges, Edges)
    assert coded.edges.count == coded.falls.size == coded.report.steps == 0


def test_four_axes_take_five_lines_and_six_take_seven() -> None:
    reports = [encode(stream([]), axes).report for axes in (4, 6, 7)]
    assert [(one.lines, one.lines_without) for one in reports] == [(5, 8), (7, 12), (8, 14)]
