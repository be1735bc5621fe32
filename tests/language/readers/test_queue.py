"""Q: showing, saving, restoring, clearing, and edits at the prompt and in the program mode."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    NO_RAMP,
    ClearQueue,
    Edit,
    EditQueue,
    Mode,
    Move,
    Parsed,
    ProgramQueue,
    RestoreQueue,
    SaveQueue,
    ShowQueue,
    parse,
    parse_in,
)
from tests.language.strategies import nearly_moves, parts, tails

NOTHING = "the line does nothing"
AN_EDIT = "M or one of V A D L U T S F P, what is to be changed"


@pytest.mark.parametrize(
    ("line", "command"),
    [
        # Manual, "Command buffer" and "Queue".
        ("q", ShowQueue()),
        ("Q", ShowQueue()),
        ("Q what is there", ShowQueue()),
        ("qP", ProgramQueue()),
        ("Qs", SaveQueue()),
        ("QR", RestoreQueue()),
        ("qc", ClearQueue()),
        # Manual, Appendix E.
        (
            "q9m-2000vc1500a1d1l0pu0s0t0",
            EditQueue(9, Edit(True, 2000, None, 1500, 100, 100, False, 0, 0, False, True)),
        ),
        # Manual, "sync".
        ("Q7S", EditQueue(7, Edit(sync=True))),
        ("q7s0", EditQueue(7, Edit(sync=False))),
        ("q7s1", EditQueue(7, Edit(sync=True))),
        # Spec, "Queue": what is not named is left alone.
        ("q30m200", EditQueue(30, Edit(opposite=False, steps=200))),
        ("q01m-", EditQueue(1, Edit(opposite=True))),
        ("q1M", EditQueue(1, Edit(opposite=False))),
        ("q1m0", EditQueue(1, Edit(opposite=False, steps=0))),
        ("q12v", EditQueue(12, Edit(rpm=BARE))),
        ("q12VC3000v70", EditQueue(12, Edit(rpm=70))),
        ("q12ad999", EditQueue(12, Edit(acc100=BARE, dec100=NO_RAMP))),
        ("q12l1", EditQueue(12, Edit(linear=True))),
        ("q12f", EditQueue(12, Edit(pulses=False))),
        ("q12P ", EditQueue(12, Edit(pulses=True))),
    ],
)
def test_lines_of_the_queue_mean(line: str, command: object) -> None:
    assert parse(line) == Parsed(command)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("line", "command"),
    [
        # Manual, "Queue": 8m2000.
        ("8m2000", EditQueue(8, Edit(opposite=False, steps=2000))),
        ("3d1.2", EditQueue(3, Edit(dec100=120))),
        ("30s rest", EditQueue(30, Edit(sync=True))),
    ],
)
def test_lines_of_the_program_mode_mean(line: str, command: EditQueue) -> None:
    assert parse_in(Mode.QUEUE, line) == Parsed(command)


@pytest.mark.parametrize(
    ("line", "column", "expected", "got"),
    [
        ("qx", 2, "P, S, R, C, a queue position or the end after Q", "'x'"),
        ("q-9m5", 2, "P, S, R, C, a queue position or the end after Q", "'-'"),
        ("qss", 3, "the end of the command", "'s'"),
        ("qp9", 3, "the end of the command", "'9'"),
        ("q0m5", 2, "a queue position, 1 to 30", "0"),
        ("Q31m5", 2, "a queue position, 1 to 30", "31"),
        ("q300m5", 2, "a queue position, 1 to 30", "300"),
        ("q" + "9" * 5000, 2, "a queue position, 1 to 30", "99999999999999999..."),
        ("q9", 3, AN_EDIT, "the end of the command"),
        ("q9 m200", 3, AN_EDIT, "the end of the command"),
        ("q9x", 3, "one of V A D L U T S F P, a space or the end", "'x'"),
        ("q9v100m200", 7, "one of V A D L U T S F P, a space or the end", "'m'"),
        ("q9m--5", 5, "one of V A D L U T S F P, a space or the end", "'-'"),
        ("q9l2", 4, "0 (harmonic) or 1 (linear) after L", "'2'"),
    ],
)
def test_lines_of_the_queue_that_do_nothing_say_why(
    line: str, column: int, expected: str, got: str
) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.expected, remark.got) == (column, expected, got)
    assert remark.text == NOTHING


@pytest.mark.parametrize(
    ("line", "column", "expected"),
    [
        ("m2000", 1, "a queue position, 1 to 30"),
        ("q8m2000", 1, "a queue position, 1 to 30"),
        (" 8m2000", 1, "a queue position, 1 to 30"),
        ("85m3000", 1, "a queue position, 1 to 30"),
        ("8", 2, AN_EDIT),
        ("xx", 2, "the end of the command"),
    ],
)
def test_lines_of_the_program_mode_that_do_nothing_say_why(
    line: str, column: int, expected: str
) -> None:
    parsed = parse_in(Mode.QUEUE, line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.expected) == (column, expected)


@pytest.mark.parametrize(
    ("line", "edit", "column", "consequence"),
    [
        ("q9m4294967296v5", Edit(False, rpm=5), 4, "the steps are left as they are"),
        ("q9m-4294967296", Edit(True), 5, "the steps are left as they are"),
        ("q9u256v5", Edit(rpm=5), 4, "they are ignored"),
        ("q9v0", Edit(rpm=BARE), 4, "the default cycle is used"),
        ("q9a0", Edit(acc100=NO_RAMP), 4, "it acts as 999: no ramp"),
    ],
)
def test_values_of_an_edit_that_do_not_fit_are_ignored_and_the_rest_stands(
    line: str, edit: Edit, column: int, consequence: str
) -> None:
    (remark,) = parse(line).remarks
    assert parse(line).command == EditQueue(9, edit)
    assert (remark.column, remark.text) == (column, consequence)


@pytest.mark.parametrize("line", ["q9u256", "q9t4294967296v4294967296"])
def test_an_edit_of_which_nothing_is_left_is_no_command(line: str) -> None:
    assert parse(line).command is None
    assert parse(line).remarks


@given(st.integers(1, 30), nearly_moves)
def test_an_edit_takes_from_a_motion_command_what_that_names(position: int, line: str) -> None:
    move, edit = parse(line).command, parse(f"q{position}{line}").command
    if isinstance(move, Move):
        assert isinstance(edit, EditQueue)
        assert edit.position == position
        names = Edit.__slots__
        assert [getattr(edit.edit, name) for name in names] == [
            getattr(move, name) for name in names
        ]


@given(st.integers(0, 40), st.just("") | nearly_moves, parts, tails)
def test_the_program_mode_reads_edits_as_the_prompt_does(
    position: int, course: str, parts: str, tail: str
) -> None:
    line = f"{position}{course}{parts}{tail}"
    at_prompt, inside = parse("q" + line), parse_in(Mode.QUEUE, line)
    assert inside.command == at_prompt.command
    assert [(one.column + 1, one.expected, one.got, one.text) for one in inside.remarks] == [
        (one.column, one.expected, one.got, one.text) for one in at_prompt.remarks
    ]
