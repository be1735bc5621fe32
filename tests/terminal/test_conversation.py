"""A person at ``sacbus terminal``: a real process on a real terminal, a device on a real port."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.serving import until
from tests.terminal.rig import PROMPT, Device, Person, device, person

pytestmark = pytest.mark.slow

UP, HOME, CONTROL_C, CONTROL_D = "\x1b[A", "\x01", "\x03", "\x04"


def obeys(line: bytes) -> bytes:
    return b"\r\nQ is at 1\r\nSAC>" if line == b"q" else PROMPT


def plain(text: str) -> str:
    """What was on the screen, without the terminal's own sequences."""
    return re.sub(r"\x1b(\[[?\d;]*[a-zA-Z]|[78D])", "", text).replace("\r", "")


def prompted(who: Person, times: int) -> str:
    return who.sees(lambda seen: plain(seen).count("SAC>") >= times)


def heard(port: Device, *lines: bytes) -> None:
    until(lambda: port.heard == [*lines])


def test_a_line_is_sent_when_it_is_finished_and_its_echo_is_not_doubled(tmp_path: Path) -> None:
    with device(obeys) as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types("q\r")
        seen = prompted(who, 2)
        assert plain(seen) == "SAC>q\n\nQ is at 1\nSAC>"
        who.types(CONTROL_D)
        assert who.leaves() == 0
        assert who.errors() == ""
        assert port.heard == [b"", b"q"]


def test_a_line_can_be_edited_and_an_earlier_one_fetched_back(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types(f"400{HOME}m\r")
        prompted(who, 2)
        heard(port, b"", b"m400")
        who.types(f"{UP}5\r")
        heard(port, b"", b"m400", b"m4005")
        prompted(who, 3)
        who.types(CONTROL_D)
        assert who.leaves() == 0


def test_what_no_terminal_can_type_is_told_and_not_sent(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types("m4\u20ac\r")
        who.sees(lambda seen: "this cannot be typed, column 3, expected printable ASCII" in seen)
        prompted(who, 2)
        who.types("m4\r")
        heard(port, b"", b"m4")
        prompted(who, 3)
        who.types(CONTROL_D)
        assert who.leaves() == 0


def test_what_was_typed_is_kept_for_the_next_time_unless_that_is_refused(tmp_path: Path) -> None:
    def comes_back(*options: str) -> bytes:
        with (
            device() as port,
            person("terminal", *options, port.path, XDG_STATE_HOME=str(tmp_path)) as who,
        ):
            prompted(who, 1)
            who.types(f"{UP}1\r")
            until(lambda: len(port.heard) == 2)
            prompted(who, 2)
            who.types(CONTROL_D)
            assert who.leaves() == 0
            return port.heard[1]

    assert comes_back("--no-history") == b"1"
    assert list(tmp_path.iterdir()) == []
    assert comes_back() == b"1"
    assert comes_back() == b"11"
    assert comes_back("--no-history") == b"1"
    assert [path.name for path in (tmp_path / "sacbus").iterdir()] == ["terminal-history"]


def test_what_comes_unasked_stands_above_the_line_that_is_being_edited(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types("m4")
        who.sees(lambda seen: plain(seen).endswith("SAC>m4"))
        port.say(b"\r\n85:10> hello\r\nSAC>")
        seen = who.sees(lambda seen: "hello\x1b8\x1b[B" in seen)
        # Room is made above, the line put there, and the cursor goes back to where it was.
        assert seen.endswith("\x1bD\x1b[A\x1b7\r\x1b[L85:10> hello\x1b8\x1b[B")
        who.types("00\r")
        heard(port, b"", b"m400")
        prompted(who, 2)
        who.types(CONTROL_D)
        assert who.leaves() == 0


def test_of_many_that_come_unasked_none_brings_a_prompt_of_its_own(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types("m4")
        who.sees(lambda seen: plain(seen).endswith("SAC>m4"))
        for number in range(3):
            port.say(b"\r\n85:10> hello %d\r\nSAC>" % number)
        port.say(b"\r\n85:10> bye\r\nSA")
        who.sees(lambda seen: "bye\x1b8\x1b[B" in seen)
        port.say(b"C>\r\n\r\nSAC 1.17\r\nSAC>")
        seen = who.sees(lambda seen: "1.17\x1b8\x1b[B" in seen)
        lines = ["85:10> hello 0", "85:10> hello 1", "85:10> hello 2", "85:10> bye", "SAC 1.17"]
        assert re.findall(r"\x1b\[L([^\x1b]*)\x1b8", seen) == lines
        who.types("00\r")
        heard(port, b"", b"m400")
        prompted(who, 2)
        who.types(CONTROL_D)
        assert who.leaves() == 0


def test_a_dumb_terminal_is_shown_no_sequences(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path), TERM="dumb") as who:
        prompted(who, 1)
        port.say(b"\r\n85:10> hello\r\nSAC>")
        who.sees(lambda seen: "85:10> hello\r\n" in seen)
        who.types(CONTROL_D)
        assert who.leaves() == 0
        assert "\x1b" not in who.seen


def test_control_c_leaves_with_its_status(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types(CONTROL_C)
        assert who.leaves(upon=CONTROL_C) == 130
        assert who.errors() == "\ninterrupted\n"


def test_a_port_that_goes_away_ends_it_with_one_line(tmp_path: Path) -> None:
    with device() as port, person("terminal", port.path, HOME=str(tmp_path)) as who:
        prompted(who, 1)
        who.types("m4")
        who.sees(lambda seen: seen.endswith("m4"))
        port.unplug()
        assert who.leaves() == 1
        expected = rf"error: the line is gone \(.*\), {port.path}, open it again\n"
        assert re.fullmatch(expected, who.errors())


def test_where_nobody_answers_that_is_told_in_one_line(tmp_path: Path) -> None:
    with (
        device(lambda _: None, echo=False) as port,
        person("terminal", port.path, HOME=str(tmp_path)) as who,
    ):
        assert who.leaves() == 4
        error = who.errors()
        assert error.startswith(
            f"error: no answer within 3 s, expected the prompt SAC>, {port.path}"
        )
        assert error.count("\n") == 1
