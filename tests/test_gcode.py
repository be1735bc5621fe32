"""``sacbus gcode``: what it says, its statuses, its files, and every mistake in one line each."""

from __future__ import annotations

import io
import json
import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sacbus.cli import run
from sacbus.trace import read
from tests.full_disk import needs_full_device
from tests.machining.seen import check_that_it_ran_as_listed, listed

Captured = pytest.CaptureFixture[str]

AXES = ("--axis", "X=10:40", "--axis", "Y=11:40")
ROOT = Path(__file__).parents[1]
ROUTER = str(ROOT / "examples" / "router.toml")

PROGRAM = """\
G21 F600
G1 X10 Y5 (out)
G4 P0.5
G1 X0 Y0
M0
M30
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM)
    return file


def test_what_came_of_a_program_is_told(program: Path, capsys: Captured) -> None:
    assert run(["gcode", str(program), *AXES]) == 0
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0] == f"{program}: 6 lines, 2 straight stretches, 22.361 mm of path"
    assert lines[1].startswith("time       ")
    assert "at the feeds asked for" in lines[1]
    assert lines[2].startswith("commands   ")
    assert "X          asked for 0.0000 mm, reached 0.0000 mm, 0 steps" in lines
    assert "dwells     0.5 s" in lines
    assert err == f"{program}: M0, would wait\n{program}: M30\n"


def test_the_page_shows_what_is_said(capsys: Captured) -> None:
    page = (ROOT / "docs" / "gcode.md").read_text()
    shown = page.partition("--plot circle.png\n")[2].partition("```")[0]
    assert run(["gcode", str(ROOT / "examples" / "circle.ngc"), "--machine", ROUTER]) == 0
    told = capsys.readouterr().out.replace(f"{ROOT}/", "")
    # Better plans have other figures.
    assert re.sub("[0-9]+", "N", told) == re.sub("[0-9]+", "N", shown)


def test_json_tells_the_same(program: Path, capsys: Captured) -> None:
    assert run(["gcode", str(program), "--machine", ROUTER, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["lines"], told["stretches"], told["dwell_s"]) == (6, 2, 0.5)
    assert [one["name"] for one in told["axes"]] == ["X", "Y", "Z"]
    assert [one["reached_steps"] for one in told["axes"]] == [0, 0, 0]
    assert told["stream"]["late"] <= told["blocks"]
    assert told["reports"] == {}


def test_standard_input_is_a_program_too(capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    stdin = io.TextIOWrapper(io.BytesIO(b"F600\nG1 X3\n\xe9 is no word\n"))
    monkeypatch.setattr(sys, "stdin", stdin)
    assert run(["gcode", "-", *AXES]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    stdin = io.TextIOWrapper(io.BytesIO(b"F600\nG1 X3 (\xe9)\n"))
    monkeypatch.setattr(sys, "stdin", stdin)
    assert run(["gcode", "-", *AXES]) == 0
    assert "X          asked for 3.0000 mm, reached 3.0000 mm, 120 steps" in capsys.readouterr().out


def test_the_commands_are_written_so_that_anyone_can_read_them(
    program: Path, tmp_path: Path, capsys: Captured
) -> None:
    listing, recording = tmp_path / "part.txt", tmp_path / "part.rec"
    arguments = ["gcode", str(program), *AXES, "-o", str(listing), "--record", str(recording)]
    assert run(arguments) == 0
    text = listing.read_text()
    assert text.startswith(f"# {program}: node and command, block by block")
    assert "# block 1, lines 2 to 3: 11.180 mm in " in text or "# block 1, line 2: 11.180" in text
    assert "# dwell 0.5 s" in text
    assert "# M0, waits" in text
    check_that_it_ran_as_listed(read(str(recording)), listed(text), jump=16)
    capsys.readouterr()
    assert run(["gcode", str(program), *AXES, "--plan-only", "-o", "-"]) == 0
    assert capsys.readouterr().out == text


@needs_full_device
def test_a_recording_that_cannot_be_written_is_told_of_behind_the_account(
    program: Path, capsys: Captured
) -> None:
    assert run(["gcode", str(program), *AXES, "--record", "/dev/full"]) == 1
    out, err = capsys.readouterr()
    assert "X          asked for" in out
    assert err.endswith(
        "M30\nerror: the recording /dev/full could not be begun: No space left on device, "
        "nothing is kept, record elsewhere\n"
    )


@pytest.mark.parametrize(("name", "begins"), [("part.png", b"\x89PNG"), ("part.svg", b"<?xml")])
def test_the_path_is_drawn(name: str, begins: bytes, program: Path, tmp_path: Path) -> None:
    picture = tmp_path / name
    assert run(["gcode", str(program), *AXES, "--plot", str(picture)]) == 0
    assert picture.read_bytes().startswith(begins)
    if name.endswith("svg"):
        text = picture.read_text()
        assert ">asked for<" in text
        assert ">done<" in text
        assert ">deviation of a block, mm<" in text


def test_a_program_that_is_wrong_moves_nothing_and_all_mistakes_are_told(
    program: Path, tmp_path: Path, capsys: Captured
) -> None:
    program.write_text("G21\nG1 X1 Q2\nO100 sub\nG1 Z5\n")
    listing = tmp_path / "listing"
    assert run(["gcode", str(program), *AXES, "-o", str(listing)]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) >= 3
    assert all(one.startswith("error: ") for one in errors)
    assert [
        f"{program}:{line}:" in error for line, error in zip((2, 3, 4), errors[:3], strict=True)
    ] == [True] * 3
    assert not listing.exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "expected --axis or --machine, got neither, see sacbus gcode --help"),
        ([*AXES, "--machine", ROUTER], "expected --axis or --machine, got both"),
        (["--axis", "X10"], "expected LETTER=NODE:STEPS_PER_MM as X=10:400, got 'X10'"),
        (["--axis", "Q=10:400"], "expected name one of X, Y, Z"),
        (["--axis", "X=3:400"], "expected node a whole number from 4 to 255 in 'X=3:400', got 3"),
        (["--axis", "X=10:0"], "expected steps_per_mm a number from 0.001"),
        (["--axis", "X=10:4", "--axis", "x=11:4"], "expected each axis's own letter"),
        (["--axis", "X=10:4", "--axis", "Y=10:4"], "expected each axis's own node"),
        (["--machine", "nowhere.toml"], "cannot read the machine file"),
        ([*AXES, "--tolerance", "0"], "expected a number from 1e-06 to 10, got 0"),
        ([*AXES, "--tolerance", "nan"], "expected a number from 1e-06 to 10, got nan"),
        ([*AXES, "--link", "x", "--plan-only"], "expected --link or --plan-only, got both"),
        ([*AXES, "--link", "x", "--record", "r"], "--record: expected a simulation"),
        ([*AXES, "--json", "-o", "-"], "--json: expected -o to be a file"),
        ([*AXES, "--plot", "x.gif"], "pictures are drawn as PNG or SVG"),
        ([*AXES, "-o", "nowhere/x"], "cannot write nowhere/x"),
    ],
)
def test_wrong_arguments_are_told_in_one_line(
    arguments: list[str], told: str, program: Path, capsys: Captured
) -> None:
    assert run(["gcode", str(program), *arguments]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert error.startswith("error: ")
    assert told in error


def test_a_program_that_is_not_there_is_told_in_one_line(capsys: Captured) -> None:
    assert run(["gcode", "nowhere.ngc", *AXES]) == 2
    error = "error: nowhere.ngc: No such file or directory, name a part program\n"
    assert capsys.readouterr().err == error


def test_a_stretch_that_no_machine_has_is_refused(program: Path, capsys: Captured) -> None:
    program.write_text("G1 X1\nG1 X99999999\n")
    assert run(["gcode", str(program), *AXES]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert error == (
        "error: X: would go 3999999920 steps at once, 100000000 at most, "
        f"{program}:2:1, check units and steps per mm"
    )
    # The chords of an arc are not worked out before.
    program.write_text("G1 X1\nG2 X1 Y100000000 R90000000\n")
    assert run(["gcode", str(program), "--axis", "X=10:1000000", "--axis", "Y=11:1"]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert error.startswith(f"error: {program}, line 2: X would go ")


def test_output_never_replaces_the_program(program: Path, capsys: Captured) -> None:
    assert run(["gcode", str(program), *AXES, "-o", str(program)]) == 2
    assert "-o: expected a file of its own" in capsys.readouterr().err
    assert program.read_text() == PROGRAM


@pytest.mark.slow
def test_a_bar_shows_how_far_it_is_and_ctrl_c_says_how_far_it_came(tmp_path: Path) -> None:
    long = tmp_path / "long.ngc"
    long.write_text("F600\n" + "".join(f"G1 X{n % 90} Y{n % 70}\n" for n in range(20_000)))
    near, far = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "sacbus", "gcode", str(long), *AXES],
        stdout=subprocess.DEVNULL,
        stderr=far,
    ) as gcode:
        os.close(far)
        seen = b""
        while b"%, line" not in seen:
            seen += os.read(near, 4096)
        assert b"long.ngc [" in seen
        gcode.send_signal(signal.SIGINT)
        seen = b""
        try:
            while more := os.read(near, 4096):
                seen += more
        except OSError:  # a pty whose last program has ended
            pass
        assert gcode.wait(30) == 130
    os.close(near)
    assert b"stopped: " in seen
    assert re.search(rb"in block \d+, lines \d+ to \d+, on the way to X", seen)
    assert seen.endswith(b"interrupted\r\n")


def test_a_halt_that_waits_wants_a_terminal_before_anything_moves(program: Path) -> None:
    told = subprocess.run(
        [sys.executable, "-m", "sacbus", "gcode", str(program), *AXES, "--link", "nowhere"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        start_new_session=True,
    )
    # It has not even tried to open the link.
    assert told.returncode == 2
    assert told.stderr == "error: M0 waits for somebody, and there is no terminal, run it at one\n"
