"""The room agrees with the slow reference, pulse for pulse, cuts included."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import Profile, plan
from tests.motion.reference import NONE, Run, Setup, run
from tests.motion.strategies import accelerations, drive_of, motions, setups

END = 1 << 60
LENGTH = 1_500
"""Ramps beyond this are for the tests of the tables: the reference would take seconds."""


def walk(setup: Setup, rpm: int, acc100: int, linear: bool) -> int:
    """Pulses of a ramp from standstill."""
    steps = setup.steps_to(Fraction(rpm), acc100) if linear else rpm * 100 // acc100
    return steps * setup.m


def steep_enough(setup: Setup, rpm: int, acc100: int, *, linear: bool) -> int:
    """The acceleration, or a multiple of it whose ramp the reference can walk.

    Made steeper instead of thrown away: else Hypothesis would discard most of what it draws.
    """
    while acc100 < NONE and walk(setup, rpm, acc100, linear) >= LENGTH:
        acc100 *= 7
    return min(acc100, NONE)


def walkable(setup: Setup, motion: Motion, start: int = 0) -> Motion:
    top = max(motion.rpm, start)
    return replace(
        motion,
        acc100=steep_enough(setup, top, motion.acc100, linear=motion.linear),
        dec100=steep_enough(setup, top, motion.dec100, linear=motion.linear),
    )


def assert_agree(profile: Profile, reference: Run) -> None:
    times = reference.times
    assert profile.pulse_times(0, END).tolist() == times
    assert profile.pulses == len(times)
    assert profile.duration == reference.duration
    states = Counter(pulse.state for pulse in reference.pulses)
    unit = profile.shares.unit
    assert profile.n_acc * unit == states["ACCEL"]
    assert profile.n_dec * unit == states["DECEL"]
    for k in {0, 1, len(times) // 3, len(times) - 1} & set(range(len(times))):
        pulse = reference.pulses[k]
        assert profile.time_of(k) == times[k]
        assert profile.pulses_at(times[k]) == k + 1
        assert profile.pulses_at(times[k] - 1) == k
        if times[k] < reference.duration:
            assert profile.state_at(times[k]).name == pulse.state
            assert profile.course.place_of(k).pace.speed == int(pulse.rpm * 100 * profile.drive.m)


@pytest.mark.slow
@settings(max_examples=150)
@given(data=st.data(), setup=setups, start=st.sampled_from([0, 0, 5, 50, 100, 333]))
def test_a_command_issues_the_pulses_of_the_reference(
    data: st.DataObject, setup: Setup, start: int
) -> None:
    motion = walkable(setup, data.draw(motions(setup.sprf)), start)
    assert_agree(plan(motion, drive_of(setup), start), run(motion, setup, start))


@pytest.mark.slow
@settings(max_examples=150)
@given(data=st.data(), setup=setups, start=st.sampled_from([0, 0, 80]))
def test_every_cut_leaves_the_pulses_of_the_reference(
    data: st.DataObject, setup: Setup, start: int
) -> None:
    motion = walkable(setup, data.draw(motions(setup.sprf)), start)
    linear = data.draw(st.booleans())
    top = max(motion.rpm, start)
    dec100 = steep_enough(setup, top, data.draw(accelerations), linear=linear)
    profile, reference = plan(motion, drive_of(setup), start), run(motion, setup, start)
    at = data.draw(st.integers(0, reference.duration + 10), label="cut at")
    assert_agree(profile.halt(at), reference.halt(at))
    assert_agree(profile.cut(at), reference.cut(at))
    once = profile.slow_down(at, dec100, linear=linear)
    expected = reference.slow_down(at, dec100, linear)
    assert_agree(once, expected)
    again = data.draw(st.integers(0, expected.duration + 10), label="cut again at")
    assert_agree(once.halt(again), expected.halt(again))


@pytest.mark.slow
@settings(max_examples=100)
@given(data=st.data(), setup=setups)
def test_continuous_motion_changes_speed_and_stops_as_the_reference(
    data: st.DataObject, setup: Setup
) -> None:
    motion = walkable(setup, data.draw(motions(setup.sprf, continuous=True)))
    faster = walkable(setup, data.draw(motions(setup.sprf, continuous=True)), motion.rpm)
    linear = data.draw(st.booleans())
    top = max(motion.rpm, faster.rpm)
    dec100 = steep_enough(setup, top, data.draw(accelerations), linear=linear)
    drive, cruise = drive_of(setup), 50
    profile, reference = plan(motion, drive), run(motion, setup, cruise=cruise)
    assert (profile.pulses, profile.n_cruise, profile.duration) == (None, None, None)
    seen = reference.duration
    assert profile.pulse_times(0, seen).tolist() == reference.times
    assert profile.kept_rpm == 0

    at = data.draw(st.integers(0, seen - 1), label="new velocity at")
    profile, reference = profile.retarget(at, faster), reference.retarget(at, faster, cruise)
    seen = reference.duration
    assert profile.pulse_times(0, seen).tolist() == reference.times

    at = data.draw(st.integers(0, reference.times[-1] - 1), label="slow down at")
    profile, reference = (
        profile.slow_down(at, dec100, linear=linear),
        reference.slow_down(at, dec100, linear),
    )
    assert_agree(profile, reference)
    at = data.draw(st.integers(0, reference.duration), label="cut at")
    assert_agree(profile.cut(at), reference.cut(at))
