"""``sacbus plan`` as it is called: every source, every output, and nothing half done."""

from __future__ import annotations

import io
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from sacbus.cli import run
from tests.drawing import without_matplotlib

Captured = pytest.CaptureFixture[str]

DATA = Path(__file__).parents[1] / "data"
QUEUE = DATA / "companion-queue.txt"
ONE_SHOTS = DATA / "companion-one-shot.txt"


@pytest.fixture
def directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where results go; the working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> io.BytesIO:
    """Standard input, to be written to and rewound."""
    given = io.BytesIO()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(given))
    return given


def told(capsys: Captured, *arguments: str | Path) -> str:
    assert run(["plan", *map(str, arguments)]) == 0
    written = capsys.readouterr()
    assert written.err == ""
    return written.out


def commands(capsys: Captured, *arguments: str | Path) -> list[dict[str, object]]:
    listed: list[dict[str, object]] = json.loads(told(capsys, *arguments, "--json"))["commands"]
    return listed


# ------------------------------------------------------------------------------ sources


def test_a_command_is_told_in_words_and_as_json(capsys: Captured) -> None:
    assert told(capsys, "m200v100a1d1") == (
        "m200v100a1d1  90 + 20 + 90 steps CW, harmonic, peak 100.00 RPM  1.469006 s\n"
    )
    assert json.loads(told(capsys, "m200v100a1d1", "--json")) == {
        "commands": [
            {
                "command": "m200v100a1d1",
                "steps": 200,
                "pulses": 200,
                "n_acc": 90,
                "n_cruise": 20,
                "n_dec": 90,
                "duration_us": 1469006,
                "start_us": 0,
                "peak_rpm": 100.0,
                "profile": "harmonic",
                "direction": "CW",
                "warnings": [],
            }
        ],
        "duration_us": 1469006,
    }


def test_options_reach_the_motor(capsys: Captured) -> None:
    (one,) = commands(capsys, "m200v100", "--ustep", "3", "--sprf", "400", "--slow", "20")
    assert (one["pulses"], one["n_acc"], one["n_dec"]) == (1_600, 80, 80)
    (one,) = commands(capsys, "m200v100", "--start-rpm", "100")
    assert one["n_acc"] == 0
    kept = [one["n_acc"] for one in commands(capsys, "m500d999", "m500t9999", "--no-gap")]
    assert kept == [90, 0]
    assert len(commands(capsys, "m500", "m-500", "--loop", "4")) == 8


def test_the_companions_queue_is_planned_whole(capsys: Captured) -> None:
    planned = commands(capsys, "--queue", QUEUE)
    assert len(planned) == 30
    assert planned[10]["command"] == "m4000v160a5d5l1t3000000f"
    assert (planned[10]["profile"], planned[1]["direction"]) == ("linear", "CCW")
    # Too short for their ramps, and nothing else.
    warned = [one["command"] for one in planned if one["warnings"]]
    assert warned == ["m10vc4321a1d1l0t2400000f", "m200vc2345a1d1l0f", "m200v121a1d1l0f"]
    # The screen of the manual's queue shows CCW for 0 in the older form.
    older = commands(capsys, "--queue", DATA / "companion-queue-14-fields.txt")
    assert [one["direction"] for one in older[:10]] == ["CW"] * 7 + ["CCW", "CW", "CCW"]


def test_the_companions_one_shots_are_planned_whole(capsys: Captured, typed: io.BytesIO) -> None:
    planned = commands(capsys, "--list", ONE_SHOTS)
    assert len(planned) == 28
    assert planned[0]["command"] == "xm1200v160ad"
    typed.write(ONE_SHOTS.read_bytes())
    typed.seek(0)
    assert commands(capsys, "-") == planned


def test_standard_input_stands_where_the_dash_stands(capsys: Captured, typed: io.BytesIO) -> None:
    typed.write(b"v50\n\nm20\n")
    typed.seek(0)
    planned = commands(capsys, "m10", "-", "m30", "--loop", "2")
    assert [one["steps"] for one in planned] == [10, 20, 30] * 2
    assert [one["peak_rpm"] for one in planned][2] == 24.0


