"""EEPROM files: whole or not at all, and nothing that cannot be trusted is used or lost."""

from __future__ import annotations

import json
import os
import resource
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sacbus.state import StateDirectory, StateError, Stored, default_directory, read_memory

MEMORY: dict[str, object] = {"d_id": 10, "sprf": 200, "queue": ["1 , 200", "2 , 5"]}


@pytest.fixture
def state(tmp_path: Path) -> StateDirectory:
    return StateDirectory(tmp_path / "state", "bus")


def test_what_was_saved_is_loaded(state: StateDirectory) -> None:
    state.save(10, "sac", MEMORY)
    assert state.load(10, "sac") == (MEMORY, None)


def test_files_lie_by_bus_and_address(tmp_path: Path) -> None:
    StateDirectory(tmp_path, "left").save(10, "sac", MEMORY)
    assert [path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()] == [
        Path("left/10")
    ]
    assert StateDirectory(tmp_path, "right").load(10, "sac") == (None, None)


def test_what_was_never_saved_is_no_remark(state: StateDirectory) -> None:
    assert state.load(10, "sac") == (None, None)


def test_a_file_is_replaced_by_a_new_one_and_never_written_over(state: StateDirectory) -> None:
    state.save(10, "sac", MEMORY)
    path = state.path(10)
    with path.open("rb") as old:
        before = path.stat().st_ino
        state.save(10, "sac", {"d_id": 11})
        # Whoever has the old file open still reads all of it.
        assert json.loads(old.read())["memory"] == MEMORY
    assert path.stat().st_ino != before
    assert [one.name for one in path.parent.iterdir()] == ["10"]


def test_a_save_that_fails_leaves_no_piece_of_itself(state: StateDirectory) -> None:
    path = state.path(10)
    path.mkdir(parents=True)
    (path / "something").touch()
    with pytest.raises(StateError, match="cannot write node memory"):
        state.save(10, "sac", MEMORY)
    assert [one.name for one in path.parent.iterdir()] == ["10"]


def test_a_save_that_cannot_even_remove_a_piece_of_itself_is_told_as_any_other(
    state: StateDirectory,
) -> None:
    place = state.path(10).parent
    place.parent.mkdir()
    place.touch()  # a file, in which there is neither anything to write nor to remove
    with pytest.raises(StateError, match="cannot write node memory") as told:
        state.save(10, "sac", MEMORY)
    assert str(state.path(10)) in str(told.value)
    place.unlink()
    state.save(10, "sac", MEMORY)
    assert state.load(10, "sac") == (MEMORY, None)


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda good: b"",
    "cut short": lambda good: good[:-9],
    "no JSON": lambda good: b"\xff\xfe garbage",
    "nested without end": lambda good: b"[" * 100_000,
    "another shape": lambda good: b"[1, 2]",
    "no memory in it": lambda good: b'{"memory": 5}',
    "a changed value": lambda good: good.replace(b"200", b"201"),
    "no check value": lambda good: good.replace(b'"check"', b'"chuck"'),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_kept_aside_and_reported(state: StateDirectory, damage: str) -> None:
    state.save(10, "sac", MEMORY)
    path = state.path(10)
    damaged = DAMAGES[damage](path.read_bytes())
    path.write_bytes(damaged)
    memory, remark = state.load(10, "sac")
    assert memory is None
    assert remark is not None
    assert str(path) in remark
    assert "kept as 10.damaged, factory values used" in remark
    assert "\n" not in remark
    assert not path.exists()
    assert path.with_name("10.damaged").read_bytes() == damaged


def test_a_second_damaged_file_does_not_replace_the_first(state: StateDirectory) -> None:
    path = state.path(10)
    path.parent.mkdir(parents=True)
    for number in range(3):
        path.write_text(f"damage {number}")
        state.load(10, "sac")
    assert path.with_name("10.damaged").read_text() == "damage 0"
    assert path.with_name("10.damaged.2").read_text() == "damage 1"
    assert path.with_name("10.damaged.3").read_text() == "damage 2"


def test_a_memory_of_another_kind_of_node_is_kept_aside(state: StateDirectory) -> None:
    state.save(10, "superstepper", MEMORY)
    memory, remark = state.load(10, "sac")
    assert memory is None
    assert remark is not None
    assert "of a node of kind 'superstepper', not 'sac'" in remark


def test_a_file_of_another_format_is_kept_aside(state: StateDirectory) -> None:
    path = state.path(10)
    path.parent.mkdir(parents=True)
    # Written by a later version: the check value is right, the meaning unknown.
    path.write_text('{"format": 2, "kind": "sac", "memory": {}, "check": 1922074156}')
    memory, remark = state.load(10, "sac")
    assert memory is None
    assert remark is not None
    assert "format 2, this version reads 1" in remark


