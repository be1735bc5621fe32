"""What a profile answers, and what cuts leave of it."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sacbus.motion import Drive, Profile, State, plan
from tests.motion.reference import Setup
from tests.motion.strategies import drive_of, motions, setups
from tests.motion.test_planner import command, shares

FACTORY = Drive()
TYPICAL = plan(command(200, 100), FACTORY)


def duration(profile: Profile) -> int:
    assert profile.duration is not None
    return profile.duration


@given(data=st.data(), setup=setups, start=st.sampled_from([0, 0, 77, 400]))
def test_invariants_of_every_profile(data: st.DataObject, setup: Setup, start: int) -> None:
    motion = data.draw(motions(200))
    profile = plan(motion, drive_of(setup), start)
    steps = motion.steps
    assert steps is not None
    assert profile.n_cruise is not None
    assert profile.n_acc + profile.n_cruise + profile.n_dec == steps
    assert min(profile.n_acc, profile.n_cruise, profile.n_dec) >= 0
    end = duration(profile)
    assume(profile.pulses is not None and profile.pulses < 60_000)
    times = profile.pulse_times(0, end + 1)
    assert times.dtype == np.int64
    assert times.size == profile.pulses
    assert times[0] == 0
    assert times[-1] < end
    assert np.all(np.diff(times) > 0)

    since, until = sorted(data.draw(st.tuples(*[st.integers(-5, end + 5)] * 2)))
    window = times[(times >= since) & (times < until)]
    assert np.array_equal(profile.pulse_times(since, until), window)

    at = data.draw(st.integers(0, end - 1))
    done = profile.pulses_at(at)
    assert profile.time_of(done - 1) <= at < profile.time_of(done)
    assert 0 < profile.velocity_at(at) <= profile.peak_rpm
    order = [State.ACCEL, State.CRUISE, State.DECEL, State.STOP, State.STANDBY]
    later = data.draw(st.integers(at, end + 5))
    assert order.index(profile.state_at(at)) <= order.index(profile.state_at(later))


def test_states_follow_each_other_and_the_command_ends_in_stop() -> None:
    end = duration(TYPICAL)
    assert TYPICAL.state_at(-1) is State.STANDBY
    assert TYPICAL.state_at(0) is State.ACCEL
    assert TYPICAL.state_at(TYPICAL.time_of(90) - 1) is State.ACCEL
    assert TYPICAL.state_at(TYPICAL.time_of(90)) is State.CRUISE
    assert TYPICAL.state_at(TYPICAL.time_of(110)) is State.DECEL
    assert TYPICAL.state_at(end - 1) is State.DECEL
    assert TYPICAL.state_at(end) is State.STOP
    assert TYPICAL.state_at(end + 1) is State.STANDBY


def test_before_and_after_there_is_no_velocity() -> None:
    end = duration(TYPICAL)
    assert [TYPICAL.velocity_at(t) for t in (-1, end, end + 9)] == [0, 0, 0]
    assert [TYPICAL.pulses_at(t) for t in (-1, 0, end - 1, end, end + 9)] == [0, 1, 200, 200, 200]
    assert TYPICAL.velocity_at(0) == 10
    assert TYPICAL.peak_rpm == 100


def test_a_command_without_steps_has_no_peak() -> None:
    assert plan(command(0, 100), FACTORY).peak_rpm == 0


def test_a_pulse_the_command_does_not_have_is_refused() -> None:
    for pulse in (-1, 201):
        with pytest.raises(IndexError, match="200 pulses"):
            TYPICAL.time_of(pulse)


def test_a_window_beyond_2_to_the_62_is_refused() -> None:
    endless = plan(command(None, 1), FACTORY)
    assert endless.pulse_times(2**62 - 600_000, 2**62).size == 1
    with pytest.raises(ValueError, match="2\\*\\*62"):
        endless.pulse_times(2**62 - 1, 2**62 + 1)


def test_totals_beyond_2_to_the_62_are_plain_integers() -> None:
    motion = command(2**32 - 1, 1)
    motion = type(motion)(2**32 - 1, True, 0, 2**32 - 1, 100, 100, False)
    profile = plan(motion, FACTORY)
    assert duration(profile) == (2**32 - 1) ** 2 * 2
    assert profile.pulses_at(2**64) == 2**64 // (2 * (2**32 - 1)) + 1


def test_continuous_motion_never_ends() -> None:
    profile = plan(command(None, 100), FACTORY)
    assert (profile.pulses, profile.duration, profile.n_cruise, profile.n_dec) == (
        None,
        None,
        None,
        0,
    )
    assert profile.n_acc == 90
    assert profile.state_at(10**15) is State.CRUISE
    assert profile.time_of(10**9 + 90) - profile.time_of(90) == 6000 * 10**9
    assert profile.peak_rpm == 100


def test_halting_ends_at_once_and_keeps_nothing() -> None:
    at = TYPICAL.time_of(100) + 5
    halted = TYPICAL.halt(at)
    assert (halted.pulses, halted.duration, halted.kept_rpm) == (101, at, 0)
    assert halted.state_at(at) is State.STOP
    assert halted.pulse_times(0, 2**40).tolist() == TYPICAL.pulse_times(0, at + 1).tolist()
    assert shares(halted) == (90, 11, 0)


def test_a_pulse_at_the_very_instant_of_a_halt_stands() -> None:
    assert TYPICAL.halt(TYPICAL.time_of(7)).pulses == 8
    assert TYPICAL.halt(0).pulses == 1


def test_cutting_lets_the_present_pulse_run_out_and_keeps_its_velocity() -> None:
    cut = TYPICAL.cut(TYPICAL.time_of(45) + 1)
    assert (cut.pulses, cut.kept_rpm) == (46, 55)
    assert cut.duration == TYPICAL.time_of(46)
    half = plan(command(200, 100, 0.5, 1), FACTORY).cut(TYPICAL.time_of(1) + 1)
    assert half.kept_rpm == Fraction(21, 2)
    assert plan(command(500, 100), FACTORY, half.kept_rpm).n_acc == 89


def test_a_cut_that_comes_too_late_changes_nothing() -> None:
    end = duration(TYPICAL)
    assert TYPICAL.halt(end) is TYPICAL
    assert TYPICAL.cut(end) is TYPICAL
    assert TYPICAL.slow_down(end, 100, linear=False) is TYPICAL
    assert TYPICAL.slow_down(end - 1, 100, linear=False) is TYPICAL


def test_a_cut_before_the_first_pulse_is_refused() -> None:
    with pytest.raises(ValueError, match="before its first pulse"):
        TYPICAL.halt(-1)
    with pytest.raises(ValueError, match="before its first pulse"):
        TYPICAL.slow_down(-1, 100, linear=False)


def test_slowing_down_from_cruise_takes_the_ramp_of_the_session() -> None:
    profile = plan(command(None, 100), FACTORY)
    at = profile.time_of(1000)
    slowed = profile.slow_down(at, 200, linear=False)
    assert shares(slowed) == (90, 911, 45)
    assert slowed.kept_rpm == 0
    assert slowed.velocity_at(duration(slowed) - 1) == 10


def test_slowing_down_with_999_stops_at_once_and_keeps_the_velocity() -> None:
    profile = plan(command(None, 100), FACTORY)
    slowed = profile.slow_down(profile.time_of(1000), 99_900, linear=False)
    assert (slowed.pulses, slowed.kept_rpm, slowed.n_dec) == (1001, 100, 0)


def test_slowing_down_ends_on_a_full_step() -> None:
    profile = plan(command(None, 100), Drive(ustep=4))
    for pulse in range(3_000, 3_016):
        for dec100 in (100, 99_900):
            slowed = profile.slow_down(profile.time_of(pulse), dec100, linear=False)
            assert slowed.pulses is not None
            assert slowed.pulses % 16 == 0


def test_slowing_down_a_ramp_that_already_comes_down_changes_nothing() -> None:
    for drive in (FACTORY, Drive(ustep=3)):
        for linear in (False, True):
            profile = plan(command(400, 100, 2, 2, linear=linear), drive)
            end = duration(profile)
            for at in range(profile.time_of(360 * drive.m), end, 12_345):
                slowed = profile.slow_down(at, 200, linear=linear)
                assert np.array_equal(
                    slowed.pulse_times(0, end + 1), profile.pulse_times(0, end + 1)
                )


def test_in_pulse_mode_slowing_down_counts_pulses() -> None:
    profile = plan(command(5000, 100, pulses=True), Drive(ustep=3))
    slowed = profile.slow_down(profile.time_of(1001), 70, linear=False)
    assert slowed.n_dec == 9000 * 8 // 70


def test_a_new_velocity_ramps_from_the_present_one() -> None:
    profile = plan(command(None, 100), FACTORY)
    at = profile.time_of(45)
    faster = profile.retarget(at, command(None, 200, 2))
    assert shares(faster) == (46 + 72, None, 0)
    assert faster.velocity_at(at) == profile.velocity_at(at)
    assert np.array_equal(faster.pulse_times(0, at + 1), profile.pulse_times(0, at + 1))
    assert faster.velocity_at(10**9) == 200
    slower = faster.retarget(10**9, command(None, 9))
    assert slower.velocity_at(2 * 10**9) == pytest.approx(9, rel=1e-4)
    again = slower.retarget(2 * 10**9, command(None, 50, 10, linear=True))
    assert again.velocity_at(3 * 10**9) == 50
    at_once = again.retarget(3 * 10**9, command(None, 50, 10, linear=True))
    assert at_once.n_acc == again.n_acc


def test_only_continuous_motion_takes_a_new_velocity() -> None:
    with pytest.raises(ValueError, match="continuous"):
        TYPICAL.retarget(0, command(None, 50))
    with pytest.raises(ValueError, match="continuous"):
        plan(command(None, 50), FACTORY).retarget(0, command(200, 50))


def test_a_drive_refuses_what_no_device_can_hold() -> None:
    with pytest.raises(ValueError, match="ustep"):
        Drive(ustep=8)
    with pytest.raises(ValueError, match="xclk"):
        Drive(xclk=-1)


def test_zero_settings_act_as_the_spec_says() -> None:
    # spec, "Division by nothing"
    drive = Drive(sprf=0, slow_rpm=0)
    assert (drive.steps_per_rev, drive.slow) == (200, 1)
    assert plan(command(500, 100), drive).n_acc == 99


@pytest.mark.parametrize("linear", [False, True])
def test_a_long_window_is_the_short_ones_in_a_row(linear: bool) -> None:
    profile = plan(command(60_000, 600, 0.5, 0.3, linear=linear), Drive(ustep=3))
    end = duration(profile)
    whole = profile.pulse_times(0, end)
    assert whole.size == 480_000
    cuts = [*range(0, end, end // 700), end]
    parts = [profile.pulse_times(since, until) for since, until in pairwise(cuts)]
    assert np.array_equal(np.concatenate(parts), whole)
    for pulse in range(0, 480_000, 9_973):
        assert profile.time_of(pulse) == whole[pulse]


@pytest.mark.parametrize(
    ("pulse_us", "falls"),
    [(0, [0, 100, 200]), (1, [2, 102, 202]), (49, [98, 198, 298]), (50, [99, 199, 299])],
)
def test_clk_falls_before_the_next_pulse_at_the_latest(pulse_us: int, falls: list[int]) -> None:
    drive = Drive(pulse_us=pulse_us)
    profile = plan(replace(command(3, 100, 999, 999), cycle_us=50), drive)
    assert profile.clk_falls(0, 1_000).tolist() == falls
    assert profile.clk_falls(1, 200).tolist() == falls[1:2]
    assert profile.clk_falls(201, 1_000).size == 0


def test_clk_falls_where_the_next_pulse_is_beyond_an_array() -> None:
    profile = plan(replace(command(2, 1, 999, 999), cycle_us=2**63), FACTORY)
    assert profile.clk_falls(0, 100).tolist() == [2]


@pytest.mark.parametrize("linear", [False, True])
def test_the_tail_of_continuous_motion_goes_on_as_the_whole(linear: bool) -> None:
    profile = plan(command(None, 200, 20, linear=linear), Drive(ustep=2))
    for pulse, rpm in ((902, 300), (5_001, 50)):
        other = command(None, rpm, 20, linear=linear)
        profile = profile.retarget(profile.time_of(pulse) + 9, other)
    for at in (0, *(profile.time_of(pulse) for pulse in (3, 22, 906, 5_001, 5_033)), 10**9):
        first, tail = profile.tail(at)
        begin = profile.time_of(first)
        assert first % 4 == 0
        assert begin <= at < profile.time_of(first + 4)
        later = np.array(profile.pulse_times(begin, begin + 10**8))
        assert np.array_equal(tail.pulse_times(0, 10**8) + begin, later)
        assert (tail.duration, tail.kept_rpm, tail.motion) == (None, 0, profile.motion)
        assert tail.start_rpm == profile.drive.rpm(profile.course.place_of(first).pace.speed)
