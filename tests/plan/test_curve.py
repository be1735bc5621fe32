"""The points of a picture: the motion as it is, few where there is nothing to see."""

from __future__ import annotations

import pytest

from sacbus.motion import Drive, State
from sacbus.plan import Commands, Plan
from sacbus.plan.curve import POINTS, Curve, curve_of


def curve(*lines: str, drive: Drive | None = None) -> Curve:
    plan = Plan(Commands(lines), drive or Drive())
    return curve_of(plan, plan.survey())


def test_few_pulses_are_followed_one_by_one() -> None:
    drawn = curve("m3v60a30d999")
    # 10 RPM for 30 ms, then 60 RPM: 5 ms a step. Standing before, and nothing after.
    assert list(zip(drawn.seconds, drawn.rpm, drawn.pulses, strict=True)) == [
        (0, 0, 0),
        (0, 0, 0),
        (0, 10, 1),
        (0.03, 10, 1),
        (0.03, 60, 2),
        (0.035, 60, 2),
        (0.035, 60, 3),
        (0.04, 60, 3),
        (0.04, 0, 3),
    ]


def test_states_lie_one_after_the_other_from_the_beginning_to_the_end() -> None:
    drawn = curve("m200v100a1d1")
    ((accel, ramp),) = drawn.spans[State.ACCEL]
    ((cruise, even),) = drawn.spans[State.CRUISE]
    ((decel, down),) = drawn.spans[State.DECEL]
    assert accel == 0
    assert cruise == pytest.approx(accel + ramp)
    assert even == pytest.approx(0.06)
    assert decel == pytest.approx(cruise + even)
    assert drawn.marks[0].end == pytest.approx(decel + down) == pytest.approx(1.469006)


def test_a_state_that_does_not_occur_is_not_drawn() -> None:
    spans = curve("m200v9").spans
    assert [state for state, stretches in spans.items() if stretches] == [State.CRUISE]
    assert spans[State.CRUISE][0] == pytest.approx((0, 6.6666), abs=1e-4)


def test_velocity_and_position_are_negative_counterclockwise() -> None:
    drawn = curve("m20", "m-50")
    assert max(drawn.rpm) > 0 > min(drawn.rpm)
    assert drawn.pulses[-1] == -30


def test_the_motor_stands_in_a_wait_and_not_between_seamless_commands() -> None:
    drawn = curve("m500v100d999", "m500", "m100t500000")
    standing = [second for second, rpm in zip(drawn.seconds, drawn.rpm, strict=True) if not rpm]
    first, second, third = drawn.marks
    assert first.end == second.begin
    assert standing == [0, 0, second.end, third.begin, third.end]
    assert third.begin - second.end == pytest.approx(0.500016)


def test_time_never_runs_backwards_and_the_end_is_reached() -> None:
    drawn = curve("m5000v600a.5d.5", "m-4000l1v400a20d3", "m3", drive=Drive(ustep=4))
    assert drawn.seconds == sorted(drawn.seconds)
    assert drawn.pulses[-1] == (5_000 - 4_000 + 3) * 16
    assert max(drawn.rpm) == pytest.approx(600, rel=0.01)


def test_a_picture_costs_the_same_however_many_pulses_there_are() -> None:
    # Two points a pulse that is followed, in two ramps, and little else.
    most = 4 * POINTS + 10
    for ustep in (0, 1, 7):
        assert len(curve("m4000v100a.02d.02", drive=Drive(ustep=ustep)).seconds) <= most
    assert len(curve(*["m4000v600a.2d.2"] * 300).seconds) <= most


def test_an_endless_command_is_followed_for_a_while() -> None:
    drawn = curve("mv100")
    assert drawn.marks[0].endless
    assert drawn.seconds[-1] == pytest.approx(1.7, abs=0.01)
    assert drawn.rpm[-1] == 100
    # After minutes of motion for a quarter of them.
    drawn = curve("m20000v100", "mv100")
    assert drawn.seconds[-1] == pytest.approx(61.55 * 1.25, abs=0.5)
