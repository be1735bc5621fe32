"""GAP and load times."""

from __future__ import annotations

from dataclasses import replace

from sacbus.motion import Drive, gap_passes, load_ticks, plan
from tests.motion.test_planner import command


def test_a_load_takes_16_microseconds_and_40_when_acceleration_changes() -> None:
    # manual, introduction: 16 us typically, 8 to 40 in all
    assert load_ticks(acceleration_changes=False) == 32
    assert load_ticks(acceleration_changes=True) == 80


def test_the_gap_is_one_period_of_the_last_pulse() -> None:
    profile = plan(command(500, 100, 1, 999), Drive())
    assert profile.last_period == 6000
    assert gap_passes(6000, profile.last_period)
    assert not gap_passes(6001, profile.last_period)


def test_with_microsteps_the_gap_is_a_pulse_and_not_a_step() -> None:
    fast = plan(command(5000, 1000, 100, 999), Drive(ustep=5))
    assert fast.last_period == 600 // 32
    assert not gap_passes(load_ticks(acceleration_changes=False), fast.last_period)


def test_a_cut_command_is_measured_by_its_present_pulse() -> None:
    profile = plan(command(500, 100, 1, 1), Drive())
    assert profile.cut(0).last_period == 60_000
    assert profile.halt(0).last_period == 60_000


def test_without_a_pulse_nothing_keeps_the_gap_open() -> None:
    assert plan(replace(command(1, 100), steps=0), Drive()).last_period == 0


def test_of_continuous_motion_the_cruise_counts() -> None:
    assert plan(command(None, 100), Drive()).last_period == 6000
