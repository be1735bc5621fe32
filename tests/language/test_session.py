from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    NO_RAMP,
    Acceleration,
    Deceleration,
    Defaults,
    Motion,
    Move,
    Session,
    Velocity,
    parse,
)
from tests.language.strategies import moves

FACTORY = Session()


def resolved(line: str, session: Session = FACTORY) -> tuple[Motion, Session]:
    command = parse(line).command
    assert isinstance(command, Move)
    return session.resolve(command)


def test_a_session_starts_from_the_system_defaults() -> None:
    assert Session.start(Defaults()) == FACTORY
    assert (FACTORY.rpm, FACTORY.cycle_us, FACTORY.acc100, FACTORY.dec100) == (100, 3000, 100, 100)
    linear = Session.start(Defaults(linear=True, cycle_us=6000, sprf=400, full_step=False))
    assert (linear.rpm, linear.cycle_us) == (25, 6000)
    assert (linear.acc100, linear.dec100, linear.linear) == (1047, 1047, True)
    assert not linear.full_step


def test_a_bare_move_takes_everything_from_the_session() -> None:
    motion, after = resolved("m200")
    assert motion == Motion(200, True, 100, 3000, 100, 100, False)
    assert after is FACTORY


@pytest.mark.parametrize(
    ("line", "rpm", "cycle_us"),
    [
        ("m1v100", 100, 3000),  # manual, "V"
        ("m1v59", 59, 5084),  # manual, "Timing"
        ("m1v61", 61, 4918),  # manual, "Timing"
        ("m1v101", 101, 2970),  # manual, "Cycle processing"
        ("m1v65", 65, 4615),  # manual, "V"
        ("m1vc4567", 65, 4567),  # manual, "V"
        ("m1vc42567", 7, 42567),  # manual, "V"
        ("m1v100vc4567", 65, 4567),
        ("m1vc4567v100", 100, 3000),
        ("m1vc300001", 0, 300001),
        ("m1v300001", 300001, 1),
        ("m1v4294967295", 4294967295, 1),
    ],
)
def test_rpm_and_cycle_follow_each_other_in_whole_numbers(
    line: str, rpm: int, cycle_us: int
) -> None:
    motion, after = resolved(line)
    assert (motion.rpm, motion.cycle_us) == (rpm, cycle_us)
    assert (after.rpm, after.cycle_us) == (rpm, cycle_us)


def test_the_cycle_depends_on_the_steps_of_a_revolution() -> None:
    session = Session.start(Defaults(sprf=400))
    assert resolved("m1v100", session)[0].cycle_us == 1500
    assert resolved("m1vc1500", session)[0].rpm == 100


@pytest.mark.parametrize("line", ["m1v", "m1v0", "m1vc0"])
def test_a_velocity_of_nothing_is_the_default_cycle(line: str) -> None:
    session = FACTORY.with_velocity(Velocity(250))
    motion, after = resolved(line, session)
    assert (motion.rpm, motion.cycle_us) == (100, 3000)
    assert (after.rpm, after.cycle_us) == (100, 3000)


def test_velocity_acceleration_deceleration_and_ramp_stay_in_the_session() -> None:
    _, after = resolved("m200v120a.8d1.2l1")
    assert after == Session(120, 2500, 80, 120, linear=True)


def test_steps_direction_extras_wait_sync_and_unit_do_not_stay() -> None:
    motion, after = resolved("m-200u5t9sp")
    assert motion == Motion(200, False, 100, 3000, 100, 100, False, 5, 9, True, True)
    assert after is FACTORY


def test_the_parameters_of_continuous_motion_are_thrown_away() -> None:
    # Manual, "Continuous": mv120a.8d1.2 leaves 100 RPM, 1.0 and 1.0.
    for line in ("mv120a.8d1.2l1", "m0v120a.8d1.2l1"):
        motion, after = resolved(line)
        assert motion == Motion(None, True, 120, 2500, 80, 120, True)
        assert after is FACTORY


def test_unary_velocity_acceleration_and_deceleration_stay() -> None:
    # Manual, "Continuous": v120, a.8, d1.2, m.
    session = (
        FACTORY.with_velocity(Velocity(120))
        .with_acceleration(Acceleration(80))
        .with_deceleration(Deceleration(120))
    )
    assert resolved("m", session)[0] == Motion(None, True, 120, 2500, 80, 120, False)


def test_bare_unaries_bring_back_the_defaults_of_the_present_ramp() -> None:
    session = Session(7, 8, 9, 10, linear=True)
    assert session.with_acceleration(Acceleration()).acc100 == 1047
    assert session.with_deceleration(Deceleration()).dec100 == 1047
    after = session.with_velocity(Velocity())
    assert (after.rpm, after.cycle_us) == (100, 3000)
    assert Session(7, 8, 9, 10).with_acceleration(Acceleration()).acc100 == 100
    assert Session(7, 8, 9, 10).with_deceleration(Deceleration()).dec100 == 100


@pytest.mark.parametrize(
    ("lines", "by_cycle"),
    [
        (["m1"], True),  # the default velocity is a cycle
        (["m1v625"], False),
        (["m1vc480"], True),
        (["m1v625", "m1"], False),
        (["m1v625", "m1vc480", "m1"], True),
        (["m1vc480", "m1v"], True),
        (["v625", "m1"], False),
        (["v625", "vc480", "m"], True),
    ],
)
def test_a_velocity_is_known_to_be_a_cycle_even_where_it_is_that_of_an_rpm(
    lines: list[str], by_cycle: bool
) -> None:
    # 480 us are 625 RPM exactly.
    session = FACTORY
    for line in lines[:-1]:
        command = parse(line).command
        if isinstance(command, Velocity):
            session = session.with_velocity(command)
        else:
            _, session = resolved(line, session)
    assert resolved(lines[-1], session)[0].by_cycle is by_cycle


