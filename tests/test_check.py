"""``sacbus check``: statuses, output in words and as JSON, and a real process."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sacbus.cli import run
from tests.serving import PATIENCE

Captured = pytest.CaptureFixture[str]

RIGHT = """\
state = "memory"
[[bus]]
[[bus.nodes]]
addresses = "10-19,85"
ustep = 3
[[bus.nodes]]
address = 20
receiver = "robust"
[[bus.links]]
kind = "pty"
[[bus.links]]
kind = "pty"
path = "port"
[[bus.links]]
kind = "rfc2217"
listen = "[::1]:7001"
[[bus]]
name = "real"
state = false
terminals = true
lanes = 2
baud = 9600
[[bus.links]]
kind = "tcp"
listen = 7000
[[bus.links]]
kind = "adapter"
device = "COM5"
"""

FIVE_MISTAKES = """\
sped = 2
[[bus]]
name = "left"
baud = 12
[[bus.nodes]]
address = 10
ustep = 9
[[bus.nodes]]
addresses = "9-11"
[[bus.links]]
kind = "tcp"
listen = "here"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "x.toml"
    path.write_text(RIGHT)
    return path


def test_what_is_right_is_summed_up(capsys: Captured, file: Path) -> None:
    assert run(["check", str(file)]) == 0
    here = file.parent
    assert capsys.readouterr() == (
        (
            f"{file}: 2 buses, 12 nodes, 5 links\n"
            "bus bus: sac at 38400 baud, 1 lane\n"
            "  nodes 10-19,85: sac, ustep = 3\n"
            "  node 20: sac, receiver = 'robust'\n"
            "  pty\n"
            f"  pty {here}/port\n"
            "  rfc2217 [::1]:7001\n"
            f"  state {here}/memory/bus\n"
            "bus real: sac at 9600 baud, 2 lanes\n"
            "  tcp 127.0.0.1:7000\n"
            "  adapter COM5\n"
            "  terminals\n"
            "  state kept in memory only\n"
        ),
        "",
    )


def test_what_is_right_is_told_as_json(capsys: Captured, file: Path) -> None:
    assert run(["check", "--json", str(file)]) == 0
    (one,) = json.loads(capsys.readouterr().out)["configurations"]
    assert (one["file"], one["precise"]) == (str(file), False)
    assert (one["mistakes"], one["warnings"]) == ([], [])
    left, right = one["buses"]
    assert left.pop("nodes")[-1] == {
        "address": 20,
        "kind": "sac",
        "settings": {"receiver": "robust"},
    }
    assert left.pop("links") == [
        {"kind": "pty", "path": None, "echo": False, "latency_us": 1000},
        {"kind": "pty", "path": f"{file.parent}/port", "echo": False, "latency_us": 1000},
        {"kind": "rfc2217", "host": "::1", "port": 7001, "echo": False, "latency_us": 1000},
    ]
    assert left == {
        "name": "bus",
        "protocol": "sac",
        "baud": 38_400,
        "lanes": 1,
        "seed": 0,
        "pace": True,
        "terminals": False,
        "watchdog": False,
        "speed": 1.0,
        "state": f"{file.parent}/memory/bus",
    }
    assert (right["baud"], right["lanes"], right["state"]) == (9_600, 2, None)
    assert right["terminals"] is True
    assert right["links"][1] == {"kind": "adapter", "path": "COM5", "rts": False, "echo": False}


@pytest.mark.slow
def test_five_mistakes_are_five_lines_and_status_2(file: Path) -> None:
    file.write_text(FIVE_MISTAKES)
    ended = subprocess.run(
        [sys.executable, "-m", "sacbus", "check", str(file)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (ended.returncode, ended.stdout) == (2, "")
    lines = ended.stderr.splitlines()
    assert len(lines) == 5
    assert all(line.startswith("error: ") for line in lines)
    assert [int(found[1]) for line in lines if (found := re.search(r"x\.toml:(\d+), ", line))] == [
        *(1, 4, 7, 9, 12)
    ]


def test_serving_what_is_wrong_tells_the_same_lines(capsys: Captured, file: Path) -> None:
    file.write_text(FIVE_MISTAKES)
    assert run(["check", str(file)]) == 2
    checked = capsys.readouterr()
    assert run(["serve", str(file)]) == 2
    assert capsys.readouterr() == checked
    assert checked.err.count("error: ") == checked.err.count("\n") == 5


def test_mistakes_are_told_as_json_too(capsys: Captured, file: Path) -> None:
    file.write_text("[[bus]]\nbaud = 12\nlinks = []\n")
    assert run(["check", "--json", str(file)]) == 2
    written = capsys.readouterr()
    (one,) = json.loads(written.out)["configurations"]
    assert one == {
        "file": str(file),
        "mistakes": [
            {
                "file": str(file),
                "line": 2,
                "column": None,
                "key": "bus 'bus': baud",
                "what": "expected a whole number from 300 to 4000000, got 12",
                "remedy": "correct it, or leave it out: the protocol's (38400 for sac)",
            }
        ],
        "warnings": [],
        "precise": None,
        "buses": [],
    }
    assert written.err.startswith("error: bus 'bus': baud: expected ")


def test_what_is_odd_is_a_warning_and_no_error(capsys: Captured, file: Path) -> None:
    file.write_text("[[bus]]\n")
    assert run(["check", str(file)]) == 0
    written = capsys.readouterr()
    assert written.out.startswith(f"{file}: 1 bus, 0 nodes, 0 links\n")
    assert written.err == (
        f"warning: bus 'bus': no program can reach this bus, {file}:1, add [[bus.links]]\n"
    )


def test_several_files_are_each_told_and_one_that_is_wrong_is_enough(
    capsys: Captured, file: Path
) -> None:
    missing = file.with_name("missing.toml")
    assert run(["check", str(file), str(missing)]) == 2
    written = capsys.readouterr()
    assert written.out.startswith(f"{file}: 2 buses")
    assert written.err == (
        f"error: cannot read the configuration (No such file or directory), {missing}, "
        "check the path and its permissions\n"
    )


def test_standard_input_is_a_dash(
    capsys: Captured, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = io.TextIOWrapper(io.BytesIO(RIGHT.encode()))
    monkeypatch.setattr(sys, "stdin", text)
    monkeypatch.chdir(file.parent)
    assert run(["check", "-"]) == 0
    written = capsys.readouterr().out
    assert written.startswith("standard input: 2 buses, 12 nodes, 5 links\n")
    assert f"  pty {file.parent}/port\n" in written


def test_nothing_is_opened(capsys: Captured, file: Path) -> None:
    before = sorted(file.parent.iterdir())
    assert run(["check", str(file)]) == 0
    assert sorted(file.parent.iterdir()) == before
