"""M and XM with all their qualifiers; V, A and D; single pulses."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    NO_RAMP,
    Acceleration,
    Deceleration,
    Move,
    Parsed,
    ShowVelocity,
    SinglePulses,
    ThrowAway,
    Velocity,
    parse,
)
from tests.language.strategies import nearly_moves

NOTHING = "the line does nothing"


def remarked(line: bytes | str) -> list[tuple[int, str]]:
    """Column and consequence of every remark on a line."""
    return [(remark.column, remark.text) for remark in parse(line).remarks]


@pytest.mark.parametrize(
    ("line", "move"),
    [
        # Manual, "Communications", "Continuous", "Queue".
        ("m3000a2d1", Move(3000, acc100=200, dec100=100)),
        ("mv120a.8d1.2", Move(rpm=120, acc100=80, dec100=120)),
        ("m2000u6t50000", Move(2000, extra_pulses=6, wait_us=50000)),
        ("m1000U7", Move(1000, extra_pulses=7)),
        # Spec, "Motion".
        ("m0", Move(0)),
        ("m-0", Move(0, opposite=True)),
        ("m00200", Move(200)),
        ("m 200", Move()),
        ("M200Vc1500", Move(200, cycle_us=1500)),
        ("m200va1", Move(200, rpm=BARE, acc100=100)),
        ("m200s", Move(200, sync=True)),
        ("m200s1", Move(200, sync=True)),
        ("m200S0", Move(200, sync=False)),
        ("m200P", Move(200, pulses=True)),
        ("m200f", Move(200, pulses=False)),
        ("m200L1A", Move(200, linear=True, acc100=BARE)),
        ("m200l0", Move(200, linear=False)),
        ("m4294967295", Move(4294967295)),
        ("m1a5.d05.5", Move(1, acc100=500, dec100=550)),
        ("m1a999d999.0", Move(1, acc100=NO_RAMP, dec100=NO_RAMP)),
        ("m1a100d100.00", Move(1, acc100=10000, dec100=10000)),
        ("m1a99.99d.01", Move(1, acc100=9999, dec100=1)),
        # A qualifier given twice counts once: the last.
        ("m1v100vc2000", Move(1, cycle_us=2000)),
        ("m1vc2000v100", Move(1, rpm=100)),
        ("m1vc2000v", Move(1, rpm=BARE)),
        ("m1a1l0a2l1asps0f", Move(1, acc100=BARE, linear=True, sync=False, pulses=False)),
    ],
)
def test_motion_lines_mean(line: str, move: Move) -> None:
    assert parse(line) == Parsed(move)


@given(st.integers(1, 9999), st.permutations(["v", "a", "d", "l1", "u3", "t9", "s", "p"]))
def test_qualifiers_stand_in_any_order(steps: int, qualifiers: list[str]) -> None:
    whole = Move(steps, False, BARE, None, BARE, BARE, True, 3, 9, True, True)
    assert parse(f"m{steps}" + "".join(qualifiers)) == Parsed(whole)


@pytest.mark.parametrize(
    ("line", "column", "got"),
    [("m4294967296v100", 2, "4294967296"), ("m-99999999999", 3, "99999999999")],
)
def test_steps_beyond_32_bits_are_refused_for_without_them_the_motor_would_never_stop(
    line: str, column: int, got: str
) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.got) == (column, got)
    assert remark.text == "the command is refused: without steps it never ends"


@pytest.mark.parametrize(
    ("line", "move", "column", "consequence"),
    [
        ("m5v4294967296a1", Move(5, acc100=100), 4, "the velocity is ignored"),
        ("m5v7vc4294967296", Move(5, rpm=7), 7, "the velocity is ignored"),
        ("m5v0", Move(5, rpm=BARE), 4, "the default cycle is used"),
        ("m5v9vc000", Move(5, rpm=BARE), 7, "the default cycle is used"),
        ("m5vc0a1", Move(5, rpm=BARE, acc100=100), 5, "the default cycle is used"),
        ("m5u256", Move(5), 4, "they are ignored"),
        ("m5u9u300f", Move(5, extra_pulses=9, pulses=False), 6, "they are ignored"),
        ("m5t4294967296", Move(5), 4, "the wait is ignored"),
        ("m5a1000", Move(5, acc100=NO_RAMP), 4, "999 is used: no ramp"),
        ("m5d00123456.7l1", Move(5, dec100=NO_RAMP, linear=True), 4, "999 is used: no ramp"),
        ("m5a0", Move(5, acc100=NO_RAMP), 4, "it acts as 999: no ramp"),
        ("m5d0.00", Move(5, dec100=NO_RAMP), 4, "it acts as 999: no ramp"),
        ("m5d.009", Move(5, dec100=NO_RAMP), 4, "it acts as 999: no ramp"),
        ("m5a1.239", Move(5, acc100=123), 4, "the rest is cut off"),
        ("m5d100.9", Move(5, dec100=10000), 4, "the rest is cut off"),
        ("m5a999.9", Move(5, acc100=NO_RAMP), 4, "the rest is cut off"),
    ],
)
def test_values_the_device_cannot_hold_are_remarked_and_the_rest_stands(
    line: str, move: Move, column: int, consequence: str
) -> None:
    assert parse(line).command == move
    assert remarked(line) == [(column, consequence)]


def test_the_largest_values_need_no_remark() -> None:
    line = "m4294967295vc4294967295t4294967295u255"
    largest = Move(2**32 - 1, cycle_us=2**32 - 1, wait_us=2**32 - 1, extra_pulses=255)
    assert parse(line) == Parsed(largest)


def test_leading_zeros_need_no_remark() -> None:
    assert parse("m0000000000200v0000000000100a001.5") == Parsed(Move(200, rpm=100, acc100=150))


def test_every_value_of_a_line_that_was_changed_is_remarked() -> None:
    assert [column for column, _ in remarked("m5v0a0d1.001u999")] == [4, 6, 8, 14]


@pytest.mark.parametrize(
    ("line", "column", "expected", "got"),
    [
        ("m200q", 5, "one of V A D L U T S F P, a space or the end", "'q'"),
        ("m+200", 2, "one of V A D L U T S F P, a space or the end", "'+'"),
        ("m200.5", 5, "one of V A D L U T S F P, a space or the end", "'.'"),
        ("m200\r", 5, "one of V A D L U T S F P, a space or the end", "'\\r'"),
        ("m200\tv5", 5, "one of V A D L U T S F P, a space or the end", "'\\t'"),
        ("m200v-5", 6, "one of V A D L U T S F P, a space or the end", "'-'"),
        ("m200s2", 6, "one of V A D L U T S F P, a space or the end", "'2'"),
        ("m200f1", 6, "one of V A D L U T S F P, a space or the end", "'1'"),
        ("m200vc", 7, "the cycle in microseconds", "the end of the command"),
        ("m200vca1", 7, "the cycle in microseconds", "'a'"),
        ("m200a.d1", 7, "the digits of an acceleration", "'d'"),
        ("m200ad.", 8, "the digits of a deceleration", "the end of the command"),
        ("m200l", 6, "0 (harmonic) or 1 (linear) after L", "the end of the command"),
        ("m200l2", 6, "0 (harmonic) or 1 (linear) after L", "'2'"),
        ("m200u t5", 6, "the number of extra pulses", "the end of the command"),
        ("m200tu5", 6, "the start wait in microseconds", "'u'"),
        ("m200a1,5", 7, "one of V A D L U T S F P, a space or the end", "','"),
    ],
)
def test_malformed_motion_does_nothing_and_names_the_column(
    line: str, column: int, expected: str, got: str
) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.expected, remark.got) == (column, expected, got)
    assert remark.text == NOTHING


# --- a throw-away ------------------------------------------------------------------------------

# Lines of a one-shot list as the companion app wrote it.
ONE_SHOT = """
xm1200v160ad xm20000v350a.2d.2t2000000 xm3000v150ad xm4000v160l1ad xm5000v370a.2d1 xm3000v240a.1d1
xm800v160l1a50d30 xm400ads xm-40ad xm1800v200a9d9 xm1600v120a.5d.5 xm10000v490l0a1d1
xm10000v413l1a999d50 xm10000v420l1a900d50 xm-60v20a999d999
"""


@pytest.mark.parametrize("line", ONE_SHOT.split())
def test_lines_of_a_one_shot_list_are_motions_that_are_thrown_away(line: str) -> None:
    # Manual, "Throw-away": any motion command, by prefixing the instruction with X/x.
    move = parse(line[1:]).command
    assert isinstance(move, Move)
    assert parse(line) == Parsed(ThrowAway(move))


@pytest.mark.parametrize("line", ["v159", "vc59568", "vc1900"])
def test_velocity_lines_of_a_one_shot_list_are_read(line: str) -> None:
    command = parse(line).command
    assert isinstance(command, Velocity)
    assert command.text() == line


@given(nearly_moves, st.sampled_from("xX"))
def test_a_throw_away_is_read_as_the_motion_behind_its_x(line: str, x: str) -> None:
    motion = parse(line)
    thrown = parse(x + line)
    if motion.command is None:
        assert thrown.command is None
    else:
        assert thrown.command == ThrowAway(motion.command)  # type: ignore[arg-type]
    assert [(one.column + 1, one.got, one.text) for one in motion.remarks] == [
        (one.column, one.got, one.text) for one in thrown.remarks
    ]


# --- session defaults and single pulses --------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "parsed"),
    [
        # Manual, "Continuous" and "V".
        ("v120", Parsed(Velocity(120))),
        ("VC42567", Parsed(Velocity(None, 42567))),
        ("v", Parsed(Velocity())),
        ("Vd", Parsed(ShowVelocity())),
        ("vD rest", Parsed(ShowVelocity())),
        ("A1.2", Parsed(Acceleration(120))),
        ("a", Parsed(Acceleration())),
        ("d.5", Parsed(Deceleration(50))),
        ("D", Parsed(Deceleration())),
        ("+++", Parsed(SinglePulses("+++"))),
        ("-+ +", Parsed(SinglePulses("-+"))),
    ],
)
def test_unary_lines_mean(line: str, parsed: Parsed) -> None:
    assert parse(line) == parsed


@pytest.mark.parametrize(
    ("line", "command", "column", "consequence"),
    [
        ("v0", Velocity(), 2, "the default cycle is used"),
        ("vc0", Velocity(), 3, "the default cycle is used"),
        ("v4294967296", None, 2, "the velocity is ignored"),
        ("a0", Acceleration(NO_RAMP), 2, "it acts as 999: no ramp"),
        ("d5000", Deceleration(NO_RAMP), 2, "999 is used: no ramp"),
        ("d1e3", None, 3, NOTHING),
        ("a1x", None, 3, NOTHING),
        ("a.", None, 3, NOTHING),
        ("d.", None, 3, NOTHING),
        ("vc", None, 3, NOTHING),
        ("v10d5", None, 4, NOTHING),
        ("vd1", None, 2, NOTHING),
        ("+2", None, 2, NOTHING),
        ("-m", None, 2, NOTHING),
    ],
)
def test_unary_lines_with_one_remark(
    line: str, command: object, column: int, consequence: str
) -> None:
    assert parse(line).command == command
    assert remarked(line) == [(column, consequence)]
