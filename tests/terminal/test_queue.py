"""``sacbus queue get``: a screen becomes a file, or one line says why not."""

from __future__ import annotations

import json
import re
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from sacbus.cli import run
from sacbus.language.queue_file import read_rows
from sacbus.language.queue_screen import QueueScreen
from tests.terminal.rig import PROMPT, Device, device

pytestmark = pytest.mark.slow

Captured = pytest.CaptureFixture[str]

FILE = Path(__file__).parents[1] / "data" / "companion-queue.txt"
CONTENT = FILE.read_bytes()
ROWS = tuple(one.row for one in read_rows(CONTENT.decode().splitlines()))


def screen(lines: list[str]) -> bytes:
    return "".join(f"\r\n{line}" for line in lines).encode() + b"\r\n" + PROMPT


WHOLE = QueueScreen(ROWS, 7).lines()


def shows(answer: bytes) -> AbstractContextManager[Device]:
    return device(lambda line: answer if line == b"q" else PROMPT)


def test_a_queue_is_written_one_to_one(capsys: Captured, tmp_path: Path) -> None:
    file = tmp_path / "queue.csv"
    with shows(screen(WHOLE)) as port:
        assert run(["queue", "get", port.path, str(file)]) == 0
        told = f"{len(ROWS)} positions written to {file}; Q is at 7\n"
        assert capsys.readouterr() == (told, "")
        assert tuple(one.row for one in read_rows(file.read_text().splitlines())) == ROWS
        assert list(tmp_path.iterdir()) == [file]
        assert run(["queue", "get", "--json", port.path, str(file)]) == 0
        assert json.loads(capsys.readouterr().out) == {
            "terminal": port.path,
            "file": str(file),
            "positions": len(ROWS),
            "next_free": 7,
        }


def test_a_program_mode_that_somebody_left_open_is_left(tmp_path: Path) -> None:
    file = tmp_path / "queue.csv"
    mode = ["qp"]

    def answer(line: bytes) -> bytes:
        if line == b"x":
            mode.clear()
        return screen(WHOLE) if line == b"q" and not mode else PROMPT

    with device(answer) as port:
        assert run(["queue", "get", port.path, str(file)]) == 0
    assert tuple(one.row for one in read_rows(file.read_text().splitlines())) == ROWS
    assert not mode


def test_standard_output_gets_the_file_itself(
    capfdbinary: pytest.CaptureFixture[bytes], tmp_path: Path
) -> None:
    file = tmp_path / "queue.csv"
    with shows(screen(WHOLE)) as port:
        assert run(["queue", "get", port.path, str(file)]) == 0
        capfdbinary.readouterr()
        assert run(["queue", "get", port.path, "-"]) == 0
        assert capfdbinary.readouterr() == (file.read_bytes(), b"")


def test_hidden_positions_that_debug_mode_shows_are_no_part_of_it(tmp_path: Path) -> None:
    hidden = QueueScreen((*ROWS[:1], *ROWS), 7).lines()
    hidden[2] = hidden[2].replace("1", "0", 1)
    file = tmp_path / "queue.csv"
    with shows(screen(hidden)) as port:
        assert run(["queue", "get", port.path, str(file)]) == 0
    assert [one.row.position for one in read_rows(file.read_text().splitlines())] == [
        row.position for row in ROWS
    ]


WRONG = [
    (
        screen([line.replace("CW", "C?") for line in WHOLE]),
        "this is no row of a queue screen, got '1.*', {link}, line 4 of the answer to q, check",
    ),
    (
        screen(WHOLE[:-1]),
        "no queue screen upon q, expected its last line 'Q is at …', got 'SAC>', {link}, check",
    ),
    (PROMPT, "no queue screen upon q, .* got 'SAC>', {link}, check"),
    (
        screen([*WHOLE[:4], *WHOLE[5:]]),
        r"lines of the queue screen are missing, expected positions from 1, got \[1, 2, 4.*, check",
    ),
    (screen([*WHOLE[:1], *WHOLE[-1:]]), r"lines of the queue screen are missing, .* got \[\]"),
]


@pytest.mark.parametrize(("answer", "what"), WRONG, ids=[what[:40] for _, what in WRONG])
def test_what_is_no_whole_queue_is_told_in_one_line_and_leaves_no_file(
    capsys: Captured, tmp_path: Path, answer: bytes, what: str
) -> None:
    file = tmp_path / "queue.csv"
    file.write_text("as it was")
    with shows(answer) as port:
        assert run(["queue", "get", port.path, str(file)]) == 1
        written = capsys.readouterr()
        assert written.out == ""
        assert written.err.count("\n") == 1
        assert re.match(f"error: {what}".replace("{link}", port.path), written.err), written.err
    assert file.read_text() == "as it was"


def test_where_nobody_answers_that_is_told_with_its_status(
    capsys: Captured, tmp_path: Path
) -> None:
    with device(lambda _: None, echo=False) as port:
        assert run(["queue", "get", port.path, str(tmp_path / "queue.csv")]) == 4
        written = capsys.readouterr()
        assert written.err.startswith("error: no answer within 3 s, expected the prompt SAC>")
        assert written.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_is_told(capsys: Captured, tmp_path: Path) -> None:
    with shows(screen(WHOLE)) as port:
        assert run(["queue", "get", port.path, str(tmp_path / "a" / "b.csv")]) == 1
    assert re.fullmatch(r"error: No such file or directory, .*b\.csv\n", capsys.readouterr().err)


def test_standard_output_has_room_for_one(capsys: Captured) -> None:
    assert run(["queue", "get", "--json", "/dev/null", "-"]) == 2
    assert "--json and - both want standard output, name a file" in capsys.readouterr().err


def test_getting_has_help_with_an_example(capsys: Captured) -> None:
    assert run(["queue", "get", "--help"]) == 0
    written = capsys.readouterr().out
    assert "Example: sacbus queue get " in written
    assert max(map(len, written.splitlines())) <= 100


def test_without_a_command_the_help_is_shown(capsys: Captured) -> None:
    assert run(["queue"]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert "get" in written.err
