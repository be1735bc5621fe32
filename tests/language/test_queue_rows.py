"""Rows of the queue: what an edit makes of one, and what clears and seeds them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    NO_RAMP,
    Defaults,
    Edit,
    EditQueue,
    Motion,
    Move,
    Session,
    Velocity,
    cleared_row,
    edited,
    parse,
    seeded_row,
)
from tests.language.strategies import edits, moves

FACTORY = Defaults()
ROW = Motion(800, True, 150, 2000, 120, 80, False, 3, 3000, sync=True, pulses=True)


def edit_of(line: str) -> Edit:
    command = parse(line).command
    assert isinstance(command, EditQueue)
    return command.edit


@pytest.mark.parametrize(
    ("line", "motion"),
    [
        # Manual, Appendix E: position 9 as the app showed it afterwards.
        (
            "q9m-2000vc1500a1d1l0pu0s0t0",
            Motion(2000, False, 200, 1500, 100, 100, False, 0, 0, sync=False, pulses=True),
        ),
        # What is not named is left alone.
        ("q1v59", replace(ROW, rpm=59, cycle_us=5084)),
        ("q1vc4567", replace(ROW, rpm=65, cycle_us=4567)),
        ("q1v", replace(ROW, rpm=100, cycle_us=3000)),
        ("q1a2.5", replace(ROW, acc100=250)),
        ("q1d999", replace(ROW, dec100=NO_RAMP)),
        ("q1ad", replace(ROW, acc100=100, dec100=100)),
        ("q1u0", replace(ROW, extra_pulses=0)),
        ("q1u9", replace(ROW, extra_pulses=9)),
        ("q1t0", replace(ROW, wait_us=0)),
        # Manual, "sync": Qnns0 toggles it off.
        ("q1s0", replace(ROW, sync=False)),
        ("q1s", ROW),
        ("q1f", replace(ROW, pulses=False)),
        ("q1p", ROW),
        # Manual, "Queue": 8m2000; these are full steps, whatever the command is set for, unless P
        # is added.
        ("q8m2000", replace(ROW, steps=2000, pulses=False)),
        ("q8m2000p", replace(ROW, steps=2000)),
        ("q8m0", replace(ROW, steps=None, pulses=False)),
        # M alone is its direction.
        ("q1m-", replace(ROW, cw=False)),
        ("q1m", ROW),
        # L alone is the ramp; a bare A or D is of the new one, wherever L stands.
        ("q1l1", replace(ROW, linear=True)),
        ("q1l1ad5", replace(ROW, linear=True, acc100=1047, dec100=500)),
        ("q1dl1", replace(ROW, linear=True, dec100=1047)),
        ("q1l0", ROW),
    ],
)
def test_an_edit_replaces_what_it_names(line: str, motion: Motion) -> None:
    assert edited(ROW, edit_of(line), FACTORY) == motion


def test_no_sign_is_the_default_direction_and_minus_its_opposite() -> None:
    ccw = Defaults(cw=False)
    assert not edited(ROW, edit_of("q1m"), ccw).cw
    assert edited(replace(ROW, cw=False), edit_of("q1m-"), ccw).cw


def test_a_ramp_that_stays_gives_the_defaults_of_a_bare_a() -> None:
    linear = replace(ROW, linear=True)
    assert edited(linear, edit_of("q1ad"), FACTORY) == replace(linear, acc100=1047, dec100=1047)


motions = moves.map(lambda move: Session().resolve(move)[0])
systems = st.builds(
    Defaults,
    cycle_us=st.integers(1, 2**32 - 1),
    linear_acc100=st.integers(1, NO_RAMP),
    sprf=st.integers(1, 65_535),
    cw=st.booleans(),
    full_step=st.booleans(),
)


@given(motions, edits, systems)
def test_fields_that_are_not_named_stay(motion: Motion, edit: Edit, system: Defaults) -> None:
    after = edited(motion, edit, system)
    if edit.opposite is None:
        assert after.cw is motion.cw
    if edit.steps is None:
        assert after.steps == motion.steps
        if edit.pulses is None:
            assert after.pulses is motion.pulses
    if edit.rpm is None and edit.cycle_us is None:
        assert (after.rpm, after.cycle_us) == (motion.rpm, motion.cycle_us)
    for name in ("acc100", "dec100", "linear", "extra_pulses", "wait_us", "sync"):
        if getattr(edit, name) is None:
            assert getattr(after, name) == getattr(motion, name)


@given(motions, edits, systems)
def test_an_edit_made_twice_is_as_if_made_once(
    motion: Motion, edit: Edit, system: Defaults
) -> None:
    once = edited(motion, edit, system)
    assert edited(once, edit, system) == once


@given(motions, moves, systems)
def test_an_edit_that_names_everything_makes_what_the_command_itself_means(
    motion: Motion, move: Move, system: Defaults
) -> None:
    whole = Move(
        move.steps or 0,
        move.opposite,
        move.rpm if move.rpm is not None or move.cycle_us is not None else BARE,
        move.cycle_us,
        BARE if move.acc100 is None else move.acc100,
        BARE if move.dec100 is None else move.dec100,
        bool(move.linear),
        move.extra_pulses or 0,
        move.wait_us or 0,
        bool(move.sync),
        bool(move.pulses),
    )
    meant, _ = Session.start(system).resolve(whole)
    assert edited(motion, edit_of("q9" + whole.text()), system) == meant


def test_a_cleared_row_is_one_revolution_clockwise_by_the_session_defaults() -> None:
    session = Session.start(Defaults(sprf=400, cw=False)).with_velocity(Velocity(120))
    session = replace(session, acc100=80, dec100=120)
    assert cleared_row(session) == Motion(400, True, 120, 1250, 80, 120, False)
    pulses = session.with_full_step(full_step=False).with_ramp(linear=True)
    assert cleared_row(pulses) == Motion(400, True, 120, 1250, 1047, 1047, True, pulses=True)


def test_a_seeded_row_is_by_the_system_defaults() -> None:
    assert seeded_row(FACTORY) == Motion(200, True, 100, 3000, 100, 100, False)
    assert seeded_row(Defaults(linear=True, cycle_us=6000, full_step=False)) == Motion(
        200, True, 50, 6000, 1047, 1047, True, pulses=True
    )
