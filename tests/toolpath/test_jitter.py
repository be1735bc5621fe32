"""The minor axis's jitter: on a clock of its own, and tethered to the lead axis's."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.toolpath import Axis, Jitter, Machine, bresenham, plan_line, side_by_side
from tests.toolpath.lines import random_line

MACHINE = Machine((Axis("X", 10, 100.0), Axis("Y", 11, 100.0)))


@given(st.integers(0, 300), st.integers(1, 300))
def test_bresenham_makes_all_steps_none_far_from_the_line(steps: int, more: int) -> None:
    lead = steps + more
    stepped = bresenham(steps, lead)
    assert len(stepped) == steps
    for minor, at in enumerate(stepped, start=1):
        assert abs(minor - (at + 1) * steps / lead) <= 0.5


def test_bresenham_waits_every_sixth_time_on_the_manuals_move() -> None:
    skipped = sorted(set(range(240)) - set(bresenham(200, 240)))
    assert [after - before for before, after in pairwise(skipped)] == [6] * 39


def test_jitter_is_measured_against_the_mean_period() -> None:
    assert Jitter.of([0, 10, 20, 30]) == (0, 0)
    assert Jitter.of([0, 5, 20]) == pytest.approx((0.5, 0.5))


def test_the_manuals_move_is_even_by_two_clocks_and_skips_a_beat_by_one() -> None:
    # Manual, Figures 1 and 2: a transit of (240, 200).
    found = side_by_side(MACHINE, plan_line(MACHINE, (240, 200), 600))
    assert found is not None
    assert (found.minor, found.lead) == ("Y", "X")
    assert found.own.most < 0.02
    # Five periods of one step and one of two: 5/6 and 5/3 of the mean.
    assert found.tethered.most == pytest.approx(2 / 3, abs=0.02)
    assert found.tethered.std == pytest.approx(0.33, abs=0.03)


@pytest.mark.slow
def test_of_random_lines_hardly_any_is_more_even_by_bresenham() -> None:
    own, tethered = [], []
    for seed in range(40):
        machine, steps, feed = random_line(Random(seed))
        found = side_by_side(machine, plan_line(machine, steps, feed))
        if found is not None:
            own.append(found.own.std)
            tethered.append(found.tethered.std)
    assert len(own) > 15
    assert sorted(own)[len(own) // 2] < 1e-3
    assert sum(own) < sum(tethered) / 3


def test_where_there_is_nothing_to_compare_it_says_nothing() -> None:
    assert side_by_side(MACHINE, plan_line(MACHINE, (240, 0), 600)) is None
    assert side_by_side(MACHINE, plan_line(MACHINE, (240, 9), 600)) is None
