"""docs/gcode-words.md against the tables and the tests: no word is missing there, every row is
true, and none is without a test that exists.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Final

import pytest

from sacbus.gcode import GcodeError
from sacbus.gcode.vocabulary import (
    AXIS_LETTERS,
    GROUPS,
    REFUSED,
    REFUSED_LETTERS,
    VALUE_LETTERS,
)
from sacbus.toolpath import Halt
from tests.gcode.rig import items, machine

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "docs" / "gcode-words.md"
MACHINE = machine("XYZUVWABC")

Row = dict[str, str]


def rows() -> list[Row]:
    """The rows of all tables of the page: cells by the heads of their columns."""
    found: list[Row] = []
    heads: list[str] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().removesuffix("|").split("|")[1:]]
        if not cells:
            heads = []
        elif not heads:
            heads = cells
        elif not set(cells[0]) <= {"-"}:
            found.append(dict(zip(heads, cells, strict=True)))
    return found


ROWS: Final = rows()
WORDS: Final = [row for row in ROWS if "word" in row]


def quoted(text: str) -> list[str]:
    return re.findall(r"`([^`]*)`", text)


def written_in(file: str) -> set[str]:
    tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def fate(line: str) -> str:
    """What becomes of a line, after a motion that is in force."""
    try:
        came = items(f"G1 X9\nX0\n{line}", MACHINE)[2:]
    except GcodeError:
        return "refused"
    return "reported" if any(isinstance(item, Halt) for item in came) else "obeyed"


def test_no_word_is_missing_and_none_stands_there_twice() -> None:
    named = [word for row in WORDS for word in quoted(row["word"])]
    assert sorted(named) == sorted(
        [*AXIS_LETTERS, *VALUE_LETTERS, *REFUSED_LETTERS, *GROUPS, *REFUSED]
    )


@pytest.mark.parametrize("row", ROWS, ids=[next(iter(row.values())) for row in ROWS])
def test_a_row_is_true(row: Row) -> None:
    assert row["fate"] in {"obeyed", "reported", "refused"}
    for example in quoted(row["example"]):
        assert fate(example) == row["fate"], example
    if "word" in row:
        for word in quoted(row["word"]):
            if word in GROUPS or word in VALUE_LETTERS:
                assert row["fate"] != "refused"
            elif word in REFUSED or word in REFUSED_LETTERS:
                assert fate(word if word in REFUSED else f"{word}1") == "refused"


@pytest.mark.parametrize("row", ROWS, ids=[next(iter(row.values())) for row in ROWS])
def test_a_row_names_a_test_that_exists(row: Row) -> None:
    tests = [named.split("::") for named in quoted(row["test"])]
    assert tests
    for file, name in tests:
        assert name in written_in(file), f"there is no {file}::{name}"


def test_what_is_refused_is_refused_for_its_own_reason() -> None:
    for name, (what, remedy) in REFUSED.items():
        with pytest.raises(GcodeError) as wrong:
            items(name, MACHINE)
        (mistake,) = wrong.value.mistakes
        assert (mistake.word, mistake.what, mistake.remedy) == (name, what, remedy)
