"""Planned sequences: worked values, session defaults carried on, GAP, loops, the survey."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.motion import Drive
from sacbus.plan import Commands, Plan, PlanError, Planned, plan_sequence

DRIVE = Drive()

Shares = tuple[int, int | None, int]


def shares_of(planned: list[Planned]) -> list[Shares]:
    return [(one.profile.n_acc, one.profile.n_cruise, one.profile.n_dec) for one in planned]


def shares(*lines: str, gap: bool = True, start_rpm: int = 0) -> list[Shares]:
    return shares_of(plan_sequence(lines, DRIVE, gap=gap, start_rpm=start_rpm))


# ------------------------------------------------------------------------ worked values


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
        # The same made to start again each time; the recipe (acc x V = 40) gives 198 + 2 by the
        # rule of truncation.
        (["m200v100a.4d40", "m200v100a.4d40"], [(198, 0, 2), (198, 0, 2)], None),
        # Manual, "Discussion": 10 to 100 RPM, and the factory's own defaults.
        (["m200"], [(90, 20, 90)], 1.469),
        (["m500v100a.5d1"], [(180, 230, 90)], None),
        # Manual, "Discussion": what comes to 300 RPM in one revolution has come to 100 RPM after 22
        # steps; what takes one revolution to 100 RPM takes more than 9 to 300.
        (["m2000v300l1a78.5d78.5", "m2000v100"], [(200, 1600, 200), (22, 1956, 22)], None),
        (["m2000v100l1a8.72d8.72"], [(200, 1600, 200)], None),
        (["m4000v300l1a8.72d8.72"], [(1801, 398, 1801)], None),
    ],
)
def test_worked_values(lines: list[str], expected: list[Shares], seconds: float | None) -> None:
    assert shares(*lines) == expected
    if seconds is not None:
        duration = Plan(Commands(lines), DRIVE).survey().duration
        assert duration is not None
        assert round(duration / 2e6, 3) == seconds


@pytest.mark.parametrize(
    ("dec", "steps"), [(999, 0), (91, 0), (90, 1), (46, 1), (45, 2), (30, 3)], ids=str
)
def test_one_step_of_deceleration_takes_a_value_from_46_to_90(dec: int, steps: int) -> None:
    # Manual, "Profiles".
    assert shares(f"m500v100d{dec}")[0][2] == steps


@pytest.mark.parametrize(
    ("velocity", "cycle_us", "rpm"),
    [
        # Manual, "Cycle processing", "Timing", "V".
        ("v1", 300_000, 1),
        ("v100", 3_000, 100),
        ("v101", 2_970, 101),
        ("v59", 5_084, 59),
        ("v60", 5_000, 60),
        ("v61", 4_918, 61),
        ("v65", 4_615, 65),
        ("v1000", 300, 1_000),
        ("vc42567", 42_567, 7),
        ("vc4567", 4_567, 65),
    ],
)
def test_a_velocity_is_a_cycle_and_an_integer_of_rpm(
    velocity: str, cycle_us: int, rpm: int
) -> None:
    (planned,) = plan_sequence([f"m10{velocity}a999d999"], DRIVE)
    assert (planned.motion.cycle_us, planned.motion.rpm) == (cycle_us, rpm)
    assert planned.profile.duration == 10 * cycle_us * 2


@pytest.mark.parametrize(
    ("line", "ustep", "pulses"),
    [("m1000", 0, 1_000), ("m1000", 3, 8_000), ("m1001", 3, 8_008), ("m1000u6", 3, 8_006)],
)
def test_extra_pulses_are_added_to_microstepped_ones(line: str, ustep: int, pulses: int) -> None:
    # Manual, "$U".
    (planned,) = plan_sequence([line], Drive(ustep=ustep))
    assert planned.profile.pulses == pulses


def test_300_rpm_at_16_microsteps_is_about_what_a_linear_ramp_can_be_computed_for() -> None:
    # Manual, "Micro-stepping": a pulse every 62.5 us; "Discussion": 52 us to compute one.
    at_300, at_400 = plan_sequence(["m2000v300l1a50d50", "m2000v400l1a50d50"], Drive(ustep=4))
    assert at_300.profile.last_period > 0
    assert at_300.profile.drive.cruise_period(at_300.motion.cycle_us) == 125
    assert not at_300.warnings
    assert any("52" in warning for warning in at_400.warnings)


def test_a_linear_ramp_at_10_47_comes_to_100_rpm_in_a_second() -> None:
    # Manual, "Discussion"; the correction of the first period leaves 18 ms.
    (planned,) = plan_sequence(["m2000v100l1a10.47d10.47"], DRIVE)
    assert planned.profile.time_of(planned.profile.n_acc) / 2e6 == pytest.approx(1, abs=0.03)


# -------------------------------------------------------------------- from one to the next


def test_a_seamless_command_starts_as_the_one_before_ends() -> None:
    first, second = plan_sequence(["m500v100a1d999", "m500v100a1d1"], DRIVE)
    assert second.start == first.end == first.profile.duration
    assert second.profile.start_rpm == 100


def test_after_a_stop_a_command_starts_a_load_time_later() -> None:
    first, second, third = plan_sequence(["m200", "m200", "m200a2"], DRIVE)
    assert first.end is not None
    assert second.end is not None
    assert second.start == first.end + 2 * 16
    assert third.start == second.end + 2 * 40


def test_a_start_wait_outlasts_the_gap_and_without_gap_the_velocity_is_kept() -> None:
    assert shares("m500d999", "m500t10000")[1][0] == 90
    assert shares("m500d999", "m500t10000", gap=False)[1][0] == 0


def test_a_wait_within_the_gap_is_waited_and_keeps_the_velocity() -> None:
    # One period of 3000 us: 2984 and a load time of 16.
    first, second = plan_sequence(["m500d999", "m500t2984d999"], DRIVE)
    assert second.profile.n_acc == 0
    assert first.end is not None
    assert second.start == first.end + 2 * 3_000
    assert shares("m500d999", "m500t2985d999")[1][0] == 90


def test_velocity_and_ramps_on_lines_of_their_own_hold_for_what_follows() -> None:
    assert shares("v120", "a2", "d1", "m400") == shares("m400v120a2d1")
    # V, A and D of a command hold on as well (manual, "Session defaults").
    assert shares("m400v120a2d1", "m400")[1] == shares("m400v120a2d1")[0]


def test_the_ramp_and_the_unit_of_steps_hold_for_what_follows() -> None:
    assert shares("$L1", "m2000") == shares("m2000l1")
    first, second = plan_sequence(["$P", "m80", "$F", "m80"], Drive(ustep=3))
    assert (first.profile.pulses, second.profile.pulses) == (80, 640)


def test_a_throw_away_takes_the_session_and_leaves_it_alone() -> None:
    # Manual, "Throw-away"; the companion's lists are made of these.
    assert shares("v120", "xm400a2", "m400") == [shares("m400v120a2d1")[0], shares("m400v120")[0]]
    assert shares("XM400V200A5", "m400")[1] == shares("m400")[0]


def test_a_throw_away_keeps_its_velocity_as_any_command() -> None:
    assert shares("xm400v160a999d999", "xm400v160ad999")[1] == (0, 400, 0)


def test_a_kept_velocity_may_be_given() -> None:
    assert shares("m200v100", start_rpm=100) == [(0, 110, 90)]


def test_what_a_line_lost_is_warned_of_with_its_column() -> None:
    (planned,) = plan_sequence(["m200u300"], DRIVE)
    assert any("255" in warning for warning in planned.warnings)
    assert planned.remarks[0].column == 6
    # The columns of a throw-away count its x.
    (planned,) = plan_sequence(["xm200u300"], DRIVE)
    assert planned.remarks[0].column == 7


@pytest.mark.parametrize(
    ("lines", "warnings"),
    [
        (
            ["m200l1a1v300d999", "m200"],
            ["goes on from 300 RPM, though the motor was only at 33.81"],
        ),
        (["m300v200d999", "m-300v100d1"], ["turns at once from 200 RPM: nothing slows it down"]),
        # The velocity is lost in the gap: from rest.
        (["m300v200d999", "m-300v100t9000d1"], []),
        (["m300v200d1", "m-300v100"], []),
        (["m300v200d999", "m300v100d1"], []),
    ],
)
def test_what_the_motor_meets_between_two_commands_is_warned_of_at_the_second(
    lines: list[str], warnings: list[str]
) -> None:
    first, second = plan_sequence(lines, DRIVE)
    assert list(second.beginnings) == warnings
    assert second.warnings == warnings
    assert first.beginnings == ()


def test_a_loop_that_turns_is_warned_of_where_it_begins_again() -> None:
    looped = list(Plan(Commands(["m300v50d999", "m-300v50d999"]), DRIVE, loops=3))
    turn = ["turns at once from 50 RPM: nothing slows it down"]
    assert [one.warnings for one in looped] == [[], turn, turn, turn, turn, turn]


def test_a_command_that_is_held_for_sync_says_so() -> None:
    (planned,) = plan_sequence(["m200s"], DRIVE)
    assert planned.warnings == [
        "held for sync until that is released: planned as if that were at once"
    ]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "nothing to plan"),
        (["v100"], "nothing to plan"),
        (["m200", "S"], "'S' is no motion, command 2"),
        (["m200", ""], "'' is no motion, command 2"),
        (["m", "m200"], "'m200' would never run, command 2"),
        (["m200q"], "'m200q' is not understood, command 1 column 5"),
        (["xm200q"], "'xm200q' is not understood, command 1 column 6"),
        (["m4294967296"], "command 1 column 2"),
        (["85m200"], "'85m200' begins with an address, command 1"),
        (["x9"], "'x9' is no motion, command 1, give M…, XM…, V, A, D, $L, $F or $P"),
    ],
)
def test_what_cannot_be_planned_is_told_in_one_line(lines: list[str], message: str) -> None:
    with pytest.raises(PlanError) as told:
        plan_sequence(lines, DRIVE)
    assert message in str(told.value)
    assert "\n" not in str(told.value)


# --------------------------------------------------------------------- loops and the survey


def test_the_second_loop_begins_with_what_the_first_left() -> None:
    looped = Plan(Commands(["m500v100a1d999"]), DRIVE, loops=3)
    assert shares_of(list(looped)) == [(90, 410, 0), (0, 500, 0), (0, 500, 0)]
    survey = looped.survey()
    assert (survey.commands, survey.pulses) == (3, 1_500)
    first, second, third = looped
    assert survey.duration == third.end
    assert (second.start, third.start) == (first.end, second.end)


def test_what_a_loop_leaves_may_take_two_loops_to_settle() -> None:
    # The first loop ends at 100 RPM, the second at 150, and only the third finds what it leaves.
    looped = Plan(Commands(["m500d999", "v150"]), DRIVE, loops=5)
    assert [one.profile.n_acc for one in looped] == [90, 50, 0, 0, 0]
    survey = looped.survey()
    assert survey.told_loops == 3
    assert survey.duration == list(looped)[-1].end


def test_a_start_velocity_counts_for_the_first_loop_alone() -> None:
    looped = Plan(Commands(["m500"]), DRIVE, loops=2, start_rpm=100)
    assert [one.profile.n_acc for one in looped] == [0, 90]


def test_the_survey_of_many_loops_walks_few() -> None:
    walked = 0

    def step() -> None:
        nonlocal walked
        walked += 1

    survey = Plan(Commands(["m500v100a1d999", "m500"]), DRIVE, loops=65_535).survey(step)
    assert walked == 4
    assert (survey.commands, survey.pulses, survey.told_loops) == (131_070, 65_535_000, 2)


@given(
    lines=st.lists(
        st.sampled_from(
            [
                "v150", "a5", "d999", "d1", "m400", "m-40v30d", "m100t2000", "m100v100ad999",
                "m50l1a20d20", "m60l0", "xm20v300a9d999", "m10vc2345p",
            ]
        ),
        min_size=1,
        max_size=6,
    ),
    loops=st.integers(1, 9),
    gap=st.booleans(),
)  # fmt: skip
def test_the_survey_says_what_walking_every_loop_shows(
    lines: list[str], loops: int, gap: bool
) -> None:
    looped = Plan(Commands([*lines, "m30"]), DRIVE, loops=loops, gap=gap)
    survey = looped.survey()
    every = list(looped)
    assert survey.commands == len(every)
    assert survey.pulses == sum(one.profile.pulses or 0 for one in every)
    assert survey.duration == every[-1].end
    assert survey.text_width == max(len(one.line) for one in every)
    # Loops that are not told are as the last that is: the same profiles, that much later.
    once = survey.commands // loops
    last_told = every[(survey.told_loops - 1) * once : survey.told_loops * once]
    for loop in range(survey.told_loops, loops):
        later = (loop + 1 - survey.told_loops) * (survey.loop_duration or 0)
        for told, untold in zip(last_told, every[loop * once : (loop + 1) * once], strict=True):
            assert untold.start == told.start + later
            assert untold.profile.duration == told.profile.duration
            assert untold.warnings == told.warnings


def test_a_plan_that_never_ends_has_no_duration_and_cannot_be_looped() -> None:
    endless = Plan(Commands(["m200", "m"]), DRIVE)
    survey = endless.survey()
    assert (survey.commands, survey.pulses, survey.duration) == (2, None, None)
    with pytest.raises(PlanError, match="'m200' would never run, command 1"):
        Plan(Commands(["m200", "m"]), DRIVE, loops=2).survey()
