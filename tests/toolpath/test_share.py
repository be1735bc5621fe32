"""An axis's share of a law: sweeps, places and times."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.toolpath import Law, Phase
from sacbus.toolpath.line import line_law
from sacbus.toolpath.share import Sweep, sweeps

SECOND = 2_000_000


def even(*seconds: float) -> Law:
    return tuple(Phase(at, 0.0, 1.0, time, 1.0, 1.0) for at, time in enumerate(seconds))


def trapezoid() -> Sweep:
    """100 steps: 2 s up to 20 steps/s, 3 s at it, 2 s down."""
    (sweep,) = sweeps([100], line_law(10.0, 2.0, 1.0))
    return sweep


def test_a_line_is_one_sweep_with_the_laws_velocities_in_steps() -> None:
    sweep = trapezoid()
    assert (sweep.forward, sweep.steps, sweep.end) == (True, 100, 7 * SECOND)
    up, level, down = sweep.parts
    assert [part.way for part in sweep.parts] == pytest.approx([20, 60, 20])
    assert up.v1 * SECOND == pytest.approx(20)
    assert level.v0 == level.v1 == pytest.approx(up.v1)
    assert down.acceleration == pytest.approx(-up.acceleration)


def test_places_and_times() -> None:
    sweep = trapezoid()
    for seconds, place in ((0, 0), (1, 5), (2, 20), (3.5, 50), (5, 80), (6, 95), (7, 100)):
        assert sweep.at(seconds * SECOND) == pytest.approx(place)
        assert sweep.time(place) == pytest.approx(seconds * SECOND)


@given(st.floats(0, 100))
def test_time_is_the_inverse_of_place(place: float) -> None:
    sweep = trapezoid()
    assert sweep.at(sweep.time(place)) == pytest.approx(place, abs=1e-6)


def test_before_and_behind_its_velocity_goes_on() -> None:
    (sweep,) = sweeps([10], even(1.0))
    assert sweep.at(-SECOND) == pytest.approx(-10)
    assert sweep.at(2 * SECOND) == pytest.approx(20)
    assert sweep.time(-10) == pytest.approx(-SECOND)
    assert sweep.time(20) == pytest.approx(2 * SECOND)
    assert trapezoid().time(-1) == 0
    assert trapezoid().time(101) == 7 * SECOND


def test_where_an_axis_turns_or_stands_still_a_sweep_ends() -> None:
    found = sweeps([10, 20, 0, 5, -7, 0, -3], even(1, 1, 1, 1, 1, 1, 1))
    assert [(sweep.forward, sweep.steps) for sweep in found] == [
        (True, 30),
        (True, 5),
        (False, 7),
        (False, 3),
    ]
    assert [sweep.parts[0].begin / SECOND for sweep in found] == [0, 3, 4, 6]
    assert [part.place for part in found[0].parts] == [0, 10]


def test_an_axis_that_never_moves_has_none() -> None:
    assert sweeps([0, 0], even(1, 1)) == ()


def test_where_the_motion_changes_it_is_looked_at() -> None:
    sweep = trapezoid()
    assert list(sweep.between(30, 60)) == []
    assert list(sweep.between(0.5, 50)) == pytest.approx([5.375, 10.25, 20])
    assert list(sweep.between(90, 100)) == pytest.approx([92.5, 95])
