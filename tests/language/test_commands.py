from __future__ import annotations

from dataclasses import FrozenInstanceError
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    NO_RAMP,
    Acceleration,
    ClearQueue,
    Command,
    Configure,
    Deceleration,
    Edit,
    EditQueue,
    Empty,
    EndLoop,
    Forward,
    Leave,
    LoopCommand,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    MapPins,
    Message,
    Mode,
    Move,
    Next,
    OperationCommand,
    Parameter,
    Parsed,
    ProgramQueue,
    ProgramReferences,
    QueueCommand,
    Ramp,
    Reboot,
    ReleaseSync,
    RestoreQueue,
    RunPosition,
    RunReferences,
    SaveQueue,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    SetReference,
    ShowConfiguration,
    ShowMemory,
    ShowQueue,
    ShowReferences,
    ShowSession,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    StepMode,
    Stop,
    SystemCommand,
    ThrowAway,
    ToggleDebug,
    ToggleEncoder,
    ToggleGap,
    ToggleStepMode,
    TrafficCommand,
    UnaryCommand,
    Undo,
    Velocity,
    parse,
    parse_in,
)
from tests.language.strategies import BY_TYPE


@pytest.mark.parametrize("kind", BY_TYPE)
@given(data=st.data())
def test_every_command_printed_and_read_again_is_itself(
    kind: type[Command], data: st.DataObject
) -> None:
    command = data.draw(BY_TYPE[kind])
    assert parse(command.text()) == Parsed(command)
    assert parse(command.text().encode("latin-1")) == Parsed(command)


IN_MODES = (EditQueue, SetReference, SetParameter, MapPins, Stop, Empty)


@pytest.mark.parametrize("kind", IN_MODES)
@given(data=st.data())
def test_what_is_typed_in_a_mode_printed_and_read_there_is_itself(
    kind: type[Command], data: st.DataObject
) -> None:
    command = data.draw(BY_TYPE[kind])
    match command:
        case EditQueue():
            assert parse_in(Mode.QUEUE, command.entry()) == Parsed(command)
        case SetReference():
            assert parse_in(Mode.REFERENCES, command.entry()) == Parsed(command)
        case SetParameter() | MapPins():
            assert parse_in(Mode.CONFIGURE, command.entry()) == Parsed(command)
        case Stop() | Empty():
            for mode in Mode:
                assert parse_in(mode, command.text()) == Parsed(command)
        case _:
            pytest.fail(f"no mode for {command}")


def test_the_line_that_leaves_a_mode_is_itself_in_every_mode_and_nothing_at_the_prompt() -> None:
    for mode in Mode:
        expected = None if mode is Mode.PROMPT else Leave()
        assert parse_in(mode, Leave().text()).command == expected


def test_the_properties_of_this_room_know_every_command() -> None:
    assert set(BY_TYPE) == set(get_args(Command)) - {Leave}


