from __future__ import annotations

from dataclasses import FrozenInstanceError

import pytest
from hypothesis import given

from sacbus.language import (
    BARE,
    NO_RAMP,
    Acceleration,
    Command,
    Deceleration,
    Empty,
    Forward,
    Message,
    Move,
    Next,
    Parsed,
    ReleaseSync,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    Stop,
    Velocity,
    parse,
)
from tests.language.strategies import commands


@given(commands)
def test_every_command_printed_and_read_again_is_itself(command: Command) -> None:
    assert parse(command.text()) == Parsed(command)
    assert parse(command.text().encode("latin-1")) == Parsed(command)


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (Move(), "m"),
        (Move(opposite=True), "m-"),
        (Move(0), "m0"),
        # Lines of the companion's own list, without their x.
        (Move(1200, rpm=160, acc100=BARE, dec100=BARE), "m1200v160ad"),
        (Move(20000, rpm=350, acc100=20, dec100=20, wait_us=2000000), "m20000v350a.2d.2t2000000"),
        (Move(400, acc100=BARE, dec100=BARE, sync=True), "m400ads"),
        (Move(40, opposite=True, acc100=BARE, dec100=BARE), "m-40ad"),
        # The manual's queue edit, "QP" and "EEPROM", without its q9.
        (
            Move(
                2000,
                opposite=True,
                cycle_us=1500,
                acc100=100,
                dec100=100,
                linear=False,
                extra_pulses=0,
                wait_us=0,
                sync=False,
                pulses=True,
            ),
            "m-2000vc1500a1d1l0u0t0s0p",
        ),
        (Move(1, rpm=BARE, acc100=NO_RAMP, dec100=1, linear=True, pulses=False), "m1va999d.01l1f"),
        (Move(1, acc100=1047, dec100=150), "m1a10.47d1.5"),
        (Velocity(), "v"),
        (Velocity(59), "v59"),
        (Velocity(None, 4567), "vc4567"),
        (ShowVelocity(), "vd"),
        (Acceleration(), "a"),
        (Acceleration(80), "a.8"),
        (Deceleration(1000), "d10"),
        (Deceleration(), "d"),
        (Stop(grace=False), "S"),
        (Stop(grace=True), "s"),
        (Next(grace=False), "N"),
        (Next(grace=True), "n"),
        (ReleaseSync(), "y"),
        (SinglePulses("+-+"), "+-+"),
        (SoftOp(start=True), "\x11"),
        (SoftOp(start=False), "\x12"),
        (Empty(), ""),
        (Message(" hello"), " hello"),
        (Forward(85, "m3000a2d1"), "85m3000a2d1"),
        (Forward(None, "hi"), "/hi"),
    ],
)
def test_commands_print_in_the_manuals_shortest_form(command: Command, text: str) -> None:
    assert command.text() == text
    assert parse(text) == Parsed(command)


def test_a_move_without_steps_or_with_none_is_continuous() -> None:
    assert Move().continuous
    assert Move(0).continuous
    assert not Move(1).continuous


def test_a_command_cannot_be_changed_since_parsed_lines_are_shared() -> None:
    command = parse("m200").command
    assert isinstance(command, Move)
    with pytest.raises(FrozenInstanceError):
        command.steps = 1  # type: ignore[misc]