@given(st.binary(max_size=300))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_the_file_holds_loading_says_so_and_goes_on(
    tmp_path: Path, content: bytes
) -> None:
    state = StateDirectory(tmp_path, "bus")
    path = state.path(10)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    memory, remark = state.load(10, "sac")
    assert memory is None
    assert remark is not None
    assert path.with_name("10.damaged").read_bytes() == content
    path.with_name("10.damaged").unlink()


def test_a_directory_that_cannot_be_made_is_told_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StateError) as told:
        StateDirectory(tmp_path / "file" / "state", "bus").claim()
    assert str(told.value) == (
        f"cannot create the state directory (Not a directory), {tmp_path}/file/state/bus, "
        "choose another directory with --state DIR, or --ephemeral to keep nothing"
    )


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_a_directory_that_cannot_be_written_is_told_before_anything_runs(tmp_path: Path) -> None:
    place = tmp_path / "bus"
    place.mkdir(mode=0o500)
    with pytest.raises(StateError, match="cannot write the state directory"):
        StateDirectory(tmp_path, "bus").claim()


def test_a_file_that_cannot_be_read_is_told_and_left_alone(state: StateDirectory) -> None:
    state.path(10).mkdir(parents=True)
    with pytest.raises(StateError, match="cannot read node memory"):
        state.load(10, "sac")
    assert state.path(10).is_dir()


def test_what_a_killed_save_left_behind_is_cleared_away_and_nothing_else(
    state: StateDirectory,
) -> None:
    state.save(10, "sac", MEMORY)
    place = state.path(10).parent
    for name in (".10.4711.new", ".11.1.new", "10.damaged", ".hidden"):
        (place / name).write_text("half")
    state.claim()
    try:
        assert {one.name for one in place.iterdir()} == {"10", "10.damaged", ".hidden"}
    finally:
        state.release()


def test_who_has_not_got_the_directory_clears_nothing_away(
    state: StateDirectory, tmp_path: Path
) -> None:
    state.claim()
    (state.path(10).parent / ".10.4711.new").write_text("being written")
    try:
        with pytest.raises(StateError, match="in use by another sacbus"):
            StateDirectory(tmp_path / "state", "bus").claim()
        assert (state.path(10).parent / ".10.4711.new").exists()
    finally:
        state.release()


def test_who_cannot_clear_away_has_not_got_the_directory(
    state: StateDirectory, tmp_path: Path
) -> None:
    left = state.path(10).with_name(".10.4711.new")
    left.mkdir(parents=True)
    with pytest.raises(StateError, match="cannot clear away unfinished node memory"):
        state.claim()
    left.rmdir()
    another = StateDirectory(tmp_path / "state", "bus")
    another.claim()
    another.release()


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read everywhere")
def test_a_directory_that_cannot_be_read_is_told_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "bus").mkdir(mode=0o300)
    with pytest.raises(StateError, match="cannot lock node memory"):
        StateDirectory(tmp_path, "bus").claim()


def test_a_directory_that_cannot_be_opened_is_told_before_anything_runs(
    state: StateDirectory,
) -> None:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, before[1]))  # whatever it is that forbids it
    try:
        with pytest.raises(StateError, match="cannot lock node memory"):
            state.claim()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    state.claim()
    state.release()


# ---- reading a file, wherever it lies -----------------------------------------------------------


def test_a_file_can_be_read_without_knowing_whose_it_is(state: StateDirectory) -> None:
    state.save(10, "sac", MEMORY)
    moved = state.path(10).rename(state.path(10).with_name("a copy"))
    assert read_memory(moved) == Stored("sac", MEMORY)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_that_is_only_looked_at_is_told_and_stays(
    state: StateDirectory, damage: str
) -> None:
    state.save(10, "sac", MEMORY)
    path = state.path(10)
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    with pytest.raises(StateError, match="this is no node's memory that can be trusted") as told:
        read_memory(path)
    assert str(path) in str(told.value)
    assert "\n" not in str(told.value)
    assert path.exists()


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(StateError) as told:
        read_memory(tmp_path / "10")
    assert str(told.value) == (
        f"cannot read node memory (No such file or directory), {tmp_path}/10, give the file of a "
        "node: ADDRESS in the directory of its bus"
    )


def test_the_default_directory_is_the_users_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_STATE_HOME")  # which keeps tests out of it
    assert default_directory().name == "sacbus"
    assert default_directory().is_relative_to(Path.home())
