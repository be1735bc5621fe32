"""The motor model: what it follows, where it stalls, and how far its rotor gets."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.motion import Drive, Entry, Profile, PullOut, Slip, lost, plan, slips
from tests.motion.reference import Pulse, Run, Setup, run
from tests.motion.strategies import drive_of, motions, setups
from tests.motion.test_against_reference import walkable
from tests.motion.test_planner import command

MOTOR = Drive(pull_in_rpm=120)
CURVE = ((200, 60), (600, 20))
STRONG = Drive(pull_in_rpm=120, pull_out=CURVE)
REST = Entry()


def where(profile: Profile, entry: Entry = REST) -> list[tuple[int, int | None]]:
    return [slip[:2] for slip in slips(profile.course, profile.drive, entry)]


def test_a_motor_of_which_nothing_is_known_never_stalls() -> None:
    assert where(plan(command(200, 5_000, 999, 999), Drive())) == []


def test_it_starts_from_rest_up_to_its_pull_in_speed() -> None:
    # manual, "Infinite Acceleration": beyond V' the motor stalls
    assert where(plan(command(200, 120, 999, 999), MOTOR)) == []
    (slip,) = slips(plan(command(200, 121, 999, 999), MOTOR).course, MOTOR, REST)
    assert slip == Slip(0, None, "from rest to 121 RPM at once")


def test_on_a_ramp_it_passes_its_pull_in_speed() -> None:
    assert where(plan(command(2_000, 500), MOTOR)) == []
    assert where(plan(command(2_000, 500, 50, 50, linear=True), MOTOR)) == []


def test_a_jump_from_speed_to_speed_may_be_as_large_as_one_from_rest() -> None:
    for start, rpm, follows in (
        (280, 400, True),
        (279, 400, False),
        (320, 200, True),
        (321, 200, False),
    ):
        gone = where(plan(command(200, rpm, 999, 999), MOTOR, start), Entry(start))
        assert gone == ([] if follows else [(0, None)])


def test_a_reversal_is_followed_up_to_half_the_pull_in_speed() -> None:
    # manual, "Queue": the discussion of half of V'
    for rpm, expected in ((60, []), (61, [(0, 1)]), (121, [(0, None)])):
        profile = plan(command(200, rpm, 999, 999), MOTOR, rpm)
        assert where(profile, Entry(-float(rpm))) == expected


def test_a_stalled_motor_is_with_the_pulses_again_below_its_pull_in_speed() -> None:
    profile = plan(command(1_000, 500, 999, 10), MOTOR)
    # Down from 500: 49 steps, the j-th from the end at 10 + 10 j.
    assert where(profile) == [(0, 1_000 - 12)]
    assert slips(profile.course, MOTOR, REST)[0].why == "from rest to 500 RPM at once"
    assert where(profile, Entry(500, stalled=True)) == [(0, 1_000 - 12)]
    assert where(plan(command(200, 100), MOTOR), Entry(100, stalled=True)) == []


def test_a_ramp_of_giant_steps_is_a_row_of_jumps() -> None:
    profile = plan(command(1_000, 1_000, 200, 999), MOTOR)
    assert where(profile) == [(1, None)]
    assert slips(profile.course, MOTOR, REST)[0].why == "a ramp in steps of 200 RPM"
    # With microsteps the steps are smaller, but for the last: from 710 to 1000 RPM.
    assert where(plan(command(1_000, 1_000, 200, 999), replace(MOTOR, ustep=1))) == [(8, None)]


@pytest.mark.parametrize("ustep", [0, 3])
@pytest.mark.parametrize("auto_micro", [False, True])
def test_a_harmonic_ramp_asks_for_more_the_faster_it_is(ustep: int, auto_micro: bool) -> None:
    drive = replace(STRONG, ustep=ustep, auto_micro=auto_micro)
    # 2 pi * acc * v * sprf / 3600: at 1 RPM a step 0.349 rad/s2 for each RPM. The curve from 200
    # on is 80 - v / 10: they cross at 178 RPM, where the curve is still flat, at 60.
    profile = plan(command(4_000, 500), drive)
    ((first, until),) = where(profile)
    assert until is not None
    crossing = 60 / (math.pi * 200 / 1800)
    assert profile.velocity_at(profile.time_of(first)) == pytest.approx(crossing, rel=0.01)
    assert profile.velocity_at(profile.time_of(until)) == pytest.approx(120, rel=0.01)
    assert profile.state_at(profile.time_of(until)).name == "DECEL"
    assert slips(profile.course, drive, REST)[0].why == "60 rad/s² at 172 RPM"


def test_a_linear_ramp_asks_for_the_same_at_every_speed() -> None:
    profile = plan(command(9_000, 500, 40, 40, linear=True), STRONG)
    ((first, until),) = where(profile)
    assert until is not None
    # 80 - v / 10 = 40
    assert profile.velocity_at(profile.time_of(first)) == pytest.approx(400, rel=0.01)
    assert profile.velocity_at(profile.time_of(until)) == pytest.approx(120, rel=0.02)
    assert where(plan(command(9_000, 500, 29, 29, linear=True), STRONG)) == []


def test_a_way_down_is_asked_as_much_as_a_way_up() -> None:
    profile = plan(command(9_000, 500, 10, 40, linear=True), STRONG)
    ((first, until),) = where(profile)
    assert profile.state_at(profile.time_of(first)).name == "DECEL"
    down = plan(command(9_000, 300, 40, 999, linear=True), STRONG, 500)
    ((first, until),) = where(down, Entry(500))
    assert first == 0
    assert until is None


def test_a_weak_stretch_of_the_curve_is_met_on_the_way() -> None:
    drive = Drive(pull_in_rpm=120, pull_out=((100, 90), (200, 10), (300, 90), (900, 50)))
    ((first, until),) = where(plan(command(9_000, 600, 30, 999, linear=True), drive))
    # 90 - 0.8 (v - 100) = 30 at 175 RPM; once stalled it stays behind.
    profile = plan(command(9_000, 600, 30, 999, linear=True), drive)
    assert profile.velocity_at(profile.time_of(first)) == pytest.approx(175, rel=0.02)
    assert until is None


def test_a_curve_that_rises_lets_a_motor_that_has_stalled_come_along() -> None:
    drive = Drive(pull_in_rpm=250, pull_out=((100, 10), (300, 90), (900, 90)))
    profile = plan(command(9_000, 600, 50, 999, linear=True), drive)
    ((first, until),) = where(profile)
    assert first == 0
    assert until is not None
    # 10 + 0.4 (v - 100) = 50
    assert profile.velocity_at(profile.time_of(until)) == pytest.approx(200, rel=0.01)


def test_a_single_pulse_beyond_the_curve_is_one_too_many() -> None:
    drive = Drive(pull_in_rpm=160, pull_out=((150, 9_000),))
    profile = plan(command(900, 152), drive)
    # Up to 151 RPM, 152, and down from 151.
    assert where(profile) == [(141, 900 - 141)]


def test_beyond_the_last_speed_of_the_curve_nothing_turns() -> None:
    profile = plan(command(40_000, 700, 5, 999, linear=True), STRONG)
    ((first, until),) = where(profile)
    assert profile.velocity_at(profile.time_of(first)) == pytest.approx(600, rel=0.01)
    assert until is None
    assert slips(profile.course, STRONG, REST)[0].why == "it turns at 600 RPM at most"
    endless = plan(command(None, 700, 999), STRONG)
    assert where(endless, Entry(600)) == [(0, None)]


def test_the_rotor_is_behind_by_what_it_has_lost() -> None:
    drive = replace(MOTOR, ustep=2)
    profile = plan(command(1_000, 500, 999, 10), drive)
    gone = slips(profile.course, drive, REST)
    # Pulse j from the end runs at 10 + 10 j / 4: 45 of them at 120 RPM at most.
    assert gone == [Slip(0, 3_955, "from rest to 500 RPM at once")]
    behind = [lost(profile.course, gone, pulses) for pulses in (0, 1, 3_955, 3_956, 4_000)]
    assert behind == [0, 1, 3_955, 3_955, 3_955]
    for_ever = plan(command(None, 500, 999), drive)
    assert lost(for_ever.course, slips(for_ever.course, drive, REST), 10**12) == 10**12


def test_in_a_coarse_gear_it_loses_more_with_a_pulse() -> None:
    drive = Drive(ustep=4, auto_micro=True, pull_in_rpm=50)
    profile = plan(command(100, 400, 999, 999), drive)
    gone = slips(profile.course, drive, REST)
    assert (profile.pulses, lost(profile.course, gone, 7)) == (200, 7 * 8)


def test_a_profile_without_a_pulse_stalls_nothing() -> None:
    assert where(plan(command(0, 500, 999), MOTOR), Entry(500, stalled=True)) == []


@pytest.mark.parametrize(
    ("pull_in", "pull_out", "message"),
    [
        (0, (), "pulls in at 1 RPM"),
        (None, CURVE, "needs a pull-in speed"),
        (100, ((300, 5), (300, 4)), "rise"),
        (100, ((300, 5), (200, 4)), "rise"),
        (100, ((-1, 5),), "rise from 0"),
        (100, ((0, 5), (200, -4)), "never negative"),
    ],
)
def test_a_motor_that_cannot_be_is_refused(
    pull_in: int | None, pull_out: tuple[tuple[int, int], ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Drive(pull_in_rpm=pull_in, pull_out=pull_out)


# ---- pulse by pulse ------------------------------------------------------------------------------


def followed(run: Run, setup: Setup, drive: Drive, entry: Entry) -> list[bool]:
    """Whether the rotor is with each pulse, asked of one after the other."""
    assert drive.pull_in_rpm is not None
    before, stalled = entry.rpm, entry.stalled
    seen = []
    for number, pulse in enumerate(run.pulses):
        m = setup.m // pulse.weight
        rpm = 120_000_000 / (setup.sprf * m * pulse.period)
        new_leg = number == 0 or not alike(run.pulses[number - 1], pulse)
        fault = new_leg and abs(rpm - before) > drive.pull_in_rpm
        acceleration = 0.0
        if pulse.rung:
            acceleration = pulse.rung[1] / 100
        elif pulse.state != "CRUISE" and not pulse.held:
            acc100 = run.motion.acc100 if pulse.state == "ACCEL" else run.motion.dec100
            acceleration = 2 * math.pi * acc100 / 100 * rpm * setup.sprf / 3600
            fault = fault or (not new_leg and acc100 / 100 / m > drive.pull_in_rpm)
        fault = fault or beyond(drive.pull_out, rpm, acceleration)
        stalled = fault or (stalled and rpm > drive.pull_in_rpm)
        seen.append(not stalled)
        before = rpm
    return seen


def alike(before: Pulse, after: Pulse) -> bool:
    """Whether two pulses are of one stretch: of a ramp in one gear, or of even speed."""
    return (before.state, before.held, before.weight, before.rung is None) == (
        after.state,
        after.held,
        after.weight,
        after.rung is None,
    )


def beyond(curve: PullOut, rpm: float, acceleration: float) -> bool:
    """Whether a pull-out curve has less than that acceleration at that velocity."""
    if not curve:
        return False
    if rpm > curve[-1][0]:
        return True
    if rpm <= curve[0][0]:
        return acceleration > curve[0][1]
    (low, most), (high, more) = next(line for line in pairwise(curve) if rpm <= line[1][0])
    return acceleration > most + (rpm - low) / (high - low) * (more - most)


curves = st.lists(
    st.tuples(st.integers(0, 900), st.integers(0, 300)),
    max_size=4,
    unique_by=lambda point: point[0],
).map(lambda points: tuple(sorted(points)))


@pytest.mark.slow
@settings(max_examples=300)
@given(
    data=st.data(),
    setup=setups,
    start=st.sampled_from([0, 0, 80, 400]),
    pull_in=st.sampled_from([20, 60, 150, 400]),
    curve=curves,
    entry=st.sampled_from([REST, Entry(80), Entry(-400), Entry(400, stalled=True)]),
)
def test_the_motor_follows_the_pulses_that_the_reference_has_it_follow(
    data: st.DataObject, setup: Setup, start: int, pull_in: int, curve: PullOut, entry: Entry
) -> None:
    motion = data.draw(motions(setup.sprf, steps=max(10, 2_000 // setup.m)))
    motion = walkable(setup, motion, start)
    drive = replace(drive_of(setup), pull_in_rpm=pull_in, pull_out=curve)
    profile, reference = plan(motion, drive, start), run(motion, setup, start)
    with_it = followed(reference, setup, drive, entry)
    gone = slips(profile.course, drive, entry)
    expected = [True] * len(with_it)
    for first, until, why in gone:
        assert why
        expected[first:until] = [False] * len(expected[first:until])
    assert expected == with_it
    # Not one slip behind another without a pulse between them that is followed.
    assert all(
        before.until is not None and before.until < after.first for before, after in pairwise(gone)
    )
    half = len(with_it) // 2
    behind = sum(
        pulse.weight
        for pulse, follows in zip(reference.pulses[:half], with_it, strict=False)
        if not follows
    )
    assert lost(profile.course, gone, half) == behind
