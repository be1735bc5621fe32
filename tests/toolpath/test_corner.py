"""Corners: no axis changes its velocity by more than its jump."""

from __future__ import annotations

from math import cos, inf, radians, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sacbus.toolpath import Axis, Machine, Straight
from sacbus.toolpath.corner import Corner, corner_of
from sacbus.toolpath.piece import pieces
from sacbus.toolpath.stretch import Stretch, stretches
from tests.toolpath.paths import machine

XY = machine(400, 400)
WAYS = st.tuples(st.floats(-5, 5), st.floats(-5, 5)).filter(lambda way: max(map(abs, way)) > 0.01)


def bend(
    first: tuple[float, float], second: tuple[float, float], on: Machine = XY
) -> tuple[Stretch, Stretch, Corner]:
    """Two stretches, each given by its way, and the corner between them."""
    there = (first[0] + second[0], first[1] + second[1])
    path = [Straight(first, 60), Straight(there, 60)]
    found = [one for one in stretches(pieces(path, on, -1), on) if isinstance(one, Stretch)]
    return found[0], found[1], corner_of(on.axes, found[0], found[1])


def changes(first: Stretch, before: float, second: Stretch, after: float) -> list[float]:
    """By how many RPM each axis changes its velocity."""
    return [
        abs(before * rate - after * then)
        for rate, then in zip(first.rates, second.rates, strict=True)
    ]


def test_a_straight_line_is_no_corner() -> None:
    _, _, corner = bend((5, 5), (3, 3))
    assert corner.through > 1e6
    assert corner.before == corner.after == inf


def test_a_right_angle_is_passed_as_fast_as_an_axis_starts() -> None:
    first, second, corner = bend((5, 0), (0, 5))
    assert corner.through == pytest.approx(first.start)
    assert corner.before == pytest.approx(first.start)
    assert corner.after == pytest.approx(second.start)


def test_an_axis_that_turns_round_has_half_its_jump_before_and_after() -> None:
    first, _, corner = bend((5, 0), (-5, 0))
    assert corner.before == corner.after == pytest.approx(first.start / 2)


def test_the_axis_with_the_smaller_jump_decides() -> None:
    on = Machine((Axis("X", 10, 400, jump_rpm=20), Axis("Y", 11, 400, jump_rpm=5)))
    angle = radians(10)
    first, second, corner = bend((50, 0), (50 * cos(angle), 50 * sin(angle)), on)
    x, y = changes(first, corner.through, second, corner.through)
    assert y == pytest.approx(5)
    assert x < 20


@pytest.mark.slow
@given(WAYS, WAYS)
def test_at_the_velocity_through_a_corner_one_axis_changes_by_its_jump_and_none_by_more(
    way: tuple[float, float], then: tuple[float, float]
) -> None:
    first, second, corner = bend(way, then)
    assume(corner.through < 1e6)
    assert max(changes(first, corner.through, second, corner.through)) == pytest.approx(10)


@given(WAYS, WAYS, st.floats(0, 1))
def test_no_axis_changes_by_more_than_its_jump_at_any_velocities_that_the_rules_allow(
    way: tuple[float, float], then: tuple[float, float], part: float
) -> None:
    first, second, corner = bend(way, then)
    before = part * min(corner.before, 1e3)
    after = min(corner.leaves(before), 1e3)
    before = min(before, corner.reaches(after))
    after = min(after, corner.leaves(before))
    assert max(changes(first, before, second, after)) <= 10 * (1 + 1e-6)