def test_standard_input_can_stand_twice(capsys: Captured, typed: io.BytesIO) -> None:
    typed.write(b"m20\nm30")
    typed.seek(0)
    planned = commands(capsys, "-", "m1", "-")
    assert [one["steps"] for one in planned] == [20, 30, 1, 20, 30]


def test_a_queue_file_may_come_from_standard_input(capsys: Captured, typed: io.BytesIO) -> None:
    typed.write(QUEUE.read_bytes())
    typed.seek(0)
    assert len(commands(capsys, "--queue", "-")) == 30


def test_the_table_is_printed_and_told_as_json(capsys: Captured) -> None:
    assert "872    3490    7853" in told(capsys, "--table")
    assert json.loads(told(capsys, "--table", "--json"))["steps"][29][11] == 4_188


@pytest.mark.slow
def test_a_queue_file_of_ten_thousand_rows_is_streamed(capsys: Captured, directory: Path) -> None:
    rows = QUEUE.read_bytes().splitlines(keepends=True)
    (directory / "long.csv").write_bytes(b"".join(rows * 334)[: len(b"".join(rows)) * 334])
    text = told(capsys, "--queue", "long.csv").splitlines()
    assert len([line for line in text if not line.startswith("  ")]) == 10_021


# ------------------------------------------------------------------------------- outputs


def test_pulses_are_written_beside_the_report(capsys: Captured, directory: Path) -> None:
    assert "1.469006 s" in told(capsys, "m200v100", "--pulses", "times.npy")
    times = np.load(directory / "times.npy")
    assert (len(times), times[0], times[1]) == (200, 0, 30_000)
    told(capsys, "m200v100", "--pulses", "times.csv")
    lines = (directory / "times.csv").read_text().splitlines()
    assert (len(lines), lines[2]) == (201, "30000,1,2")


