"""Warnings of what the hardware cannot do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sacbus.language import Motion
from sacbus.motion import Drive, Limit, plan
from tests.motion.test_planner import command

FACTORY = Drive()


def limits(motion: Motion, drive: Drive = FACTORY, start: int = 0) -> set[Limit]:
    return {caution.limit for caution in plan(motion, drive, start).warnings}


@pytest.mark.parametrize(
    ("motion", "drive", "start", "expected"),
    [
        pytest.param(command(200, 100), FACTORY, 0, set(), id="nothing"),
        pytest.param(command(0, 700), FACTORY, 0, set(), id="no pulse"),
        # spec, "Limits": a ramp longer than the command
        pytest.param(command(200, 100, 0.5), FACTORY, 0, {Limit.TARGET}, id="truncated"),
        # spec, "Truncation": a fall at the start of DECEL is obeyed
        pytest.param(command(50, 100), FACTORY, 100, {Limit.FALL}, id="fall from V"),
        pytest.param(
            command(100, 100), FACTORY, 200, {Limit.FALL, Limit.TARGET}, id="fall from a ramp down"
        ),
        pytest.param(
            command(20, 100, 10, 10, linear=True), FACTORY, 100, {Limit.FALL}, id="linear fall"
        ),
        pytest.param(
            command(200, 100, 10, 10, linear=True), FACTORY, 0, {Limit.TARGET}, id="no linear fall"
        ),
        pytest.param(command(50, 100, 999), FACTORY, 0, set(), id="from rest into DECEL"),
        pytest.param(command(20, 100, 50, 1), FACTORY, 0, {Limit.TARGET}, id="all at slow"),
        # manual, "Discussion": about 300 RPM with 16x microstepping, some 52 us
        pytest.param(
            command(9000, 300, 50, 50, linear=True),
            Drive(ustep=4),
            0,
            set(),
            id="linear 300 RPM, 62.5 us",
        ),
        pytest.param(
            command(9000, 400, 50, 50, linear=True),
            Drive(ustep=4),
            0,
            {Limit.LINEAR},
            id="linear 400 RPM, 47 us",
        ),
        pytest.param(command(9000, 400, 50, 50), Drive(ustep=4), 0, set(), id="harmonic 400 RPM"),
        pytest.param(
            command(9000, 100, 50, 50, linear=True),
            Drive(ustep=4),
            400,
            {Limit.LINEAR},
            id="linear down from 400 RPM",
        ),
        # manual, "V": above 600 RPM better a cycle
        pytest.param(command(9000, 700), FACTORY, 0, {Limit.COARSE}, id="v700"),
        pytest.param(replace(command(9000, 700), cycle_us=430), FACTORY, 0, set(), id="vc430"),
        pytest.param(
            replace(command(9000, 700), by_cycle=True), FACTORY, 0, set(), id="vc428, which is v700"
        ),
        pytest.param(command(9000, 600), FACTORY, 0, set(), id="v600"),
        pytest.param(
            replace(command(9000, 1), rpm=0, cycle_us=400_000),
            Drive(pull_in_rpm=1),
            0,
            set(),
            id="below 1 RPM",
        ),
        # manual, "Slow speed": a pulse of 1 us and a rest of 1 us
        pytest.param(
            replace(command(9000, 600, 999), rpm=600, cycle_us=12),
            Drive(ustep=3),
            0,
            {Limit.PERIOD},
            id="1.5 us",
        ),
        pytest.param(
            command(9000, 600, 999),
            Drive(pulse_us=500),
            0,
            {Limit.CLOCK},
            id="clk as wide as the period",
        ),
        pytest.param(command(9000, 600, 999), Drive(pulse_us=499), 0, set(), id="clk just narrow"),
        pytest.param(
            replace(command(9000, 600, 999), cycle_us=100),
            Drive(ihd=255),
            0,
            {Limit.PERIOD, Limit.FLOOR, Limit.CLOCK},
            id="tuned down to one tick",
        ),
        pytest.param(
            command(500, 100, 999), Drive(pull_in_rpm=99), 0, {Limit.PULL_IN}, id="jump from rest"
        ),
        pytest.param(command(500, 100, 999), Drive(pull_in_rpm=99), 100, set(), id="no jump, kept"),
        pytest.param(
            command(500, 200, 999), Drive(pull_in_rpm=99), 100, {Limit.STALL}, id="jump, kept"
        ),
        pytest.param(
            command(900, 200, 1, 1),
            Drive(pull_in_rpm=99, pull_out=((150, 90),)),
            0,
            {Limit.STALL},
            id="faster than the curve goes",
        ),
        pytest.param(command(500, 100), Drive(pull_in_rpm=99), 0, set(), id="ramp below pull-in"),
    ],
)
def test_a_command_is_warned_of(
    motion: Motion, drive: Drive, start: int, expected: set[Limit]
) -> None:
    assert limits(motion, drive, start) == expected


def test_a_warning_is_a_sentence_with_its_numbers() -> None:
    (caution,) = plan(command(50, 100), FACTORY, 100).warnings
    assert str(caution) == "deceleration sets in at 59 RPM, straight from 100 RPM"


def test_a_stall_is_told_with_its_pulse() -> None:
    drive = Drive(pull_in_rpm=99, pull_out=((150, 90),))
    (caution,) = plan(command(900, 200), drive).warnings
    assert str(caution) == "the motor stalls at pulse 141: it turns at 150 RPM at most"
    (caution,) = plan(command(900, 200, 999), Drive(pull_in_rpm=99)).warnings
    assert str(caution) == (
        "from rest to 200 RPM at once: the motor pulls in up to 99 RPM and may stall"
    )


def test_in_a_coarse_gear_a_fall_is_told_by_full_steps_all_the_same() -> None:
    drive = Drive(ustep=4, auto_micro=True)
    # Of 27 steps, deceleration sets in at 278 RPM: more than a step of 10 below 300. Not so of 28.
    for steps, start, expected in (
        (27, 300, {Limit.FALL}),
        (28, 300, set()),
        (20, 0, {Limit.TARGET}),
    ):
        assert limits(command(steps, 300, 10, 10), drive, start) == expected
