from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    NO_RAMP,
    Acceleration,
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
    grammar,
    parse,
)
from tests.language.strategies import nearly_moves

NOTHING = "the line does nothing"


def remarked(line: bytes | str) -> list[tuple[int, str]]:
    """Column and consequence of every remark on a line."""
    return [(remark.column, remark.text) for remark in parse(line).remarks]


# --- any line ----------------------------------------------------------------------------------


@pytest.mark.slow
@given(st.binary(max_size=300) | st.text() | nearly_moves)
@example("m" + "9" * 5000)
@example("m1a" + "9" * 5000)
@example("9" * 5000)
@example("/" * 5000)
@example("m" + "a1" * 5000)
@example("m" + "a1" * 5000 + "!")
def test_no_line_raises_and_what_does_nothing_says_why(line: bytes | str) -> None:
    parsed = parse(line)
    assert parsed.command is not None or parsed.remarks
    for remark in parsed.remarks:
        assert 1 <= remark.column <= len(line) + 1
        assert remark.expected
        assert remark.got


@given(nearly_moves)
@example("m200v100a1d1")
@example("m1a.5d0.05l1u99t999999999s0pvva1.d12.")
@example("m1a1.239d100.9")
@example("m1v100vc2000s1p")
@example("m1vc2000v100")
@example("m1vc2000v")
@example("mv0v")  # a value that is overwritten is remarked all the same
@example("m1a0a1d.00d")
def test_the_short_cut_and_the_readers_are_one_language(line: str) -> None:
    assert parse(line) == grammar._read(line)


def test_the_short_cut_takes_the_lines_it_was_made_for() -> None:
    assert grammar._GOOD.fullmatch("m2345v123a1.5d.8") is not None
    assert grammar._GOOD.fullmatch("M-40vc1500ADl1u9t2000000s0p  rest\n") is not None


@given(st.binary(max_size=46))
def test_trailing_spaces_and_what_follows_change_nothing_in_a_command(body: bytes) -> None:
    before = parse(body).command
    if not isinstance(before, Message | Forward | Empty):
        assert parse(body + b" ").command == before
        assert parse(body + b"  m5").command == before


@given(nearly_moves)
def test_motion_commands_are_alike_in_either_case(line: str) -> None:
    assert parse(line.upper()).command == parse(line.lower()).command


def test_bytes_and_text_mean_the_same() -> None:
    assert parse(b"m\xff") == parse("m\xff")
    assert parse(b".caf\xe9") == Parsed(Message(".café"))


def test_characters_that_are_no_byte_become_question_marks() -> None:
    assert parse("85.€") == Parsed(Forward(85, ".?"))


def test_a_line_longer_than_any_packet_is_read_but_not_remembered() -> None:
    line = "m200" + "v100" * 100
    before = grammar._parse.cache_info().currsize
    assert parse(line) == Parsed(Move(200, rpm=100))
    assert grammar._parse.cache_info().currsize == before


def test_a_repeated_line_comes_from_a_bounded_cache() -> None:
    assert parse("m123v45") is parse(b"m123v45")
    assert grammar._parse.cache_info().maxsize == 4096


# --- motion ------------------------------------------------------------------------------------


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


# --- the others --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "parsed"),
    [
        ("v120", Parsed(Velocity(120))),
        ("VC42567", Parsed(Velocity(None, 42567))),
        ("v", Parsed(Velocity())),
        ("Vd", Parsed(ShowVelocity())),
        ("A1.2", Parsed(Acceleration(120))),
        ("a", Parsed(Acceleration())),
        ("d.5", Parsed(Deceleration(50))),
        ("D", Parsed(Deceleration())),
        ("S", Parsed(Stop(grace=False))),
        ("s", Parsed(Stop(grace=True))),
        ("N", Parsed(Next(grace=False))),
        ("n", Parsed(Next(grace=True))),
        ("y", Parsed(ReleaseSync())),
        ("s all of you", Parsed(Stop(grace=True))),
        ("+++", Parsed(SinglePulses("+++"))),
        ("-+ +", Parsed(SinglePulses("-+"))),
        ("\x11", Parsed(SoftOp(start=True))),
        ("\x12 ", Parsed(SoftOp(start=False))),
        ("", Parsed(Empty())),
        ("   ", Parsed(Empty())),
        (" hello", Parsed(Message(" hello"))),
        (" m200 ", Parsed(Message(" m200 "))),
        (".", Parsed(Message("."))),
        (".hi there", Parsed(Message(".hi there"))),
        ("85m3000a2d1", Parsed(Forward(85, "m3000a2d1"))),
        ("0s", Parsed(Forward(0, "s"))),
        ("85 hello", Parsed(Forward(85, " hello"))),
        ("085.hi", Parsed(Forward(85, ".hi"))),
        ("255", Parsed(Forward(255, ""))),
        ("/m5 rest", Parsed(Forward(None, "m5 rest"))),
        ("/", Parsed(Forward(None, ""))),
        ("//5", Parsed(Forward(None, "/5"))),
    ],
)
def test_lines_mean(line: str, parsed: Parsed) -> None:
    assert parse(line) == parsed
    assert parse(line.encode("latin-1")) == parsed


