"""``sacbus eeprom``: a memory's file in words, as JSON, and what is no such file in one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nodes.sac import SacSettings
from sacbus.cli import run
from sacbus.language import QUEUE_LENGTH, Parameter, seeded_row
from sacbus.state import StateDirectory

Captured = pytest.CaptureFixture[str]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    memory = SacSettings().factory_memory(10)
    memory = memory.with_values({Parameter.ACC: 125, Parameter.USTEP: 3, Parameter.D_ID: 12})
    memory = memory.with_pins(2, 1).with_queue([seeded_row(memory.defaults())] * QUEUE_LENGTH)
    state = StateDirectory(tmp_path, "bus")
    state.save(10, "sac", memory.stored())
    return state.path(10)


def test_a_memory_is_shown_in_words(file: Path, capsys: Captured) -> None:
    assert run(["eeprom", "show", str(file)]) == 0
    written = capsys.readouterr()
    lines = written.out.splitlines()
    assert written.err == ""
    assert lines[0] == f"{file}: a sac node, configured at 10"
    shown = {line.split()[0]: " ".join(line.split()) for line in lines[1:28]}
    assert set(shown) == {parameter.letter for parameter in Parameter}
    assert shown["A"] == "A autorun 0 no loop at boot"
    assert shown["J"] == "J ustep 3 8 microsteps a full step (factory: 0)"
    assert shown["M"] == "M d_id 12 the node's address (factory: 10)"
    assert shown["d"] == "d acc 1.25 RPM a full step (factory: 1.00)"
    assert shown["h"] == "h ops 36 100100 in binary: op_sa and op_sb tell of commands"
    assert shown["n"] == "n sw - as the line"
    pins = lines.index("pin map of driver 2 ($CUnx):")
    assert lines[pins + 4].split() == ["2", "4", "001"]
    queue = lines.index("saved queue (QS):")
    assert lines[queue + 2].split()[-1] == "m200v100a1.25d1l0f"
    assert len(lines) == queue + 2 + QUEUE_LENGTH
    assert max(map(len, lines[1:])) <= 100


def test_a_memory_is_told_as_json(file: Path, capsys: Captured) -> None:
    assert run(["eeprom", "show", "--json", str(file)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["file"], told["kind"], told["node"]) == (str(file), "sac", 10)
    assert told["memory"]["acc"] == 125
    assert {
        "key": "d",
        "name": "acc",
        "value": "1.25",
        "meaning": "RPM a full step",
        "factory": "1.00",
    } in told["values"]
    assert [table["title"] for table in told["tables"]] == [
        "pin map of driver 2 ($CUnx)",
        "saved queue (QS)",
    ]
    assert told["remarks"] == []


def test_odd_values_are_told_as_a_node_would(tmp_path: Path, capsys: Captured) -> None:
    state = StateDirectory(tmp_path, "bus")
    state.save(10, "sac", {"ustep": 99})
    assert run(["eeprom", "show", str(state.path(10))]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "EEPROM: ustep expected 0 to 7, got 99; factory value used"


@pytest.mark.parametrize("name", ["a copy", "999", "10.damaged"])
def test_a_file_that_was_moved_is_of_no_known_address(
    file: Path, name: str, capsys: Captured
) -> None:
    moved = file.rename(file.with_name(name))
    assert run(["eeprom", "show", str(moved)]) == 0
    out = capsys.readouterr().out
    assert out.startswith(f"{moved}: a sac node\n")
    assert "(factory: 85)" in out


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot read node memory (No such file or directory), "),
        (b"worn", "this is no node's memory that can be trusted, "),
        (b"", "this is no node's memory that can be trusted, "),
        (b'{"memory": {}, "check": 1}', "check value 1 does not match the content"),
    ],
)
def test_what_is_no_memory_is_one_line_and_a_status(
    tmp_path: Path, capsys: Captured, content: bytes | None, message: str
) -> None:
    file = tmp_path / "10"
    if content is not None:
        file.write_bytes(content)
    assert run(["eeprom", "show", str(file)]) == 1
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.startswith("error: ")
    assert message in written.err
    assert str(file) in written.err
    assert written.err.count("\n") == 1
    assert content is None or file.read_bytes() == content


def test_a_directory_is_no_memory(tmp_path: Path, capsys: Captured) -> None:
    assert run(["eeprom", "show", str(tmp_path)]) == 1
    assert "(Is a directory)" in capsys.readouterr().err


def test_a_memory_of_a_kind_that_is_not_installed_is_told(tmp_path: Path, capsys: Captured) -> None:
    StateDirectory(tmp_path, "bus").save(10, "toaster", {})
    assert run(["eeprom", "show", str(tmp_path / "bus" / "10")]) == 1
    written = capsys.readouterr()
    assert "node kind 'toaster' is not installed" in written.err
    assert written.err.count("\n") == 1


def test_the_help_tells_the_factory_of_the_manual_from_what_a_restore_brings(
    capsys: Captured,
) -> None:
    assert run(["eeprom", "show", "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "differs from the factory's value is marked: that is the manual's" in told
    assert "A factory restore brings the values of the node's configuration" in told


def test_without_a_command_its_help_is_shown(capsys: Captured) -> None:
    assert run(["eeprom"]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.startswith("Usage: sacbus eeprom ")