def test_a_unary_cycle_sets_the_rpm_too() -> None:
    after = FACTORY.with_velocity(Velocity(None, 4567))
    assert (after.rpm, after.cycle_us) == (65, 4567)


@pytest.mark.parametrize(
    ("line", "acc100", "dec100"),
    [
        ("m5l1", 1047, 1047),
        ("m5l1a5", 500, 1047),
        ("m5a5l1", 500, 1047),
        ("m5d5l1", 1047, 500),
        ("m5adl1", 1047, 1047),
        ("m5l0", 100, 100),
        ("m5ad", 100, 100),
        ("m5", 333, 444),
    ],
)
def test_the_ramp_applies_first_and_brings_its_own_defaults(
    line: str, acc100: int, dec100: int
) -> None:
    session = Session(acc100=333, dec100=444)
    motion, after = resolved(line, session)
    assert (motion.acc100, motion.dec100) == (acc100, dec100)
    assert (after.acc100, after.dec100, after.linear) == (acc100, dec100, motion.linear)


def test_no_sign_is_the_default_direction_and_minus_its_opposite() -> None:
    ccw = Session.start(Defaults(cw=False))
    assert resolved("m5")[0].cw
    assert not resolved("m-5")[0].cw
    assert not resolved("m5", ccw)[0].cw
    assert resolved("m-5", ccw)[0].cw


def test_full_steps_or_pulses_is_the_sessions_choice_unless_the_command_says() -> None:
    pulses = FACTORY.with_full_step(full_step=False)
    assert not resolved("m5")[0].pulses
    assert resolved("m5p")[0].pulses
    assert resolved("m5", pulses)[0].pulses
    assert not resolved("m5f", pulses)[0].pulses
    assert resolved("m5v50", pulses)[1].full_step is False


def test_the_system_command_for_the_ramp_brings_its_defaults() -> None:
    linear = FACTORY.with_ramp(linear=True)
    assert (linear.linear, linear.acc100, linear.dec100) == (True, 1047, 1047)
    assert linear.with_ramp(linear=False) == FACTORY


def test_accelerations_of_zero_have_no_ramp() -> None:
    assert resolved("m5a0d0")[0] == Motion(5, True, 100, 3000, NO_RAMP, NO_RAMP, False)


defaults = st.builds(
    Defaults,
    cycle_us=st.integers(1, 2**32 - 1),
    acc100=st.integers(1, NO_RAMP),
    linear=st.booleans(),
    sprf=st.integers(1, 65535),
    cw=st.booleans(),
    full_step=st.booleans(),
)


def by_hand(move: Move, session: Session) -> Motion:
    """The same rules, told one after the other: slow and obvious."""
    system = session.defaults
    if move.linear is not None:
        session = session.with_ramp(linear=move.linear)
    if move.rpm is not None:
        session = session.with_velocity(Velocity(move.rpm))
    if move.cycle_us is not None:
        session = session.with_velocity(Velocity(None, move.cycle_us))
    if move.acc100 is not None:
        session = session.with_acceleration(Acceleration(move.acc100))
    if move.dec100 is not None:
        session = session.with_deceleration(Deceleration(move.dec100))
    return Motion(
        steps=None if move.continuous else move.steps,
        cw=not system.cw if move.opposite else system.cw,
        rpm=session.rpm,
        cycle_us=session.cycle_us,
        acc100=session.acc100,
        dec100=session.dec100,
        linear=session.linear,
        extra_pulses=0 if move.extra_pulses is None else move.extra_pulses,
        wait_us=0 if move.wait_us is None else move.wait_us,
        sync=move.sync is True,
        pulses=not session.full_step if move.pulses is None else move.pulses,
    )


@given(st.lists(moves, min_size=1, max_size=4), defaults)
def test_any_sequence_resolves_as_the_rules_say_one_by_one(
    sequence: list[Move], system: Defaults
) -> None:
    session = Session.start(system)
    for move in sequence:
        motion, after = session.resolve(move)
        assert motion == by_hand(move, session)
        assert motion.cycle_us >= 1
        if move.continuous:
            assert after is session
        else:
            assert after == Session(
                motion.rpm,
                motion.cycle_us,
                motion.acc100,
                motion.dec100,
                motion.linear,
                session.full_step,
                system,
            )
        assert (after is session) == (after == session)
        session = after


def test_each_changed_value_alone_makes_a_new_session() -> None:
    for move in (
        Move(1, rpm=101),
        Move(1, cycle_us=3001),
        Move(1, acc100=1),
        Move(1, dec100=1),
        Move(1, linear=True, acc100=100, dec100=100),
    ):
        assert FACTORY.resolve(move)[1] != FACTORY
    assert FACTORY.resolve(Move(1, rpm=BARE, acc100=BARE, dec100=BARE, linear=False))[1] is FACTORY


def test_the_same_cycle_with_another_rpm_is_another_session() -> None:
    # 701 RPM is a cycle of 427 us, which is 702 RPM.
    _, by_rpm = resolved("m1v701")
    _, by_cycle = resolved("m1vc427", by_rpm)
    assert (by_rpm.rpm, by_rpm.cycle_us) == (701, 427)
    assert (by_cycle.rpm, by_cycle.cycle_us) == (702, 427)