def test_pulses_to_standard_output_stand_alone(capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    assert run(["plan", "m2v9", "--pulses", "-"]) == 0
    assert capfdbinary.readouterr().out == b"time_us,command,position\n0,1,1\n33333,1,2\n"


@pytest.mark.slow
def test_a_picture_is_written_beside_the_report(capsys: Captured, directory: Path) -> None:
    assert "total" in told(capsys, "--queue", QUEUE, "--plot", "queue.svg")
    assert b"30 commands" in (directory / "queue.svg").read_bytes()
    told(capsys, "m200", "--plot", "one.png")
    assert (directory / "one.png").read_bytes().startswith(b"\x89PNG")


def test_without_matplotlib_one_line_says_what_to_install(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch, directory: Path
) -> None:
    without_matplotlib(monkeypatch)
    # Of a name that is wrong anyway that is told, which costs no installation.
    assert run(["plan", "m200", "--plot", "one.xyz"]) == 2
    assert "pictures are drawn as PNG or SVG, one.xyz" in capsys.readouterr().err
    assert run(["plan", "m200", "--plot", "one.png"]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.startswith("error: drawing needs matplotlib (")
    assert written.err.endswith("install it: python -m pip install 'sacbus[plot]'\n")
    assert list(directory.iterdir()) == []


# ------------------------------------------------------------------------------ mistakes


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "nothing to plan, sacbus plan, give commands such as m400v120"),
        (["m200", "--queue", "q.csv"], "--list and --queue exclude each other"),
        (["--list", "l.txt", "--queue", "q.csv"], "--list and --queue exclude each other"),
        (["m200q"], "'m200q' is not understood, command 1 column 5"),
        (["--queue", "bad.csv"], "bad.csv line 2 column 3, expected the steps, 0 to 4294967295"),
        (["--list", "bad.txt"], "'xm5w' is not understood, bad.txt line 3 column 5, expected one"),
        (["--queue", "none.csv"], "cannot be read (No such file or directory), none.csv, check"),
        (["--queue", "."], "cannot be read (Is a directory), ., check"),
        (["m200", "--plot", "a.gif"], "drawn as PNG or SVG, a.gif, give a name that ends in .png"),
        (["m200", "--pulses", "a.txt"], "CSV or for numpy, a.txt, give a name that ends in .csv"),
        (["m", "--pulses", "a.csv"], "never ends cannot be written"),
        (["m", "m2"], "'m2' would never run, command 2"),
        (["m2", "--loop", "0"], "'--loop': expected a whole number from 1 to 65535, got '0'"),
        (["--frob"], "see sacbus plan --help"),
    ],
    ids=lambda one: " ".join(one) if isinstance(one, list) else "",
)
def test_what_is_wrong_is_one_line_with_status_2_and_leaves_no_file(
    capsys: Captured, directory: Path, arguments: list[str], message: str
) -> None:
    (directory / "bad.csv").write_text(
        "1,200,0,1,100,3000,0,1,1,0,0,0\n2,x,0,1,100,3000,0,1,1,0,0,0"
    )
    (directory / "bad.txt").write_text("xm20\n\n xm5w\n")
    (directory / "q.csv").write_text("")
    (directory / "l.txt").write_text("")
    before = set(directory.iterdir())
    assert run(["plan", *arguments]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.startswith("error: ")
    assert written.err.count("\n") == 1
    assert message in written.err
    assert set(directory.iterdir()) == before


@pytest.mark.parametrize("option", ["--pulses", "--plot"])
def test_a_late_mistake_leaves_no_file_and_no_words(
    capsys: Captured, directory: Path, option: str
) -> None:
    (directory / "queue.csv").write_bytes(QUEUE.read_bytes() + b"nonsense\r\n")
    name = "a.csv" if option == "--pulses" else "a.svg"
    assert run(["plan", "--queue", "queue.csv", option, name]) == 2
    written = capsys.readouterr()
    assert (written.out, written.err.count("\n")) == ("", 1)
    assert "queue.csv line 31 column 1, expected 12 fields as before, got 1" in written.err
    assert [file.name for file in directory.iterdir()] == ["queue.csv"]


def test_a_place_that_cannot_be_written_is_named(capsys: Captured, directory: Path) -> None:
    assert run(["plan", "m2", "--pulses", "none/a.csv"]) == 1
    written = capsys.readouterr()
    assert (written.out, written.err) == ("", "error: No such file or directory, none/a.csv\n")


# --------------------------------------------------------------------------------- docs


def test_the_page_on_planning_shows_what_is_printed(capsys: Captured, directory: Path) -> None:
    row = "1,200,0,1,100,3000,0,1,1,0,0,0\n"
    (directory / "queue.csv").write_text(row * 6 + "7,200,0,1,100,fast,0,1,1,0,0,0\n")
    page = (DATA.parents[1] / "docs" / "planning.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```console\n\$ sacbus (.*)\n((?:[^`$].*\n)+)```", page)
    assert len(blocks) == 4
    for arguments, expected in blocks:
        run(arguments.split())
        written = capsys.readouterr()
        shown, _, _ = expected.partition("…")
        assert (written.out + written.err).startswith(shown)


# ------------------------------------------------------------------------------ progress


class Terminal(io.StringIO):
    """Standard error, when somebody looks at it."""

    def isatty(self) -> bool:
        return True


@pytest.mark.slow
def test_progress_is_shown_on_a_terminal_for_long_inputs_alone(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], directory: Path
) -> None:
    (directory / "long.csv").write_bytes(QUEUE.read_bytes() * 100)
    for name, shown in ((str(QUEUE), []), ("long.csv", ["reading", "planning"])):
        screen = Terminal()
        monkeypatch.setattr(sys, "stderr", screen)
        assert run(["plan", "--queue", name]) == 0
        said = screen.getvalue()
        assert [word for word in ("reading", "planning", "pulses") if word in said] == shown
        assert ("100%" in said) is bool(shown)
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    assert run(["plan", "m1200000", "--pulses", "a.npy"]) == 0
    assert "pulses" in screen.getvalue()
    assert capfd.readouterr().err == ""