@pytest.mark.parametrize(
    ("line", "command", "column", "consequence"),
    [
        ("v0", Velocity(), 2, "the default cycle is used"),
        ("vc0", Velocity(), 3, "the default cycle is used"),
        ("v4294967296", None, 2, "the velocity is ignored"),
        ("a0", Acceleration(NO_RAMP), 2, "it acts as 999: no ramp"),
        ("d1e3", None, 3, NOTHING),
        ("a1x", None, 3, NOTHING),
        ("a.", None, 3, NOTHING),
        ("d.", None, 3, NOTHING),
        ("vc", None, 3, NOTHING),
        ("v10d5", None, 4, NOTHING),
        ("vd1", None, 2, NOTHING),
        ("d5000", Deceleration(NO_RAMP), 2, "999 is used: no ramp"),
        ("STOP", None, 2, NOTHING),
        ("s5", None, 2, NOTHING),
        ("N1", None, 2, NOTHING),
        ("yy", None, 2, NOTHING),
        ("Y", None, 1, NOTHING),
        ("+2", None, 2, NOTHING),
        ("-m", None, 2, NOTHING),
        ("\x11\x11", None, 2, NOTHING),
        ("k5", None, 1, NOTHING),
        ("\x00", None, 1, NOTHING),
        ("c", None, 1, NOTHING),
        ("\xb2m5", None, 1, NOTHING),
        ("256m5", Forward(0, "m5"), 1, "0 is used"),
        ("00341/x", Forward(85, "/x"), 1, "85 is used"),
        ("12345678901234567890123", Forward(12345678901234567890123 % 256, ""), 1, "203 is used"),
        ("900000000", Forward(900000000 % 256, ""), 1, "0 is used"),
    ],
)
def test_lines_with_one_remark(line: str, command: object, column: int, consequence: str) -> None:
    assert parse(line).command == command
    assert remarked(line) == [(column, consequence)]


def test_y_in_upper_case_is_told_about_its_case() -> None:
    (remark,) = parse("Y").remarks
    assert remark.expected == "y in lower case"


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("xm400ads", "XM (a throw-away motion)"),
        ("x5", "X (references)"),
        ("q9m-2000vc1500a1d1l0pu0s0t0", "Q (the queue)"),
        ("LS9", "L (loops)"),
        ("L", "L (loops)"),
        ("g", "G (the GAP test)"),
        ("B", "B (debug)"),
        ("cc", "CC (show the configuration)"),
        ("CF", "CF (show the session defaults)"),
        ("z", "Z (undo)"),
        ("$R", "$R (a system command)"),
        ("$", "$ (a system command)"),
        ("$CA8", "$C (a system command)"),
    ],
)
def test_what_sac_knows_and_this_version_does_not_is_refused_by_name(line: str, name: str) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.got) == (1, name)
    assert remark.text == "this version does not have it yet; the line does nothing"


# Lines of a one-shot list as the companion app wrote it.
ONE_SHOT = """
xm1200v160ad xm20000v350a.2d.2t2000000 xm3000v150ad xm4000v160l1ad xm5000v370a.2d1 xm3000v240a.1d1
xm800v160l1a50d30 xm400ads xm-40ad xm1800v200a9d9 xm1600v120a.5d.5 xm10000v490l0a1d1
xm10000v413l1a999d50 xm10000v420l1a900d50 xm-60v20a999d999
"""


@pytest.mark.parametrize("line", ONE_SHOT.split())
def test_one_shot_lines_are_not_known_yet_but_their_motion_is(line: str) -> None:
    assert parse(line).command is None
    parsed = parse(line[1:])
    assert isinstance(parsed.command, Move)
    assert parsed.remarks == ()


@pytest.mark.parametrize("line", ["v159", "vc59568", "vc1900"])
def test_velocity_lines_of_a_one_shot_list_are_read(line: str) -> None:
    command = parse(line).command
    assert isinstance(command, Velocity)
    assert command.text() == line
