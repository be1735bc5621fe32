"""``sacbus terminal --raw``: every key at once, on a real terminal."""

from __future__ import annotations

import re

import pytest

from sacbus.cli import run
from tests.serving import until
from tests.terminal.rig import Person, device, person

pytestmark = pytest.mark.slow


def begins(who: Person) -> None:
    who.sees(lambda seen: seen.endswith("Ctrl-D ends it\r\n"))


def test_keys_arrive_as_they_are_typed_and_what_is_shown_is_the_devices_own() -> None:
    with device() as port, person("terminal", "--raw", port.path) as who:
        begins(who)
        who.types("+")
        who.sees(lambda seen: seen.endswith("\n+"))
        assert port.heard == []
        who.types("m4\r")
        who.sees(lambda seen: seen.endswith("\n+m4\r\nSAC>"))
        until(lambda: port.heard == [b"+m4"])
        who.types("x\x04never sent")
        assert who.leaves() == 0
        assert who.errors() == ""
        assert "never" not in who.seen


def test_control_c_leaves_with_its_status() -> None:
    with device() as port, person("terminal", "--raw", port.path) as who:
        begins(who)
        who.types("m\x03")
        assert who.leaves() == 130
        assert who.errors() == "\ninterrupted\n"


def test_a_port_that_goes_away_ends_it_with_one_line() -> None:
    with device() as port, person("terminal", "--raw", port.path) as who:
        begins(who)
        port.unplug()
        assert who.leaves() == 1
        assert re.fullmatch(rf"error: the line is gone \(.*\), {port.path}, .*\n", who.errors())


def test_a_pipe_has_no_keys(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["terminal", "--raw", "/dev/null"]) == 2
    assert capsys.readouterr().err == (
        "error: --raw is for keys of a terminal, leave it out for a file or a pipe, "
        "see sacbus terminal --help\n"
    )
