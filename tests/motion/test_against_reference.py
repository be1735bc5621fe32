"""The room agrees with the slow reference, pulse for pulse, cuts included.

Some thousands of commands a run: each example of the last test is a session of several.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fractions import Fraction
from itertools import accumulate

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import Profile, Rpm, load_ticks, plan
from tests.motion.reference import NONE, Run, Setup, run
from tests.motion.strategies import accelerations, drive_of, motions, setups

END = 1 << 60
LENGTH = 1_000
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
    assert profile.kept_rpm == reference.kept
    states: Counter[str] = Counter()
    for pulse in reference.pulses:
        # A command counts full steps, one that was cut into its pulses.
        states[pulse.state] += pulse.weight if profile.shares.unit > 1 else 1
    unit = profile.shares.unit
    assert profile.n_acc * unit == states["ACCEL"]
    assert profile.n_dec * unit == states["DECEL"]
    travels = list(accumulate((pulse.weight for pulse in reference.pulses), initial=0))
    for k in {0, 1, len(times) // 3, len(times) - 1} & set(range(len(times))):
        pulse = reference.pulses[k]
        assert profile.time_of(k) == times[k]
        assert profile.pulses_at(times[k]) == k + 1
        assert profile.pulses_at(times[k] - 1) == k
        assert profile.travel_at(times[k]) == travels[k + 1]
        if times[k] < reference.duration:
            assert profile.state_at(times[k]).name == pulse.state
            assert profile.course.place_of(k).pace.speed == int(pulse.rpm * 100 * profile.drive.m)


def short(data: st.DataObject, setup: Setup, *, continuous: bool = False) -> Motion:
    """A command of at most some thousand pulses."""
    steps = max(10, 2_000 // setup.m)
    return data.draw(motions(setup.sprf, continuous=continuous, steps=steps))


@pytest.mark.slow
@settings(max_examples=400)
@given(data=st.data(), setup=setups, start=st.sampled_from([0, 0, 5, 50, 100, 333]))
def test_a_command_issues_the_pulses_of_the_reference(
    data: st.DataObject, setup: Setup, start: int
) -> None:
    motion = walkable(setup, short(data, setup), start)
    assert_agree(plan(motion, drive_of(setup), start), run(motion, setup, start))


@pytest.mark.slow
@settings(max_examples=400)
@given(data=st.data(), setup=setups, start=st.sampled_from([0, 0, 80]))
def test_every_cut_leaves_the_pulses_of_the_reference(
    data: st.DataObject, setup: Setup, start: int
) -> None:
    motion = walkable(setup, short(data, setup), start)
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
@settings(max_examples=250)
@given(data=st.data(), setup=setups)
def test_continuous_motion_changes_speed_and_stops_as_the_reference(
    data: st.DataObject, setup: Setup
) -> None:
    motion = walkable(setup, short(data, setup, continuous=True))
    linear = data.draw(st.booleans())
    drive, cruise = drive_of(setup), 3 * setup.m
    profile, reference = plan(motion, drive), run(motion, setup, cruise=cruise)
    assert (profile.pulses, profile.n_cruise, profile.duration) == (None, None, None)
    assert profile.kept_rpm == 0
    top = motion.rpm
    for _ in range(data.draw(st.integers(0, 4), label="new velocities")):
        assert profile.pulse_times(0, reference.duration).tolist() == reference.times
        # With auto-micro the step that runs is finished first: the reference must have its pulses.
        known = reference.times[-setup.m]
        other = replace(
            short(data, setup, continuous=True),
            pulses=motion.pulses,
            extra_pulses=motion.extra_pulses,
        )
        other = walkable(setup, other, top)
        at = data.draw(st.integers(0, known), label="new velocity at")
        profile = profile.retarget(at, other)
        reference = reference.retarget(at, other, cruise)
        top = max(top, other.rpm)
    dec100 = steep_enough(setup, top, data.draw(accelerations), linear=linear)
    assert profile.pulse_times(0, reference.duration).tolist() == reference.times
    at = data.draw(st.integers(0, reference.times[-1] - 1), label="slow down at")
    profile, reference = (
        profile.slow_down(at, dec100, linear=linear),
        reference.slow_down(at, dec100, linear),
    )
    assert_agree(profile, reference)
    at = data.draw(st.integers(0, reference.duration), label="cut at")
    assert_agree(profile.cut(at), reference.cut(at))


@pytest.mark.slow
@settings(max_examples=200)
@given(data=st.data(), setup=setups)
def test_a_session_of_commands_and_cuts_issues_the_pulses_of_the_reference(
    data: st.DataObject, setup: Setup
) -> None:
    """Each command goes on at the velocity that the one before has left, whatever ended that."""
    drive = drive_of(setup)
    kept: Rpm = 0
    fastest = 0
    begin, before = 0, -1
    for _ in range(data.draw(st.integers(1, 12), label="commands")):
        motion = walkable(setup, short(data, setup), max(fastest, int(kept) + 1))
        fastest = max(fastest, motion.rpm)
        profile, reference = plan(motion, drive, kept), run(motion, setup, kept)
        at = data.draw(st.integers(0, reference.duration), label="at")
        cut = data.draw(st.sampled_from(["", "", "S", "N", "s", "n"]), label="cut")
        if cut == "S":
            profile, reference = profile.halt(at), reference.halt(at)
        elif cut == "N":
            profile, reference = profile.cut(at), reference.cut(at)
        elif cut:
            linear = motion.linear if cut == "n" else data.draw(st.booleans())
            dec100 = motion.dec100 if cut == "n" else data.draw(accelerations)
            dec100 = steep_enough(setup, fastest, dec100, linear=linear)
            profile = profile.slow_down(at, dec100, linear=linear)
            reference = reference.slow_down(at, dec100, linear)
        assert_agree(profile, reference)
        times = profile.pulse_times(0, END)
        assert begin + int(times[0]) > before
        before = begin + int(times[-1])
        # After S even a command that waits is loaded before it moves anything.
        begin += reference.duration + (load_ticks(acceleration_changes=False) if cut == "S" else 0)
        kept = profile.kept_rpm
