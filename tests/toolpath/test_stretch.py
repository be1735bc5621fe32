"""Stretches: positions in full steps, and what axes can bear along them."""

from __future__ import annotations

import pytest
from hypothesis import given

from sacbus.motion import Drive
from sacbus.toolpath import Axis, Machine, PathItem, Straight
from sacbus.toolpath.piece import pieces
from sacbus.toolpath.stretch import Stretch, stretches
from tests.toolpath.paths import XYZ, destination, machine, straights, wanderings


def cut(items: list[PathItem], on: Machine = XYZ) -> list[Stretch]:
    found = stretches(pieces(items, on, -1), on)
    return [one for one in found if isinstance(one, Stretch)]


@pytest.mark.slow
@given(wanderings())
def test_steps_add_up_to_the_rounded_end_of_any_path(items: list[PathItem]) -> None:
    found = cut(items)
    sums = tuple(sum(stretch.steps[axis] for stretch in found) for axis in range(3))
    assert sums == destination(items)
    assert all(any(stretch.steps) for stretch in found)


def test_a_tenth_of_a_step_a_thousand_times_is_a_hundred_steps() -> None:
    found = cut(list(straights((i / 4000, 0, 0) for i in range(1, 1001))))
    assert sum(stretch.steps[0] for stretch in found) == 100
    assert {stretch.steps[0] for stretch in found} == {1}


def test_what_moves_no_axis_by_a_step_is_taken_into_the_next() -> None:
    (stretch,) = cut(list(straights([(0.001, 0, 0), (0.001, 0.001, 0), (1, 0, 0)])))
    assert stretch.steps == (400, 0, 0)
    assert stretch.lines == (1, 3)
    assert stretch.length == pytest.approx(0.001 + 0.001 + 0.999, rel=1e-5)
    # Where it led to is kept for whoever asks how far the tool was from its path.
    assert stretch.way == ((0.001, 0.001, 0.0), (1.0, 0.0, 0.0))


def test_rates_are_the_turns_of_each_axis_along_the_path() -> None:
    on = machine(400, 200)
    (stretch,) = cut([Straight((3.0, -4.0), 60)], on)
    # 1 mm/s: 0.6 mm/s x 400 steps = 240 steps/s = 72 RPM at 200 steps a revolution.
    assert stretch.rates == pytest.approx((72, -48))
    assert stretch.feed == 1.0


def test_a_rapid_goes_at_the_rapid_rate_of_the_machine() -> None:
    (stretch,) = cut([Straight((1.0, 0.0, 0.0), None)])
    assert stretch.rapid
    assert stretch.feed == 45 / 60


def test_the_slowest_axis_sets_the_limit() -> None:
    on = Machine((Axis("X", 10, 400, max_rpm=300), Axis("Y", 11, 400, max_rpm=60)))
    (stretch,) = cut([Straight((10.0, 10.0), 60)], on)
    assert stretch.limit * stretch.rates[1] == pytest.approx(60)


def test_the_start_is_what_the_most_delicate_axis_jumps_to() -> None:
    on = Machine((Axis("X", 10, 400), Axis("Y", 11, 400, jump_rpm=3)))
    (stretch,) = cut([Straight((10.0, 10.0), 60)], on)
    assert stretch.start * stretch.rates[1] == pytest.approx(3)


@pytest.mark.parametrize(
    ("limits", "to", "expected"),
    [
        # The machine's 50 rad/s2 are those of the axis with most steps.
        ((None, None), (10.0, 5.0), (50, 25)),
        ((None, None), (5.0, 10.0), (25, 50)),
        # An axis's own limit holds it back ...
        ((20.0, None), (10.0, 5.0), (20, 10)),
        ((None, 10.0), (10.0, 5.0), (20, 10)),
        # ... and one beyond the machine's does not drive it on.
        ((90.0, 90.0), (10.0, 5.0), (50, 25)),
    ],
)
def test_acceleration_is_shared_out_by_the_ways_of_the_axes(
    limits: tuple[float | None, float | None],
    to: tuple[float, float],
    expected: tuple[float, float],
) -> None:
    x, y = (
        Axis(name, 10, 400, max_acceleration=limit)
        for name, limit in zip("XY", limits, strict=True)
    )
    (stretch,) = cut([Straight(to, 60)], Machine((x, y), acceleration=50))
    radians = [2 * 3.14159265 * rate / 60 * stretch.acceleration for rate in stretch.rates]
    assert radians == pytest.approx(expected)


def test_an_axis_of_more_steps_a_revolution_turns_less_for_the_same_way() -> None:
    on = Machine((Axis("X", 10, 400), Axis("Y", 11, 400, drive=Drive(sprf=400))))
    (stretch,) = cut([Straight((1.0, 1.0), 60)], on)
    assert stretch.rates[0] == pytest.approx(2 * stretch.rates[1])


def test_an_axis_that_is_said_to_bear_no_jump_is_got_going_at_one_rpm() -> None:
    on = Machine((Axis("X", 10, 400, jump_rpm=0),))
    (stretch,) = cut([Straight((1.0,), 60)], on)
    assert stretch.start * stretch.rates[0] == pytest.approx(1)
