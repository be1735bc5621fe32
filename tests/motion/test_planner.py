"""Worked values of the manual and the spec, and the shares of a command."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import Drive, Profile, plan
from tests.motion.strategies import motions

FACTORY = Drive()


def command(
    steps: int | None,
    rpm: int,
    acc: float = 1,
    dec: float = 1,
    *,
    linear: bool = False,
    extra: int = 0,
    pulses: bool = False,
) -> Motion:
    """A command at 200 steps a revolution, its velocity given in RPM."""
    return Motion(
        steps=steps,
        cw=True,
        rpm=rpm,
        cycle_us=300_000 // rpm,
        acc100=round(acc * 100),
        dec100=round(dec * 100),
        linear=linear,
        extra_pulses=extra,
        pulses=pulses,
    )


def shares(profile: Profile) -> tuple[int, int | None, int]:
    return profile.n_acc, profile.n_cruise, profile.n_dec


@pytest.mark.parametrize(
    ("motion", "start", "expected", "seconds"),
    [
        # spec/motion.md, "Worked values"
        pytest.param(command(200, 100), 0, (90, 20, 90), 1.469, id="m200v100a1d1"),
        pytest.param(command(200, 100, 0.5), 0, (133, 0, 67), 1.860, id="m200v100a.5d1"),
        pytest.param(
            command(2000, 100, 50, 50, linear=True), 0, (34, 1932, 34), 6.185, id="linear 50"
        ),
        pytest.param(
            command(2000, 100, 10.47, 10.47, linear=True),
            0,
            (166, 1668, 166),
            6.948,
            id="linear 10.47",
        ),
        pytest.param(command(200, 9), 0, (0, 200, 0), 6.667, id="m200v9"),
        pytest.param(command(500, 100, 1, 999), 0, (90, 410, 0), 1.935, id="m500v100a1d999"),
        pytest.param(command(500, 100), 100, (0, 410, 90), 1.935, id="m500v100a1d1 kept"),
        # manual, "Profiles": acc 0.4 with no deceleration, and the same once more within the GAP
        pytest.param(command(200, 100, 0.4, 999), 0, (200, 0, 0), None, id="200-0-0"),
        pytest.param(command(200, 100, 0.4, 999), 100, (0, 200, 0), 0.6, id="0-200-0"),
        # spec, "Truncation": the manual's one-step recipe gives 198 + 2 by this rule
        pytest.param(command(200, 100, 0.4, 40), 0, (198, 0, 2), None, id="198-0-2"),
        # spec, "Truncation": ramps of exactly the steps are whole
        pytest.param(command(180, 100), 0, (90, 0, 90), None, id="exactly both ramps"),
    ],
)
def test_worked_values(
    motion: Motion, start: int, expected: tuple[int, int, int], seconds: float | None
) -> None:
    profile = plan(motion, FACTORY, start)
    assert shares(profile) == expected
    assert profile.duration is not None
    if seconds is not None:
        assert profile.duration / 2e6 == pytest.approx(seconds, abs=0.0005)


@pytest.mark.parametrize(("rpm", "cycle_us"), [(100, 3000), (1, 300_000), (59, 5084), (60, 5000)])
def test_cruise_lasts_a_cycle_a_step(rpm: int, cycle_us: int) -> None:
    # manual, "Timing", "Cycle processing": 3000 us = 100 RPM, 300 000 us = 1 RPM
    profile = plan(command(10, rpm, 999, 999), FACTORY)
    assert profile.duration == 10 * cycle_us * 2
    assert profile.velocity_at(0) == pytest.approx(60e6 / 200 / cycle_us)


@pytest.mark.parametrize(("dec", "expected"), [(46, 1), (90, 1), (91, 0), (45, 2)], ids=str)
def test_deceleration_of_one_step_takes_a_dec_between_46_and_90(dec: int, expected: int) -> None:
    # manual, "Profiles"
    assert plan(command(500, 100, 1, dec), FACTORY).n_dec == expected


def test_a_profile_keeps_its_velocity_only_without_deceleration() -> None:
    assert plan(command(500, 100, 1, 999), FACTORY).kept_rpm == 100
    assert plan(command(500, 100, 1, 1), FACTORY).kept_rpm == 0
    assert plan(command(500, 100, 1, 95), FACTORY).kept_rpm == 0
    # A truncated command hands on its programmed V (spec, "GAP").
    assert plan(command(20, 100, 1, 999), FACTORY).kept_rpm == 100
    assert plan(command(None, 100, 1, 999), FACTORY).kept_rpm == 0


def test_a_kept_velocity_below_slow_starts_at_slow() -> None:
    assert plan(command(200, 100), FACTORY, 9).n_acc == 90
    assert plan(command(200, 100, linear=True), FACTORY, 9).n_acc == (
        plan(command(200, 100, linear=True), FACTORY, 10).n_acc
    )


def test_a_linear_command_after_deceleration_starts_at_standstill() -> None:
    motion = command(2000, 100, 10, 10, linear=True)
    assert plan(motion, FACTORY, 0).n_acc == 174
    assert plan(motion, FACTORY, 10).n_acc == 174 - 1


def test_changing_down_is_an_acceleration_of_the_incoming_command() -> None:
    assert shares(plan(command(500, 50, 1, 1), FACTORY, 100)) == (50, 410, 40)
    assert shares(plan(command(2000, 50, 10, 10, linear=True), FACTORY, 100)) == (131, 1826, 43)


def test_extra_pulses_go_into_the_cruise_but_not_into_a_truncated_command() -> None:
    drive = Drive(ustep=3)
    # manual, Appendix C: M1000Un becomes 8000 + n pulses
    assert plan(command(1000, 100, extra=5), drive).pulses == 8005
    assert plan(command(100, 100, extra=5), drive).pulses == 800
    assert plan(command(180, 100, extra=5), drive).pulses == 180 * 8 + 5
    assert plan(command(100, 9, extra=5), drive).pulses == 805


def test_microsteps_multiply_pulses_and_leave_the_steps() -> None:
    profile = plan(command(200, 100), Drive(ustep=4))
    assert shares(profile) == (90, 20, 90)
    assert profile.pulses == 3200


def test_pulse_mode_shares_out_pulses() -> None:
    profile = plan(command(2000, 100, pulses=True), Drive(ustep=3))
    assert shares(profile) == (720, 560, 720)
    assert profile.pulses == 2000
    # 101 pulses of 720 + 720: no full steps to cut to
    assert shares(plan(command(101, 100, pulses=True), Drive(ustep=3))) == (50, 0, 51)


@pytest.mark.parametrize(
    ("ihd", "xclk", "period"), [(8, 0, 6000), (0, 0, 6008), (10, 4, 6002), (9, 0, 5999)]
)
def test_ihd_and_xclk_tune_every_pulse_by_half_a_microsecond(
    ihd: int, xclk: int, period: int
) -> None:
    profile = plan(command(200, 100, 999, 999), Drive(ihd=ihd, xclk=xclk))
    assert profile.duration == 200 * period


def test_a_period_is_never_below_one_tick() -> None:
    profile = plan(command(200, 60_000, 999, 999), Drive(ihd=255))
    assert profile.duration == 200


def test_zero_acceleration_acts_as_none() -> None:
    # spec, "Division by nothing"
    assert shares(plan(command(200, 100, 0, 0), FACTORY)) == (0, 200, 0)
    assert shares(plan(command(200, 100, 0, 0, linear=True), FACTORY)) == (0, 200, 0)
    for _ in range(2):  # the second time from memory
        assert plan(command(200, 100, 1, 0), FACTORY).kept_rpm == 100
        assert plan(command(200, 100, 1, 0, linear=True), FACTORY).kept_rpm == 100


def test_a_speed_of_32_bits_is_planned_at_once() -> None:
    for linear in (False, True):
        motion = Motion(2**32 - 1, True, 2**32 - 1, 1, 1, 1, linear)
        for start in (0, 2**32 - 1):
            profile = plan(motion, Drive(ustep=7), start)
            assert profile.pulses == (2**32 - 1) * 128
            assert profile.duration is not None
            assert profile.time_of(profile.pulses) == profile.duration
        endless = plan(Motion(None, True, 2**32 - 1, 1, 1, 1, linear), Drive(ustep=7))
        assert endless.pulses_at(2**40) > 2**32


def test_negative_steps_are_refused() -> None:
    with pytest.raises(ValueError, match="negative"):
        plan(command(-1, 100), FACTORY)


def test_no_steps_are_no_motion() -> None:
    profile = plan(command(0, 100), FACTORY)
    assert (profile.pulses, profile.duration) == (0, 0)
    assert profile.pulse_times(0, 1000).size == 0


@given(
    first=motions(),
    steps=st.integers(1, 3_000),
    extra=st.integers(0, 255),
    start=st.integers(0, 99),
    auto=st.booleans(),
)
def test_what_a_drive_remembers_of_ramps_changes_no_plan(
    first: Motion, steps: int, extra: int, start: int, auto: bool
) -> None:
    drive = Drive(ustep=2, auto_micro=auto)
    plan(first, drive, start)
    second = replace(first, steps=steps, extra_pulses=extra)
    known, fresh = plan(second, drive, start), plan(second, replace(drive), start)
    assert (known.shares, known.duration, known.kept_rpm) == (
        fresh.shares,
        fresh.duration,
        fresh.kept_rpm,
    )


def test_a_drive_does_not_remember_without_bound() -> None:
    drive = Drive()
    for steps in range(5_000):
        plan(command(100_000, 100 + steps), drive)
    assert 0 < len(drive.whole_ramps) <= 4_096
