"""Any line: no exception, no silence, one language for prompt and modes, columns, the short cut."""

from __future__ import annotations

from dataclasses import fields

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sacbus.language import (
    Command,
    Edit,
    Empty,
    Forward,
    Leave,
    Message,
    Mode,
    Move,
    Next,
    Parsed,
    ReleaseSync,
    ShowConfiguration,
    ShowSession,
    Stop,
    ToggleDebug,
    ToggleGap,
    Undo,
    columns,
    grammar,
    parse,
    parse_in,
)
from tests.language.strategies import commands, modes, nearly_commands, nearly_moves

NOTHING = "the line does nothing"

# --- any line ----------------------------------------------------------------------------------

lines = st.binary(max_size=300) | st.text() | nearly_moves | nearly_commands


@pytest.mark.slow
@given(lines, modes)
@example("m" + "9" * 5000, Mode.PROMPT)
@example("m1a" + "9" * 5000, Mode.PROMPT)
@example("9" * 5000, Mode.PROMPT)
@example("9" * 5000, Mode.QUEUE)
@example("1," + "9" * 5000, Mode.REFERENCES)
@example("A" + "9" * 5000, Mode.CONFIGURE)
@example("H" + "9" * 5000, Mode.CONFIGURE)
@example("/" * 5000, Mode.PROMPT)
@example("m" + "a1" * 5000, Mode.PROMPT)
@example("m" + "a1" * 5000 + "!", Mode.PROMPT)
@example("q9" + "a1" * 5000 + "!", Mode.PROMPT)
@example("l" + "0" * 5000 + "7", Mode.PROMPT)
def test_no_line_raises_and_what_does_nothing_says_why(line: bytes | str, mode: Mode) -> None:
    parsed = parse_in(mode, line)
    assert parsed.command is not None or parsed.remarks
    for remark in parsed.remarks:
        assert 1 <= remark.column <= len(line) + 1
        assert remark.expected
        assert remark.got
        assert remark.text
        assert str(remark).isprintable()


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


@given(st.binary(max_size=46) | nearly_commands.map(str.encode), modes)
def test_trailing_spaces_and_what_follows_change_nothing_in_a_command(
    body: bytes, mode: Mode
) -> None:
    before = parse_in(mode, body).command
    if not isinstance(before, Message | Forward | Empty):
        assert parse_in(mode, body + b" ").command == before
        assert parse_in(mode, body + b"  m5").command == before


@given(nearly_moves | nearly_commands.filter(lambda line: line[:1] not in tuple("sSnNyY$./ ")))
def test_commands_are_alike_in_either_case(line: str) -> None:
    upper, lower = parse(line.upper()).command, parse(line.lower()).command
    if not isinstance(upper, Forward):
        assert upper == lower


@pytest.mark.parametrize("line", ["s", "n", "y", "$n", "$R", "$CA8", "$Ca8", "$CU21", "$Cu1"])
def test_case_counts_where_only_one_of_two_is_a_command_or_both_are_different_ones(
    line: str,
) -> None:
    assert parse(line).command is not None
    assert parse(line.swapcase()).command != parse(line).command


def test_bytes_and_text_mean_the_same() -> None:
    assert parse(b"m\xff") == parse("m\xff")
    assert parse(b".caf\xe9") == Parsed(Message(".café"))
    assert parse_in(Mode.QUEUE, b"8m\xff") == parse_in(Mode.QUEUE, "8m\xff")


def test_characters_that_are_no_byte_become_question_marks() -> None:
    assert parse("85.€") == Parsed(Forward(85, ".?"))
    assert parse_in(Mode.CONFIGURE, "€").remarks[0].got == "'?'"


def test_a_line_longer_than_any_packet_is_read_but_not_remembered() -> None:
    line = "m200" + "v100" * 100
    before = grammar._parse.cache_info().currsize
    assert parse(line) == Parsed(Move(200, rpm=100))
    assert grammar._parse.cache_info().currsize == before


def test_a_repeated_line_comes_from_a_bounded_cache() -> None:
    assert parse("m123v45") is parse(b"m123v45")
    assert grammar._parse.cache_info().maxsize == 4096


# --- single letters ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("S", Stop(grace=False)),
        ("s", Stop(grace=True)),
        ("s all of you", Stop(grace=True)),
        ("N", Next(grace=False)),
        ("n", Next(grace=True)),
        ("y", ReleaseSync()),
        ("G", ToggleGap()),
        ("b", ToggleDebug()),
        ("Cc", ShowConfiguration()),
        ("cF", ShowSession()),
        ("z", Undo()),
        ("Z undo", Undo()),
    ],
)
def test_single_letters_mean(line: str, command: Command) -> None:
    assert parse(line) == Parsed(command)


