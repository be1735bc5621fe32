from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    Command,
    Mode,
    Motion,
    Move,
    Session,
    Velocity,
    describe,
    parse,
    parse_in,
)
from tests.language.strategies import commands, moves, nearly_commands


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("m3000a2d1", "move 3000 full steps, acceleration 2.00, deceleration 1.00"),
        ("m1", "move 1 full step"),
        ("m1p", "move 1 pulse"),
        ("m-40p", "move 40 pulses in the opposite direction"),
        ("mv120", "move continuously at 120 RPM"),
        ("m0", "move continuously"),
        ("m-", "move continuously in the opposite direction"),
        ("m5vc1500", "move 5 full steps at a cycle of 1500 us"),
        ("m5v", "move 5 full steps at the default velocity"),
        ("m5ad999", "move 5 full steps, default acceleration, no deceleration ramp"),
        ("m5l1", "move 5 full steps, linear ramp"),
        ("m5l0a.05", "move 5 full steps, acceleration 0.05, harmonic ramp"),
        (
            "m5u1t9s",
            "move 5 full steps, 1 extra pulse, after a wait of 9 us, held for sync",
        ),
        ("m5u2t0s0f", "move 5 full steps, 2 extra pulses"),
        ("v100", "set the velocity to 100 RPM"),
        ("vc3000", "set the velocity to a cycle of 3000 us"),
        ("v", "set the velocity to the default velocity"),
        ("vd", "show the velocity"),
        ("a1.5", "set: acceleration 1.50"),
        ("d", "set: default deceleration"),
        ("S", "stop at once"),
        ("s", "stop with grace"),
        ("N", "end the present command at once, go on"),
        ("n", "end the present command with grace, go on"),
        ("y", "release sync"),
        ("++-", "single pulses: 2 clockwise, 1 back"),
        ("\x11", "motion has begun (DC1)"),
        ("\x12", "motion has ended (DC2)"),
        ("", "empty line"),
        (" hello", "message 'hello'"),
        (".caf\xe9\x1b", "message 'caf\\xe9\\x1b'"),
        ("85m3000", "for node 85: 'm3000'"),
        ("/ hi", "for the last sender: ' hi'"),
        (
            "xm-40ad",
            (
                "thrown away afterwards: move 40 full steps in the opposite direction, "
                "default acceleration, default deceleration"
            ),
        ),
        ("q", "show the queue"),
        ("qp", "enter the program mode of the queue"),
        (
            "q9m-2000vc1500a1d1l0pu0s0t0",
            (
                "edit queue position 9: move 2000 pulses, in the opposite direction, "
                "at a cycle of 1500 us, acceleration 1.00, deceleration 1.00, harmonic ramp, "
                "no extra pulses, no wait, not held for sync"
            ),
        ),
        (
            "q1u1t9s",
            "edit queue position 1: 1 extra pulse, after a wait of 9 us, held for sync",
        ),
        ("q1p", "edit queue position 1: counted in pulses"),
        ("q1f", "edit queue position 1: counted in full steps"),
        ("q1m", "edit queue position 1: in the default direction"),
        (
            "q1m0l1",
            "edit queue position 1: move continuously, in the default direction, linear ramp",
        ),
        ("q1m-0", "edit queue position 1: move continuously, in the opposite direction"),
        ("q1v", "edit queue position 1: at the default velocity"),
        ("qs", "save the queue"),
        ("qr", "restore the queue as it was saved"),
        ("qc", "clear the queue to the session defaults"),
        ("ls9", "loop from queue position 9"),
        ("lf12", "loop up to queue position 12"),
        ("ln1", "the next loop runs once"),
        ("ln2", "the next loop runs 2 times"),
        ("ln", "the next loop runs for ever"),
        ("la", "loop over the whole queue"),
        ("l", "end the loop with grace"),
        ("l5", "run the xRef array 5 times"),
        ("xl", "run the xRef array for ever"),
        ("x9", "run queue position 9 at once"),
        ("xp", "enter the program mode of the xRef array"),
        ("xp1,3", "xRef entry 1 is queue position 3"),
        ("xp4,0", "the xRef array ends before entry 4"),
        ("xd", "show the xRef array"),
        ("g", "toggle GAP testing"),
        ("b", "toggle debug mode"),
        ("cc", "show the configuration"),
        ("cf", "show the session defaults"),
        ("z", "undo the last change of the queue"),
        ("$C", "enter the configure screen"),
        ("$CA8", "store autorun = 8"),
        ("$Cd1.5", "store acc = 1.5"),
        ("$CU21", "store the pins 001 for 1/4 steps"),
        ("$CU00", "store the pins 000 for full steps"),
        ("$E", "show the EEPROM"),
        ("$F", "count full steps in this session"),
        ("$P", "count pulses in this session"),
        ("$U", "toggle between full steps and pulses"),
        ("$H", "send CRCs in this session"),
        ("$H0", "send no CRCs in this session"),
        ("$K", "send ACK and NAK in this session"),
        ("$K0", "send neither ACK nor NAK in this session"),
        ("$L1", "linear ramps in this session"),
        ("$L0", "harmonic ramps in this session"),
        ("$n", "toggle the encoder between throttle and follow"),
        ("$O1", "send soft ops in this session"),
        ("$O0", "send no soft ops in this session"),
        ("$R", "warm reboot"),
        (
            "k",
            "nothing (column 1: expected a SAC command, got 'k': the line does nothing)",
        ),
        (
            "m5u300",
            (
                "move 5 full steps (column 4: expected the number of extra pulses, at most 255, "
                "got 300: they are ignored)"
            ),
        ),
    ],
)
def test_lines_in_words(line: str, words: str) -> None:
    assert describe(parse(line)) == words


def test_the_line_that_leaves_a_mode_in_words() -> None:
    assert describe(parse_in(Mode.QUEUE, "x")) == "leave this mode"


def test_a_command_is_described_as_its_line_is() -> None:
    assert describe(Velocity(100)) == describe(parse("v100"))


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (
            Motion(200, True, 100, 3000, 100, 50, False),
            (
                "move 200 full steps clockwise at 100 RPM (cycle 3000 us), acceleration 1.00, "
                "deceleration 0.50, harmonic ramp"
            ),
        ),
        (
            Motion(None, False, 7, 42567, 1047, 99900, True, 3, 20, True, True),
            (
                "move continuously counterclockwise at 7 RPM (cycle 42567 us), acceleration 10.47, "
                "no deceleration ramp, linear ramp, 3 extra pulses, after a wait of 20 us, "
                "held for sync"
            ),
        ),
    ],
)
def test_motions_in_words(motion: Motion, words: str) -> None:
    assert describe(motion) == words


@given(commands | moves.map(lambda move: Session().resolve(move)[0]))
def test_every_command_and_motion_has_words_on_one_printable_line(what: Command | Motion) -> None:
    words = describe(what)
    assert words.isprintable()
    assert words


@given(st.binary(max_size=60) | nearly_commands)
def test_every_line_has_words_on_one_printable_line(line: bytes | str) -> None:
    words = describe(parse(line))
    assert words.isprintable()
    assert words


def test_a_moves_direction_is_told_only_when_it_is_the_opposite() -> None:
    assert "opposite" not in describe(Move(5))
