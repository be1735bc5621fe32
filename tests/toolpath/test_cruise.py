"""Stretches of constant velocity: the time asked for, and even on the way."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.motion import Drive
from sacbus.toolpath.cruise import Even, cycle_least, split, step_ticks

drives = st.builds(
    Drive,
    sprf=st.sampled_from([200, 400]),
    ustep=st.sampled_from([0, 0, 1, 3, 4, 7]),
    ihd=st.sampled_from([8, 8, 0, 30]),
    auto_micro=st.booleans(),
)


@given(
    drives,
    st.integers(1, 20_000),
    st.integers(1_000, 3_000_000),
    st.sampled_from([0.01, 0.1, 1.0]),
)
def test_all_steps_are_made_in_the_time_to_half_a_unit_or_nearly(
    drive: Drive, steps: int, per_step: int, apart: float
) -> None:
    per_step += 1_000 * drive.m  # pulses that last long enough for any offset
    even = split(drive, steps, steps * per_step, 1, apart)
    assert sum(one.steps for one in even) == steps
    taken = sum(one.steps * step_ticks(drive, one.cycle_us) for one in even)
    unit = max(2, 2 * drive.m)
    assert abs(taken - steps * per_step) <= max(unit, apart / 2 * per_step) + 1


@given(drives.filter(lambda drive: not drive.auto_micro), st.integers(2, 20_000), st.data())
def test_on_the_way_the_motor_is_no_further_off_than_allowed(
    drive: Drive, steps: int, data: st.DataObject
) -> None:
    ticks = steps * (1_000 * drive.m + data.draw(st.integers(0, 4_000)))
    apart = data.draw(st.sampled_from([0.05, 0.1, 0.5]))
    done, at = 0, 0
    for one in split(drive, steps, ticks, 1, apart):
        done += one.steps
        at += one.steps * step_ticks(drive, one.cycle_us)
        # Parts of whole steps: at most one step's worth of a unit more.
        off = abs(at * steps / ticks - done)
        assert off <= apart * 1.5 + 0.05


def test_a_cycle_that_fits_is_one_command() -> None:
    assert split(Drive(), 500, 500 * 6_000, 1, 0.1) == [Even(500, 3_000)]


def test_a_cruise_at_two_cycles_takes_turns_where_it_is_long() -> None:
    half = split(Drive(), 40, 40 * 6_001, 1, 0.01)
    assert half == [Even(20, 3_000), Even(20, 3_001)]
    turns = split(Drive(), 10_000, 10_000 * 2_001, 1, 0.1)
    assert {one.cycle_us for one in turns} == {1_000, 1_001}
    assert sum(one.steps * one.cycle_us * 2 for one in turns) == 10_000 * 2_001
    assert len(turns) == 27


def test_with_microsteps_a_pulse_can_be_a_tick_longer() -> None:
    # 16 pulses a step: 2 000 ticks are 125 each, and 2 016 are 126.
    assert split(Drive(ustep=4), 10, 20_160, 1, 0.1) == [Even(10, 1_008)]
    assert step_ticks(Drive(ustep=4), 1_007) == 2_000


def test_it_is_never_faster_than_it_may_be() -> None:
    least = cycle_least(Drive(), 300)
    assert least == 1_000
    assert split(Drive(), 10, 10 * 1_500, least, 0.1) == [Even(10, 1_000)]


def test_a_motor_of_59_rpm_is_not_given_a_cycle_of_60() -> None:
    assert cycle_least(Drive(), 59) == 5_085
    assert 60_000_000 / 200 / cycle_least(Drive(), 59) == pytest.approx(59, abs=0.01)
