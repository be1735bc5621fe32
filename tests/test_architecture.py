"""The arrows between the rooms: docs/architecture.md lists them, pyproject.toml states them."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from sacbus.node import kinds

ROOT = Path(__file__).parents[1]
ROOMS = ("bus", "kernel", "language", "motion", "node", "wire")
OUTSIDE = {"asyncio", "datetime", "logging", "select", "selectors", "socket", "threading", "time"}


def core_files() -> list[Path]:
    rooms = [ROOT / "sacbus" / name for name in ROOMS] + [ROOT / "nodes"]
    files: list[Path] = []
    for room in rooms:
        files += room.rglob("*.py") if room.is_dir() else [room.with_suffix(".py")]
    return sorted(files)


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_every_import_follows_an_arrow() -> None:
    # A process of its own: import-linter reads the tree from scratch and keeps global state.
    ran = run(Path(sys.executable).with_name("lint-imports"), "--no-cache", "--no-logo")
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.parametrize("room", ["sacbus", "sacbus.wire", "sacbus.language", "sacbus.kernel"])
def test_the_foundations_drag_in_no_event_loop(room: str) -> None:
    asked = f"import sys, {room}; print(*({{'asyncio', 'logging', 'socket'}} & {{*sys.modules}}))"
    ran = run(sys.executable, "-c", asked)
    assert (ran.stdout.strip(), ran.stderr) == ("", "")


@pytest.mark.parametrize("file", core_files(), ids=lambda file: str(file.relative_to(ROOT)))
def test_a_core_file_imports_no_loop_no_clock_and_no_logging(file: Path) -> None:
    named = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            named |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            named.add(node.module.partition(".")[0])
    assert not named & OUTSIDE


#: What hosts, records, plays and watches nodes of any kind.
KNOWS_NO_KIND = ("bus", "feed", "kernel", "movement", "node", "scenario", "trace", "watch")


def test_no_kind_and_no_protocol_is_known_by_name_where_all_are_alike() -> None:
    names = {one for kind in kinds().values() for one in (kind.name, kind.protocol.name)}
    assert {"sac", "ss-mst67", "superstepper"} <= names
    told = []
    for room in KNOWS_NO_KIND:
        place = ROOT / "sacbus" / room
        for file in place.rglob("*.py") if place.is_dir() else [place.with_suffix(".py")]:
            tree = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            told += [
                f"{file.name}: {node.value!r}"
                for node in tree
                if isinstance(node, ast.Constant) and node.value in names
            ]
    assert told == []
