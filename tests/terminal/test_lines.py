"""Lines of a pipe typed at a terminal port: the answers are printed, and nothing else."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.serving import PATIENCE
from tests.terminal.rig import PROMPT, device

pytestmark = pytest.mark.slow


def piped(link: str, text: str | bytes) -> tuple[int, str, str]:
    """``sacbus terminal LINK`` with this on its standard input: status, output, errors."""
    ran = subprocess.run(
        [sys.executable, "-m", "sacbus", "terminal", link],
        input=text.encode() if isinstance(text, str) else text,
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )
    return ran.returncode, ran.stdout.decode(), ran.stderr.decode()


def test_each_line_waits_for_the_answer_to_the_one_before() -> None:
    def answers(line: bytes) -> bytes:
        return b"\r\n<" + line + b">\r\nSAC>" if line else PROMPT

    with device(answers) as port:
        assert piped(port.path, "q\n\ncf\r\n   \nvd") == (0, "<q>\n<cf>\n<vd>\n", "")
        assert port.heard == [b"", b"q", b"cf", b"vd"]


def test_a_line_that_says_nothing_prints_nothing() -> None:
    with device() as port:
        assert piped(port.path, "m400\nm-40\n") == (0, "", "")
        assert piped(port.path, "") == (0, "", "")


@pytest.mark.parametrize("wrong", ["q\nm40\u00e9\n", b"q\nm40\xff\n", "q\nm40\x07\n"])
def test_what_no_key_types_is_told_with_its_place(wrong: str | bytes) -> None:
    with device() as port:
        status, _, error = piped(port.path, wrong)
        assert status == 2
        assert error.startswith(
            "error: this cannot be typed, standard input line 2 column 4, expected printable ASCII"
        )
        assert error.count("\n") == 1
        assert port.heard == [b"", b"q"]


def test_where_nobody_answers_that_is_told_with_its_status() -> None:
    with device(lambda line: None if line == b"vd" else PROMPT, echo=False) as port:
        status, _, error = piped(port.path, "q\nvd\ncf\n")
        assert (status, error.count("\n")) == (4, 1)
        assert error.startswith("error: no answer within 3 s, expected the prompt SAC>, /dev/pts/")
        assert port.heard == [b"", b"q", b"vd"]


def test_a_link_that_cannot_be_had_is_told() -> None:
    status, _, error = piped("/nonexistent", "q\n")
    assert status == 1
    assert error.startswith("error: cannot open the line (no such file), /nonexistent, check")
    assert error.count("\n") == 1


def test_without_standard_input_there_is_nobody_to_talk() -> None:
    with device() as port:
        command = f"exec {sys.executable} -m sacbus terminal {port.path} <&-"
        ran = subprocess.run(
            ["sh", "-c", command], capture_output=True, timeout=PATIENCE, check=False
        )
        assert ran.returncode == 2
        assert ran.stderr.startswith(b"error: standard input is closed, give a terminal")
        assert port.heard == []