@pytest.mark.parametrize(
    ("line", "column", "expected"),
    [
        ("STOP", 2, "the end of the command"),
        ("s5", 2, "the end of the command"),
        ("N1", 2, "the end of the command"),
        ("yy", 2, "the end of the command"),
        ("gg", 2, "the end of the command"),
        ("B1", 2, "the end of the command"),
        ("z9", 2, "the end of the command"),
        ("Y", 1, "y in lower case"),
        ("c", 2, "C or F after C"),
        ("cx", 2, "C or F after C"),
        ("ccc", 3, "the end of the command"),
        ("\x11\x11", 2, "the end of the command"),
        ("k5", 1, "a SAC command"),
        ("\x00", 1, "a SAC command"),
        ("\xb2m5", 1, "a SAC command"),
    ],
)
def test_what_is_no_command_says_where_and_why(line: str, column: int, expected: str) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.expected, remark.text) == (column, expected, NOTHING)


# --- modes -------------------------------------------------------------------------------------

INSIDE = [mode for mode in Mode if mode is not Mode.PROMPT]


@given(lines)
def test_at_the_prompt_a_mode_changes_nothing(line: bytes | str) -> None:
    assert parse_in(Mode.PROMPT, line) == parse(line)


@pytest.mark.parametrize("mode", INSIDE)
@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("x", Leave()),
        ("X", Leave()),
        ("x rest", Leave()),
        ("", Empty()),
        ("   ", Empty()),
        ("S", Stop(grace=False)),
        ("s", Stop(grace=True)),
    ],
)
def test_every_mode_can_be_left_and_lets_the_motor_be_stopped(
    mode: Mode, line: str, command: Command
) -> None:
    assert parse_in(mode, line) == Parsed(command)


@pytest.mark.parametrize("mode", INSIDE)
@pytest.mark.parametrize("line", ["xx", "S5", "sx", " x", "/x", ".hi", "$R", "w200", "+", "q"])
def test_a_mode_knows_no_other_lines(mode: Mode, line: str) -> None:
    parsed = parse_in(mode, line)
    assert parsed.command is None
    assert parsed.remarks


# --- columns -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "where"),
    [
        ("m200v100", {"opposite": 1, "steps": 2, "rpm": 5}),
        ("m-200a1", {"opposite": 2, "steps": 3, "acc100": 6}),
        ("m5v7vc9", {"opposite": 1, "steps": 2, "cycle_us": 5}),
        ("m5vc9v", {"opposite": 1, "steps": 2, "rpm": 6}),
        ("m5a1a2", {"opposite": 1, "steps": 2, "acc100": 5}),
        ("m5u9u300", {"opposite": 1, "steps": 2, "extra_pulses": 3}),
        ("xm5", {"opposite": 2, "steps": 3}),
        ("q12d1l0u1t5sp", {
            "position": 2, "dec100": 4, "linear": 6, "extra_pulses": 8, "wait_us": 10, "sync": 12,
            "pulses": 13,
        }),
        ("v59", {"rpm": 1}),
        ("a1", {"acc100": 2}),
        ("d", {"dec100": 2}),
        ("+-", {"signs": 1}),
        ("ls9", {"position": 3}),
        ("ln5", {"count": 3}),
        ("l5", {"count": 2}),
        ("xp1,3", {"index": 3, "position": 5}),
        ("$H0", {"on": 3}),
        ("$L1", {"linear": 3}),
        ("$CA8", {"parameter": 3, "value": 4}),
        ("$CU21", {"exponent": 4, "pins": 5}),
        ("85.hi", {"destination": 1, "rest": 3}),
        ("/hi", {"rest": 2}),
        (".hi", {"body": 1}),
        ("q", {}),
        ("$H", {}),
        ("m200x", {}),
    ],
)  # fmt: skip
def test_each_field_of_a_command_has_its_column(line: str, where: dict[str, int]) -> None:
    assert columns(line) == where
    assert columns(line.encode()) == where


def test_in_a_mode_columns_count_from_its_own_line() -> None:
    assert columns("8m2000", Mode.QUEUE) == {"position": 1, "opposite": 2, "steps": 3}
    assert columns("1,3", Mode.REFERENCES) == {"index": 1, "position": 3}
    assert columns("A14", Mode.CONFIGURE) == {"parameter": 1, "value": 2}


def fields_of(command: Command) -> dict[str, object]:
    """Values by name, those of the move or the edit in a command among them."""
    values: dict[str, object] = {}
    for field in fields(command):
        value = getattr(command, field.name)
        if isinstance(value, Move | Edit):
            values |= {inner.name: getattr(value, inner.name) for inner in fields(value)}
        else:
            values[field.name] = value
    return values


@given(lines, modes)
def test_columns_are_of_fields_and_within_the_line(line: bytes | str, mode: Mode) -> None:
    command = parse_in(mode, line).command
    where = columns(line, mode)
    values = {} if command is None else fields_of(command)
    for name, column in where.items():
        assert values[name] is not None
        assert 1 <= column <= len(line) + 1


@given(commands)
def test_every_value_that_a_line_gives_has_a_column(command: Command) -> None:
    given_values = {name for name, value in fields_of(command).items() if value is not None}
    said_by_the_letter_alone = {"grace", "start", "full_step", "on"}
    assert given_values - set(columns(command.text())) <= said_by_the_letter_alone
