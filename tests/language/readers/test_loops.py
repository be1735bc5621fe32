"""L and X: loops over the queue, runs of one position, the xRef array and its program mode."""

from __future__ import annotations

import pytest

from sacbus.language import (
    EndLoop,
    Leave,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    Mode,
    Parsed,
    ProgramReferences,
    RunPosition,
    RunReferences,
    SetReference,
    ShowReferences,
    parse,
    parse_in,
)

NOTHING = "the line does nothing"
AFTER_L = "S, F, N, A, a number of loops or the end after L"
AFTER_X = "a queue position, M, P, D or L after X"
POSITION = "a queue position, 1 to 30"
INDEX = "an index of the xRef array, 0 to 30"
END = "the end of the command"


@pytest.mark.parametrize(
    ("line", "command"),
    [
        # Manual, "Loop".
        ("LS9", LoopStart(9)),
        ("ls1", LoopStart(1)),
        ("lF30", LoopFinish(30)),
        ("Lf007", LoopFinish(7)),
        ("LN100", LoopCount(100)),
        ("ln65535", LoopCount(65_535)),
        ("LN0", LoopCount(0)),
        ("LA", LoopQueue()),
        ("l", EndLoop()),
        ("L please", EndLoop()),
        # Appendix C: [(N/n)], without a number.
        ("ln", LoopCount(0)),
        # Manual, "xRef".
        ("L1", RunReferences(1)),
        ("l65535", RunReferences(65_535)),
        ("L0", RunReferences(0)),
        ("XL", RunReferences(0)),
        ("x1", RunPosition(1)),
        ("X30", RunPosition(30)),
        ("xp", ProgramReferences()),
        ("XP0,1", SetReference(0, 1)),
        ("xP30,0", SetReference(30, 0)),
        ("xp03,05 rest", SetReference(3, 5)),
        ("Xd", ShowReferences()),
    ],
)
def test_lines_of_loops_and_references_mean(line: str, command: object) -> None:
    assert parse(line) == Parsed(command)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("line", "command"),
    [
        # Manual, "xRef": the array of its screen.
        ("0,1", SetReference(0, 1)),
        ("1,3", SetReference(1, 3)),
        ("2,7", SetReference(2, 7)),
        ("3,5", SetReference(3, 5)),
        ("4,0", SetReference(4, 0)),
        ("x", Leave()),
        ("X ", Leave()),
    ],
)
def test_lines_of_the_program_mode_mean(line: str, command: SetReference | Leave) -> None:
    assert parse_in(Mode.REFERENCES, line) == Parsed(command)


@pytest.mark.parametrize(
    ("line", "column", "expected", "got"),
    [
        ("lx", 2, AFTER_L, "'x'"),
        ("l-5", 2, AFTER_L, "'-'"),
        ("ls", 3, POSITION, END),
        ("lsx", 3, POSITION, "'x'"),
        ("ls0", 3, POSITION, "0"),
        ("LS31", 3, POSITION, "31"),
        ("lf0000000000031", 3, POSITION, "31"),
        ("lf9x", 4, END, "'x'"),
        ("ls9,12", 4, END, "','"),
        ("ln65536", 3, "the number of loops, at most 65535", "65536"),
        ("lnx", 3, "the number of loops", "'x'"),
        ("ln5x", 4, END, "'x'"),
        ("l65536", 2, "the number of loops, at most 65535", "65536"),
        ("l5x", 3, END, "'x'"),
        ("la5", 3, END, "'5'"),
        ("x", 2, AFTER_X, END),
        ("xx", 2, AFTER_X, "'x'"),
        ("x0", 2, POSITION, "0"),
        ("x31", 2, POSITION, "31"),
        ("x9x", 3, END, "'x'"),
        ("xd1", 3, END, "'1'"),
        ("xl5", 3, END, "'5'"),
        ("xp1", 4, "a comma between index and queue position", END),
        ("xp1.3", 4, "a comma between index and queue position", "'.'"),
        ("xp,3", 3, INDEX, "','"),
        ("xp31,3", 3, INDEX, "31"),
        ("xp1,", 5, "a queue position or 0 for the end of the array, 0 to 30", END),
        ("xp1, 3", 5, "a queue position or 0 for the end of the array, 0 to 30", END),
        ("xp1,31", 5, "a queue position or 0 for the end of the array, 0 to 30", "31"),
        ("xp1,3,2", 6, END, "','"),
    ],
)
def test_lines_of_loops_and_references_that_do_nothing_say_why(
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
        ("1", 2, "a comma between index and queue position"),
        ("31,1", 1, INDEX),
        ("xp1,3", 2, END),
        ("l5", 1, INDEX),
        (" 1,3", 1, INDEX),
    ],
)
def test_lines_of_the_program_mode_that_do_nothing_say_why(
    line: str, column: int, expected: str
) -> None:
    parsed = parse_in(Mode.REFERENCES, line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.expected) == (column, expected)
