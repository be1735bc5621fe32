"""Warnings of what the motor meets between two commands."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sacbus.language import Motion
from sacbus.motion import Drive, plan, transition_warnings
from tests.motion.test_planner import command

FACTORY = Drive()
TURNS = "turns at once from {} RPM: nothing slows it down"
JUMPS = "goes on from {} RPM, though the motor was only at {}"


def ccw(motion: Motion) -> Motion:
    return replace(motion, cw=False)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        pytest.param(command(200, 60, 1, 999), command(200, 100), [], id="goes on"),
        pytest.param(command(200, 60), ccw(command(200, 60)), [], id="turns from rest"),
        # manual, on a loop of one 999: "simply a change of direction"
        pytest.param(
            command(200, 61, 1, 999), ccw(command(200, 20)), [TURNS.format(61)], id="turns"
        ),
        pytest.param(
            command(200, 61, 1, 999),
            ccw(command(200, 5, 999)),
            [TURNS.format(61)],
            id="turns without a ramp",
        ),
        # manual, "Slow speed": slow is the speed of a change of direction
        pytest.param(command(200, 10, 1, 999), ccw(command(200, 100)), [], id="turns at slow"),
        # spec, "Truncation": it hands on V
        pytest.param(
            command(200, 300, 1, 999, linear=True),
            command(500, 300),
            [JUMPS.format(300, 33.81)],
            id="truncated",
        ),
        pytest.param(
            command(200, 100, 0.4, 999),
            command(200, 100, 0.4, 999),
            [JUMPS.format(100, 89.61)],
            id="nearly there",
        ),
        pytest.param(
            command(200, 300, 1, 999, linear=True),
            ccw(command(300, 200)),
            [TURNS.format(33.81), JUMPS.format(300, 33.81)],
            id="truncated and turns",
        ),
        # What begins at a velocity of its own does not go on from the one that was kept.
        pytest.param(
            command(200, 300, 1, 999, linear=True), command(200, 50, 999), [], id="own velocity"
        ),
        pytest.param(
            command(200, 300, 1, 999, linear=True),
            command(200, 300, 1, 1, linear=True),
            [],
            id="decelerates from where the motor is",
        ),
        pytest.param(command(200, 300, 1, 50), command(200, 50), [], id="truncated, decelerates"),
    ],
)
def test_a_jump_and_a_turn_at_speed_are_told(
    first: Motion, second: Motion, expected: list[str]
) -> None:
    before = plan(first, FACTORY)
    after = plan(second, FACTORY, before.kept_rpm)
    assert list(transition_warnings(before, after)) == expected


def test_a_command_too_short_to_come_down_says_how_fast_the_motor_still_was() -> None:
    before = plan(command(50, 100, 1, 999), FACTORY, 300)
    after = plan(command(200, 100), FACTORY, before.kept_rpm)
    assert transition_warnings(before, after) == (
        "goes on from 100 RPM, though the motor was still at 251.05",
    )


def test_a_velocity_that_was_lost_is_no_matter() -> None:
    before = plan(command(200, 61, 1, 999), FACTORY)
    assert transition_warnings(before, plan(ccw(command(200, 20)), FACTORY, 0)) == ()


def test_a_cut_keeps_what_the_motor_does_so_only_a_turn_is_told() -> None:
    whole = plan(command(200, 300, 1, 999, linear=True), FACTORY)
    assert whole.duration is not None
    before = whole.cut(whole.duration // 2)
    onward = plan(command(200, 100), FACTORY, before.kept_rpm)
    assert transition_warnings(before, onward) == ()
    back = plan(ccw(command(200, 100)), FACTORY, before.kept_rpm)
    (told,) = transition_warnings(before, back)
    assert told == TURNS.format(f"{float(before.kept_rpm):g}")


def test_continuous_motion_leaves_nothing_by_itself() -> None:
    endless = plan(command(None, 100), FACTORY)
    assert transition_warnings(endless, plan(command(200, 100), FACTORY, 100)) == ()
