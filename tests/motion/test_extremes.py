"""The ends of every scale: right, or refused; never a hang, an overflow or a float in a count."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from sacbus.language import Motion
from sacbus.motion import Drive, plan
from sacbus.motion.shares import LONGEST_RAMP, linear_index
from tests.motion.test_planner import command

LONG = 2**32 - 1
FACTORY = Drive()

NODES = [
    FACTORY,
    Drive(ustep=7),
    Drive(ustep=7, auto_micro=True),
    Drive(sprf=65_535, ustep=7),
    Drive(sprf=1, slow_rpm=1),
    Drive(ihd=255),
    Drive(xclk=255, ihd=0),
]


def motion(
    steps: int | None, rpm: int, cycle_us: int, acc100: int, *, linear: bool = False
) -> Motion:
    return Motion(steps, True, rpm, cycle_us, acc100, acc100, linear)


@pytest.mark.slow
@pytest.mark.parametrize("drive", NODES, ids=repr)
@pytest.mark.parametrize("steps", [1, 2**31, LONG, None])
@pytest.mark.parametrize("linear", [False, True], ids=["harmonic", "linear"])
def test_every_question_is_answered_at_the_ends_of_the_scales(
    drive: Drive, steps: int | None, linear: bool
) -> None:
    """1 to 2^32 - 1 steps, 1 us to 71 minutes a step, 0.01 to 999, from rest and from 2^32 RPM."""
    for cycle_us, acc100, start in product((1, 500, LONG), (1, 99_900), (0, LONG)):
        rpm = 60_000_000 // (drive.steps_per_rev * cycle_us)
        profile = plan(motion(steps, rpm, cycle_us, acc100, linear=linear), drive, start)
        pulses = 10**12 if profile.pulses is None else profile.pulses
        times = {}
        for pulse in sorted({0, pulses // 2, pulses - 1}):
            at = times[pulse] = profile.time_of(pulse)
            assert type(at) is int
            assert profile.pulses_at(at) == pulse + 1
            assert profile.pulses_at(at - 1) == pulse
            assert profile.velocity_at(at) > 0
        assert list(times.values()) == sorted(set(times.values()))
        if steps is not None:
            assert type(profile.duration) is int
            assert profile.duration == profile.time_of(pulses) > times[pulses - 1]
            assert profile.travel_at(profile.duration) == steps * drive.m
        at = times[pulses - 1]
        if at < 2**62:
            last = profile.pulse_times(profile.time_of(max(0, pulses - 9)), at + 1)
            assert last.dtype == np.int64
            assert last.tolist() == [profile.time_of(pulses - k) for k in range(last.size, 0, -1)]
        for cut in (profile.halt(at), profile.cut(at), profile.slow_down(at, 1, linear=linear)):
            assert type(cut.pulses) is int
            assert cut.duration is not None
            assert cut.duration >= at
        assert all(str(warning) for warning in profile.warnings)


@pytest.mark.parametrize("linear", [False, True], ids=["harmonic", "linear"])
def test_one_step_is_one_step(linear: bool) -> None:
    profile = plan(command(1, 100, 1, 1, linear=linear), FACTORY)
    assert (profile.pulses, profile.n_acc, profile.n_cruise, profile.n_dec) == (1, 0, 0, 1)
    assert profile.pulse_times(0, 2**60).tolist() == [0]


def test_one_hundredth_of_an_rpm_a_step_adds_up() -> None:
    profile = plan(command(200_000, 600, 0.01, 0.01), FACTORY)
    assert (profile.n_acc, profile.n_cruise, profile.n_dec) == (59_000, 82_000, 59_000)
    up = sum(60_000_000 // (1_000 + k) for k in range(59_000))
    assert profile.duration == 2 * up + 82_000 * 1_000
    assert profile.time_of(59_000) == up


def test_cycles_from_1_microsecond_to_71_minutes() -> None:
    quick = plan(motion(2**31, 300_000, 1, 99_900), FACTORY)
    assert (quick.duration, quick.pulses) == (2**32, 2**31)
    slow = plan(motion(2**31, 0, LONG, 99_900), FACTORY)
    assert slow.duration == 2**31 * LONG * 2
    assert slow.pulses_at(2**63 + 1) == (2**63 + 1) // (LONG * 2) + 1
    with pytest.raises(ValueError, match="2\\*\\*62"):
        slow.pulse_times(2**62, 2**62 + 1)
    # The last that fit int64: some 35 hours of the 73 000 years.
    period = LONG * 2
    last = (2**62 - 1) // period * period
    window = slow.pulse_times(2**62 - 30 * period, 2**62)
    assert window.tolist() == list(range(last - 29 * period, last + 1, period))


def test_the_steps_of_a_linear_ramp_are_counted_without_a_float() -> None:
    # pi * v^2 * sprf / (36 * acc100), between what two bounds of pi make of it.
    low = Fraction(31415926535897932384, 10**19)
    high = low + Fraction(1, 10**19)
    for rpm, acc100, sprf in ((9_999_973, 9_999, 200), (12_345_678, 99_899, 6_553), (600, 1, 1)):
        steps = linear_index(rpm, acc100, sprf)
        unit = Fraction(rpm**2 * sprf, 36 * acc100)
        assert int(low * unit) <= steps <= int(high * unit)
        assert linear_index(Fraction(rpm, 3), acc100, sprf) == int(low * unit / 9)
    assert linear_index(LONG, 1, 65_535) == LONGEST_RAMP


@pytest.mark.parametrize("acc100", [1, 99, 100, 1047, 99_899])
def test_a_ramp_that_cannot_be_ridden_to_its_end_is_said_to_be(acc100: int) -> None:
    profile = plan(motion(1_000, 60_000, 5, acc100, linear=True), FACTORY)
    assert profile.shares.truncated
    assert any("is not reached" in str(warning) for warning in profile.warnings)


def test_pulses_quicker_than_a_driver_takes_them_are_issued_and_warned_of() -> None:
    profile = plan(motion(1_000, 300_000, 1, 99_900), replace(FACTORY, ustep=3))
    assert profile.duration == 8_000
    assert {warning.limit.name for warning in profile.warnings} >= {"PERIOD", "FLOOR", "CLOCK"}