SHORTEST: list[tuple[Command, str]] = [
    (Move(), "m"),
    (Move(opposite=True), "m-"),
    (Move(0), "m0"),
    (Move(1, rpm=BARE, acc100=NO_RAMP, dec100=1, linear=True, pulses=False), "m1va999d.01l1f"),
    (Move(1, acc100=1047, dec100=150), "m1a10.47d1.5"),
    # Lines of the companion's own list.
    (ThrowAway(Move(1200, rpm=160, acc100=BARE, dec100=BARE)), "xm1200v160ad"),
    (
        ThrowAway(Move(20000, rpm=350, acc100=20, dec100=20, wait_us=2000000)),
        "xm20000v350a.2d.2t2000000",
    ),
    (ThrowAway(Move(400, acc100=BARE, dec100=BARE, sync=True)), "xm400ads"),
    (ThrowAway(Move(40, opposite=True, acc100=BARE, dec100=BARE)), "xm-40ad"),
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
    (ShowQueue(), "q"),
    (ProgramQueue(), "qp"),
    # The manual's queue edit, Appendix E; "l0pu0" in another order.
    (
        EditQueue(9, Edit(True, 2000, None, 1500, 100, 100, False, 0, 0, False, True)),
        "q9m-2000vc1500a1d1l0u0t0s0p",
    ),
    (EditQueue(30, Edit(opposite=False)), "q30m"),
    (EditQueue(1, Edit(opposite=True, steps=0)), "q1m-0"),
    (EditQueue(2, Edit(sync=True)), "q2s"),
    (SaveQueue(), "qs"),
    (RestoreQueue(), "qr"),
    (ClearQueue(), "qc"),
    (LoopStart(9), "ls9"),
    (LoopFinish(30), "lf30"),
    (LoopCount(65535), "ln65535"),
    (LoopQueue(), "la"),
    (EndLoop(), "l"),
    (RunReferences(12), "l12"),
    (RunReferences(0), "l0"),
    (RunPosition(8), "x8"),
    (ProgramReferences(), "xp"),
    (SetReference(1, 3), "xp1,3"),
    (ShowReferences(), "xd"),
    (ToggleGap(), "g"),
    (ToggleDebug(), "b"),
    (ShowConfiguration(), "cc"),
    (ShowSession(), "cf"),
    (Undo(), "z"),
    (Configure(), "$C"),
    (SetParameter(Parameter.AUTORUN, 8), "$CA8"),
    (SetParameter(Parameter.L_ACC, 1047), "$Cf10.47"),
    (SetParameter(Parameter.DEC, 50), "$Ce.5"),
    (MapPins(2, 1), "$CU21"),
    (ShowMemory(), "$E"),
    (StepMode(full_step=True), "$F"),
    (StepMode(full_step=False), "$P"),
    (ToggleStepMode(), "$U"),
    (SendCrcs(on=False), "$H0"),
    (SendCrcs(on=True), "$H"),
    (SendAcks(on=False), "$K0"),
    (SendAcks(on=True), "$K"),
    (Ramp(linear=True), "$L1"),
    (Ramp(linear=False), "$L0"),
    (ToggleEncoder(), "$n"),
    (SendSoftOps(on=True), "$O1"),
    (SendSoftOps(on=False), "$O0"),
    (Reboot(), "$R"),
    (SoftOp(start=True), "\x11"),
    (SoftOp(start=False), "\x12"),
    (Empty(), ""),
    (Message(" hello"), " hello"),
    (Forward(85, "m3000a2d1"), "85m3000a2d1"),
    (Forward(None, "hi"), "/hi"),
]


@pytest.mark.parametrize(("command", "text"), SHORTEST)
def test_commands_print_in_the_manuals_shortest_form(command: Command, text: str) -> None:
    assert command.text() == text
    assert parse(text) == Parsed(command)


def test_every_command_has_a_shortest_form_here() -> None:
    assert {type(command) for command, _ in SHORTEST} == set(BY_TYPE)


@pytest.mark.parametrize(
    ("command", "text"),
    [
        # Manual, "Queue" and "xRef"; the configure screen's letters.
        (EditQueue(8, Edit(opposite=False, steps=2000)), "8m2000"),
        (EditQueue(3, Edit(dec100=120)), "3d1.2"),
        (SetReference(1, 3), "1,3"),
        (SetParameter(Parameter.AUTORUN, 14), "A14"),
        (MapPins(2, 1), "U21"),
    ],
)
def test_entries_print_as_they_are_typed_in_their_mode(
    command: EditQueue | SetReference | SetParameter | MapPins, text: str
) -> None:
    assert command.entry() == text


def test_a_move_without_steps_or_with_none_is_continuous() -> None:
    assert Move().continuous
    assert Move(0).continuous
    assert not Move(1).continuous


def test_an_edit_of_nothing_prints_as_nothing() -> None:
    assert Edit().text() == ""


def test_a_command_belongs_to_one_union_alone() -> None:
    unions = (
        UnaryCommand,
        QueueCommand,
        LoopCommand,
        OperationCommand,
        SystemCommand,
        TrafficCommand,
    )
    members = [member for union in unions for member in get_args(union)]
    assert len(members) == len(set(members))
    assert {*members, Move, ThrowAway, Leave} == set(get_args(Command))


def test_a_command_cannot_be_changed_since_parsed_lines_are_shared() -> None:
    command = parse("m200").command
    assert isinstance(command, Move)
    with pytest.raises(FrozenInstanceError):
        command.steps = 1  # type: ignore[misc]
