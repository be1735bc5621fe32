"""Planned sequences: worked values, session defaults carried on, GAP, and the two outputs."""

from __future__ import annotations

import pytest

from sacbus.motion import Drive
from sacbus.plan import PlanError, as_json, as_text, plan_sequence

DRIVE = Drive()


def shares(*lines: str, gap: bool = True, start_rpm: int = 0) -> list[tuple[int, int | None, int]]:
    planned = plan_sequence(lines, DRIVE, gap=gap, start_rpm=start_rpm)
    return [(one.profile.n_acc, one.profile.n_cruise, one.profile.n_dec) for one in planned]


@pytest.mark.parametrize(
    ("lines", "expected", "seconds"),
    [
        # Spec, motion, "Worked values"; manual, "Profiles".
        (["m200v100a1d1"], [(90, 20, 90)], 1.469),
        (["m200v100a.5d1"], [(133, 0, 67)], 1.860),
        (["m2000v100l1a50d50"], [(34, 1932, 34)], 6.185),
        (["m2000v100l1a10.47d10.47"], [(166, 1668, 166)], 6.948),
        (["m200v9"], [(0, 200, 0)], 6.667),
        (["m500v100a1d999", "m500v100a1d1"], [(90, 410, 0), (0, 410, 90)], 3.869),
        # Manual, "Profiles": 225 steps of ramp cut to 200, which the next command does not repeat.
        (["m200v100a.4d999", "m200v100a.4d999"], [(200, 0, 0), (0, 200, 0)], None),
    ],
)
def test_worked_values(
    lines: list[str], expected: list[tuple[int, int, int]], seconds: float | None
) -> None:
    assert shares(*lines) == expected
    total = as_json(plan_sequence(lines, DRIVE))["duration_us"]
    if seconds is not None:
        assert round(total / 1e6, 3) == seconds


def test_a_seamless_command_starts_as_the_one_before_ends() -> None:
    first, second = plan_sequence(["m500v100a1d999", "m500v100a1d1"], DRIVE)
    assert second.start == first.profile.duration
    assert second.profile.start_rpm == 100


def test_after_a_stop_a_command_starts_a_load_time_later() -> None:
    first, second, third = plan_sequence(["m200", "m200", "m200a2"], DRIVE)
    assert first.profile.duration is not None
    assert second.profile.duration is not None
    assert second.start == first.profile.duration + 2 * 16
    assert third.start == second.start + second.profile.duration + 2 * 40


def test_a_start_wait_outlasts_the_gap_and_without_gap_the_velocity_is_kept() -> None:
    assert shares("m500d999", "m500t10000")[1][0] == 90
    assert shares("m500d999", "m500t10000", gap=False)[1][0] == 0


def test_velocity_and_ramps_on_lines_of_their_own_hold_for_what_follows() -> None:
    assert shares("v120", "a2", "d1", "m400") == shares("m400v120a2d1")
    # V, A and D of a command hold on as well (manual, "Session defaults").
    assert shares("m400v120a2d1", "m400")[1] == shares("m400v120a2d1")[0]


def test_a_kept_velocity_may_be_given() -> None:
    assert shares("m200v100", start_rpm=100) == [(0, 110, 90)]


def test_json_has_every_figure_and_null_for_what_never_ends() -> None:
    report = as_json(plan_sequence(["m-200v100a.5d1", "m"], Drive(ustep=1)))
    first, second = report["commands"]
    assert first == {
        "command": "m-200v100a.5d1",
        "steps": 200,
        "pulses": 400,
        "n_acc": 133,
        "n_cruise": 0,
        "n_dec": 67,
        "duration_us": first["duration_us"],
        "start_us": 0,
        "peak_rpm": 76.258,
        "profile": "harmonic",
        "direction": "CCW",
        "warnings": ["200 steps are too few for the ramps: 100 RPM is not reached"],
    }
    assert (2 * first["duration_us"]) % 1 == 0
    assert second["start_us"] > first["duration_us"]
    assert (second["steps"], second["pulses"], second["n_cruise"], second["duration_us"]) == (
        (None,) * 4
    )
    assert report["duration_us"] is None


def test_text_has_a_line_a_command_its_warnings_below_and_the_total() -> None:
    assert as_text(plan_sequence(["m200v100a1d1", "m200v100a.5d1"], DRIVE)) == [
        "m200v100a1d1   90 + 20 + 90 steps CW, harmonic, peak 100.00 RPM  1.469006 s",
        "m200v100a.5d1  133 + 0 + 67 steps CW, harmonic, peak 76.01 RPM  1.859606 s",
        "  warning: 200 steps are too few for the ramps: 100 RPM is not reached",
        "total 3.328652 s",
    ]
    assert as_text(plan_sequence(["m-v50p"], DRIVE)) == [
        "m-v50p  40 + endless + 0 pulses CCW, harmonic, peak 50.00 RPM"
    ]


def test_what_a_line_lost_is_warned_of() -> None:
    (planned,) = plan_sequence(["m200u300"], DRIVE)
    assert any("255" in warning for warning in planned.warnings)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "nothing to plan"),
        (["v100"], "nothing to plan"),
        (["m200", "S"], "'S' is no motion, command 2"),
        (["m", "m200"], "'m200' would never run, command 2"),
        (["m200q"], "'m200q' is not understood, command 1 column 5"),
        (["m4294967296"], "command 1 column 2"),
    ],
)
def test_what_cannot_be_planned_is_told_in_one_line(lines: list[str], message: str) -> None:
    with pytest.raises(PlanError) as told:
        plan_sequence(lines, DRIVE)
    assert message in str(told.value)
    assert "\n" not in str(told.value)
