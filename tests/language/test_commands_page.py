"""docs/commands.md against the grammar and the tests: no command is missing there, no example is
wrong, and no row is without a test that exists.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final, get_args

import pytest

from sacbus.language import (
    Command,
    Mode,
    Parameter,
    SetParameter,
    ThrowAway,
    columns,
    parse_in,
)
from sacbus.language.commands import Edit, Move
from sacbus.language.grammar import LETTERS, SHOW_LETTERS
from sacbus.language.qualifiers import QUALIFIERS
from sacbus.language.readers.loops import LOOP_LETTERS, REFERENCE_LETTERS
from sacbus.language.readers.queue import QUEUE_LETTERS
from sacbus.language.readers.system import SYSTEM_LETTERS

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "docs" / "commands.md"
MODES = {
    "queue": [Mode.QUEUE],
    "references": [Mode.REFERENCES],
    "configure": [Mode.CONFIGURE],
    "any": [Mode.QUEUE, Mode.REFERENCES, Mode.CONFIGURE],
}


@dataclass(frozen=True)
class Row:
    """A row of the page: its cells by the heads of their columns."""

    cells: dict[str, str]

    @property
    def examples(self) -> list[tuple[Mode, str]]:
        spans = re.findall(r"`([^`]*)`", self.cells["example"])
        lines = [span.encode().decode("unicode_escape") for span in spans]
        modes = MODES[self.cells["mode"]] if "mode" in self.cells else [Mode.PROMPT]
        return [(mode, line) for mode in modes for line in lines]


def rows() -> list[Row]:
    found: list[Row] = []
    heads: list[str] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().removesuffix("|").split("|")[1:]]
        if not cells:
            heads = []
        elif not heads:
            heads = cells
        elif not set(cells[0]) <= {"-"}:
            found.append(Row(dict(zip(heads, cells, strict=True))))
    return found


ROWS: Final = rows()
EXAMPLES: Final = [example for row in ROWS for example in row.examples]
AT_PROMPT: Final = [line for mode, line in EXAMPLES if mode is Mode.PROMPT]


def named_in(text: str) -> list[tuple[str, str]]:
    """File, relative to tests/nodes/sac unless a room is named, and name of each test."""
    return re.findall(r"`([\w/]+\.py)::(test_\w+)`", text)


def written_in(file: str) -> set[str]:
    """Names of the tests in a file that the page names."""
    path = TESTS / file if "/" in file else TESTS / "nodes" / "sac" / file
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def described(mode: Mode, line: str) -> tuple[Command, set[str]]:
    """An example's command, and those of its fields that the line gives."""
    parsed = parse_in(mode, line)
    assert parsed.command is not None
    return parsed.command, set(columns(line, mode))


def flat(of: type[Command]) -> set[str]:
    """Names of a command's fields, and of those of the move or the edit in it."""
    names = {field.name for field in fields(of)}
    for name, inner in (("move", Move), ("edit", Edit)):
        if name in names:
            names = (names - {name}).union(field.name for field in fields(inner))
    return names


def test_every_row_has_an_example_and_the_same_columns() -> None:
    assert len(ROWS) > 80
    for row in ROWS:
        assert row.examples, row
        assert [head for head in row.cells if head != "mode"] == [
            "syntax",
            "example",
            "effect",
            "test",
            "decision",
        ]


def test_every_row_has_a_test_and_nothing_else_in_its_place() -> None:
    for row in ROWS:
        cell = row.cells["test"]
        assert named_in(cell), f"no test proves {row.cells['syntax']}"
        assert len(named_in(cell)) == len(cell.split("<br>"))


def test_every_test_that_the_page_names_exists() -> None:
    named = named_in(PAGE.read_text(encoding="utf-8"))
    assert PAGE.read_text(encoding="utf-8").count("::") == len(named)
    for file, name in named:
        assert name in written_in(file), f"docs/commands.md names {file}::{name}: there is none"


@pytest.mark.parametrize(("mode", "line"), EXAMPLES)
def test_every_example_is_read_without_a_remark(mode: Mode, line: str) -> None:
    parsed = parse_in(mode, line)
    assert parsed.command is not None
    assert parsed.remarks == ()


def test_no_command_and_no_field_of_one_is_missing() -> None:
    given: dict[type, set[str]] = {}
    for mode, line in EXAMPLES:
        command, named = described(mode, line)
        given.setdefault(type(command), set()).update(named)
    # A field may be said by the letter alone, as S says that it is without grace.
    said_by_letter = {"grace", "start", "full_step"}
    for kind in get_args(Command):
        assert kind in given, f"docs/commands.md has no example of {kind.__name__}"
        missing = flat(kind) - given[kind] - said_by_letter
        if kind is not ThrowAway:  # its qualifiers are those of Move
            assert not missing, f"docs/commands.md has no example of {kind.__name__} with {missing}"


def test_no_persistent_parameter_is_missing() -> None:
    stored = [described(mode, line)[0] for mode, line in EXAMPLES if mode is Mode.PROMPT]
    found = {command.parameter for command in stored if isinstance(command, SetParameter)}
    assert found == set(Parameter)


@pytest.mark.parametrize(
    ("before", "letters"),
    [
        ("", LETTERS),
        ("q", QUEUE_LETTERS),
        ("l", LOOP_LETTERS),
        ("x", REFERENCE_LETTERS),
        ("c", SHOW_LETTERS),
        ("$", SYSTEM_LETTERS),
        ("m200", QUALIFIERS),
    ],
)
def test_no_letter_that_the_grammar_reads_is_missing(
    before: str, letters: dict[str, object]
) -> None:
    # By reader: it is one for both cases of a letter, and for all digits.
    reached = {
        letters.get(line[len(before)])
        for line in AT_PROMPT
        if line.lower().startswith(before) and len(line) > len(before)
    }
    assert set(letters.values()) <= reached
