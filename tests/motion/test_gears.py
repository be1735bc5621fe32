"""Auto-micro: as many microsteps as leave pulses 200 us long, changed at full steps."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import Drive, Profile, plan
from sacbus.motion.gears import LONG_ENOUGH, cruise_weight
from tests.motion.test_planner import command

GEARED = Drive(ustep=4, auto_micro=True)


def gears(profile: Profile) -> list[tuple[str, int, int]]:
    """State, exponent and pulses of each stretch of pulses that are alike in both."""
    pulses = profile.pulses
    assert pulses is not None
    seen = (
        (profile.state_at(at).name, profile.ustep_at(at))
        for at in profile.pulse_times(0, 2**60).tolist()
    )
    return [(*key, len(list(group))) for key, group in groupby(seen)]


@pytest.mark.parametrize(
    ("cycle_us", "weight"),
    [(3200, 1), (3199, 2), (1600, 2), (1599, 4), (400, 8), (399, 16), (200, 16), (1, 16)],
)
def test_a_cruise_takes_the_most_microsteps_that_leave_200_microseconds(
    cycle_us: int, weight: int
) -> None:
    # spec, "Auto-micro": the largest exponent whose pulse period stays at 200 us or more
    assert cruise_weight(GEARED, cycle_us) == weight


def test_it_is_the_real_period_that_counts() -> None:
    assert cruise_weight(Drive(ustep=4, auto_micro=True, ihd=9), 3200) == 2
    assert cruise_weight(Drive(ustep=4, auto_micro=True, ihd=7), 3199) == 1


def test_gears_change_on_the_way_up_and_down_and_at_full_steps_only() -> None:
    profile = plan(command(200, 400, 10, 10), GEARED)
    assert (profile.n_acc, profile.n_cruise, profile.n_dec) == (39, 122, 39)
    # 10 RPM is 30 ms a step; 1/16 lasts 200 us up to 93.75 RPM, 1/8 up to 187.5, 1/4 up to 375.
    assert gears(profile) == [
        ("ACCEL", 4, 8 * 16),
        ("ACCEL", 3, 9 * 8),
        ("ACCEL", 2, 19 * 4),
        ("ACCEL", 1, 3 * 2),
        ("CRUISE", 1, 122 * 2),
        ("DECEL", 1, 3 * 2),
        ("DECEL", 2, 19 * 4),
        ("DECEL", 3, 9 * 8),
        ("DECEL", 4, 8 * 16),
    ]
    assert profile.travel_at(2**60) == 200 * 16
    assert profile.peak_rpm == pytest.approx(400)
    assert profile.ustep_at(-1) == profile.ustep_at(2**60) == 4


def test_a_change_down_goes_up_through_the_gears() -> None:
    profile = plan(command(100, 60, 10, 999), GEARED, 400)
    assert [gear for _, gear, _ in gears(profile)] == [1, 2, 3, 4, 4]


def test_without_microsteps_there_are_no_gears() -> None:
    plain, geared = (
        plan(command(200, 400, 10, 10), Drive(auto_micro=auto)) for auto in (False, True)
    )
    assert gears(geared) == gears(plain)
    assert geared.duration == plain.duration


@pytest.mark.parametrize(
    "motion", [command(3200, 400, 10, 10, pulses=True), command(200, 400, 10, 10, extra=1)]
)
def test_a_command_that_leaves_full_steps_stays_in_the_finest(motion: Motion) -> None:
    geared, plain = plan(motion, GEARED), plan(motion, Drive(ustep=4))
    assert {gear for _, gear, _ in gears(geared)} == {4}
    assert np.array_equal(geared.pulse_times(0, 2**60), plain.pulse_times(0, 2**60))


def test_a_new_velocity_begins_at_the_next_full_step() -> None:
    profile = plan(replace(command(None, 60, 10), acc100=1000), GEARED)
    for pulse in (5 * 16 + 1, 5 * 16 + 7, 5 * 16 + 15, 6 * 16 - 1):
        faster = profile.retarget(profile.time_of(pulse), command(None, 300, 10))
        assert faster.pulse_times(0, profile.time_of(96)).size == 96
        # The last pulse in the old gear, at the velocity of the cruise, and the first of the ramp.
        assert faster.velocity_at(faster.time_of(95)) == pytest.approx(60)
        assert faster.velocity_at(faster.time_of(96)) == pytest.approx(60, rel=1e-4)
        assert faster.velocity_at(faster.time_of(97)) == pytest.approx(60 + 10 / 16, rel=1e-3)


def test_a_new_target_on_the_way_goes_on_with_the_same_linear_ramp() -> None:
    ramp, further = (command(None, rpm, 20, linear=True) for rpm in (400, 700))
    profile, straight = plan(ramp, GEARED), plan(further, GEARED)
    expected = straight.pulse_times(0, 10**7)
    for pulse in (17, 100, 101, 110, 150, 1_000):
        both = profile.retarget(profile.time_of(pulse), further)
        assert np.array_equal(both.pulse_times(0, 10**7), expected)


@pytest.mark.parametrize("linear", [False, True])
def test_a_lower_target_on_the_way_comes_down_through_the_gears(linear: bool) -> None:
    profile = plan(command(None, 500, 20, linear=linear), GEARED)
    slower = profile.retarget(10**9, command(None, 30, 20, linear=linear))
    begin = int(slower.pulse_times(10**9, 2 * 10**9)[0])
    times = slower.pulse_times(begin, begin + 10**7).tolist()
    seen = [gear for gear, _ in groupby(slower.ustep_at(at) for at in times)]
    assert seen == [1, 2, 3, 4]
    assert slower.velocity_at(2 * 10**9) == 30


@given(
    steps=st.integers(1, 300),
    rpm=st.integers(11, 2_000),
    acc=st.sampled_from([1.0, 7.5, 50.0]),
    linear=st.booleans(),
    ustep=st.integers(0, 7),
    start=st.sampled_from([0, 0, 500]),
)
def test_every_full_step_is_made_of_equal_microsteps_that_could_not_be_finer(
    steps: int, rpm: int, acc: float, linear: bool, ustep: int, start: int
) -> None:
    drive = Drive(ustep=ustep, auto_micro=True)
    motion = replace(command(steps, 100, acc, acc, linear=linear), rpm=rpm, cycle_us=300_000 // rpm)
    profile = plan(motion, drive, start)
    assert profile.duration is not None
    times = [*profile.pulse_times(0, 2**60).tolist(), profile.duration]
    fixed = []
    for finest in range(ustep + 1):
        plain = plan(motion, Drive(ustep=finest), start)
        fixed.append([*plain.pulse_times(0, 2**60).tolist(), plain.duration])
    pulse = 0
    for step in range(steps):
        exponent = profile.ustep_at(times[pulse])
        made = 1 << exponent
        periods = np.diff(times[pulse : pulse + made + 1])
        assert {profile.ustep_at(at) for at in times[pulse : pulse + made]} == {exponent}
        assert exponent == 0 or periods.min() >= LONG_ENOUGH
        if exponent < ustep and not profile.shares.truncated:
            # (What a truncated command has reached is held in the gear in which it was reached.)
            finer = fixed[exponent + 1][2 * made * step : 2 * made * (step + 1) + 1]
            assert np.diff(finer).min() < LONG_ENOUGH
        pulse += made
    assert pulse == profile.pulses
