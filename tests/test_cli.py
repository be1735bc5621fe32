"""The command line: statuses, outputs, and errors of one line. ``serve`` is in test_serve.py."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from sacbus import __version__
from sacbus.cli import root, run
from tests.serving import PATIENCE, Sacbus, served, started, until

NAK_10 = bytes.fromhex("02 01 0a 15")
ACK_10 = bytes.fromhex("02 01 0a 06")

Captured = pytest.CaptureFixture[str]


class Peer(threading.Thread):
    """The other end of a serial line: gives the next of its answers to each packet, then none."""

    def __init__(self, answers: list[bytes]) -> None:
        super().__init__(daemon=True)
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._answers = answers
        self.heard: list[bytes] = []

    def run(self) -> None:
        # The slave end is ours too, so a read ends only by what `close` writes there.
        while (packet := os.read(self.master, 4_096)) != b"end":
            self.heard.append(packet)
            if self._answers:
                os.write(self.master, self._answers.pop(0))

    def close(self) -> None:
        os.write(self._slave, b"end")
        self.join(PATIENCE)
        assert not self.is_alive()
        os.close(self._slave)
        os.close(self.master)


@contextmanager
def peer(*answers: bytes) -> Iterator[Peer]:
    made = Peer(list(answers))
    made.start()
    try:
        yield made
    finally:
        made.close()


def the_error(capsys: Captured) -> str:
    """What stands on standard error: exactly one line, and nothing on standard output."""
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.startswith("error: ")
    assert written.err.count("\n") == 1
    return written.err.removeprefix("error: ").rstrip("\n")


# ------------------------------------------------------------------------ help and usage


@pytest.mark.parametrize("command", [[], *([name] for name in sorted(root.commands))], ids=str)
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_every_command_has_help_with_an_example(
    capsys: Captured, command: list[str], option: str
) -> None:
    assert run([*command, option]) == 0
    written = capsys.readouterr()
    name = " ".join(["sacbus", *command])
    assert f"Example: {name} " in written.out or f"Example: {name}\n" in written.out
    assert "--verbose" in written.out
    assert written.err == ""
    assert max(map(len, written.out.splitlines())) <= 100


def test_the_version_is_told(capsys: Captured) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"sacbus {__version__}\n"


def test_without_a_command_the_help_is_shown_and_nothing_was_done(capsys: Captured) -> None:
    assert run([]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert "Usage: sacbus" in written.err
    assert "serve" in written.err


WRONG = [
    (["frobnicate"], 2, "No such command 'frobnicate'.*, see sacbus --help"),
    (["--frob"], 2, "No such option.*--frob.*, see sacbus --help"),
    (["send"], 2, "Missing argument 'LINK', see sacbus send --help"),
    (["send", "port"], 2, "Missing argument 'LINE', see sacbus send --help"),
    (["serve", "--nodes", "3"], 1, "nodes: expected addresses from 4 to 255, got 3"),
    (["serve", "--nodes", "20-10"], 2, "expected addresses from 0 to 255, low to high"),
    (["serve", "--nodes", "4-256"], 2, "expected addresses from 0 to 255.*got '4-256'"),
    (["serve", "--nodes", "ten"], 2, "expected addresses like 10-19,85, got 'ten'"),
    (["serve", "--nodes", "10-"], 2, "expected addresses like 10-19,85, got '10-'"),
    (["serve", "--nodes", ""], 2, "expected addresses like 10-19,85, got ''"),
    (["serve", "--nodes", "9" * 5_000], 2, "expected addresses"),
    (["serve", "--nodes", "10-12,11"], 2, "expected each address once, got 11 twice"),
    (
        ["serve", "--baud", "12"],
        2,
        "'--baud': expected a whole number from 300 to 4000000, got '12', see",
    ),
    (
        ["calibrate", "x", "10", "--rpm", "61.5"],
        2,
        "'--rpm': expected a whole number from 1 to 10000, got '61.5', see",
    ),
    (
        ["diff", "a", "b", "--most", "few"],
        2,
        "'--most': expected a whole number of 1 or more, got 'few', see",
    ),
    (["serve", "--speed", "0"], 2, "not in the range"),
    (["serve", "--set", "ustep"], 2, "expected NAME=VALUE, got 'ustep'"),
    (["serve", "--set", "ustep=9", "--ephemeral"], 1, "expected a whole number from 0 to 7, got 9"),
    (["serve", "--set", "soft_ops=7", "--ephemeral"], 1, "expected true or false, got 7"),
    (
        ["serve", "--set", "ustep=-1", "--ephemeral"],
        1,
        "expected a whole number from 0 to 7, got -1",
    ),
    (["serve", "--set", "colour=red", "--ephemeral"], 1, "setting 'colour': expected one of"),
    (["serve", "--receiver", "deaf"], 2, "'deaf' is not one of"),
    (["serve", "--kind", "toaster", "--ephemeral"], 1, "'toaster' is not installed"),
    (["serve", "--state", "/x", "--ephemeral"], 2, "--state and --ephemeral contradict each other"),
    (["serve", "--state", "/dev/null/x"], 1, "cannot create the state directory .*/dev/null/x"),
    (["serve", "--ephemeral", "--pty", "/nonexistent/port"], 1, "no such directory, /nonexistent"),
    (["send", "/nonexistent", "10m400"], 1, "no such file.*, /nonexistent, check the path"),
    (["send", "/", "10m400"], 1, "it is a directory"),
    (["send", "/dev/null", "10m400"], 1, "it is not a serial port"),
    (["send", "socket://h", "10m400"], 1, "a URL without a port number, socket://h, write it as"),
    (["send", "/dev/null", "m400"], 1, "expected an address before the command"),
    (["send", "/dev/null", "300m400"], 1, "node 300: expected an address from 4 to 255"),
]


@pytest.mark.parametrize(
    ("arguments", "status", "what"), WRONG, ids=[" ".join(one)[:40] for one, _, _ in WRONG]
)
def test_what_is_wrong_is_told_in_one_line(
    capsys: Captured, arguments: list[str], status: int, what: str
) -> None:
    assert run(arguments) == status
    error = the_error(capsys)
    assert "Traceback" not in error
    assert re.search(what, error), error


ENDLESS = "m" * 3_000


@pytest.mark.parametrize(
    "arguments",
    [
        [ENDLESS],
        ["kinds", ENDLESS],
        ["send", "/dev/null", f"10{ENDLESS}→"],
        ["send", "/dev/null", ENDLESS],
        ["send", "/dev/null", "9" * 3_000],
        ["send", ENDLESS, "10m400"],
        ["plan", ENDLESS],
        ["plan", "m", ENDLESS],
        ["plan", "m", "m" + " x" * 3_000],
        ["serve", "--set", ENDLESS],
        ["serve", "--set", f"ustep={ENDLESS}", "--ephemeral"],
        ["serve", "--kind", ENDLESS, "--ephemeral"],
        ["check", ENDLESS],
    ],
    ids=lambda arguments: " ".join(arguments)[:30],
)
def test_what_was_given_is_quoted_but_not_at_any_length(
    capsys: Captured, arguments: list[str]
) -> None:
    assert run(arguments) != 0
    assert len(capsys.readouterr().err) < 500


@pytest.mark.parametrize(
    "arguments",
    [
        ["-v", "send", "/dev/null", "10m400"],
        ["send", "-v", "/dev/null", "10m400"],
        ["send", "/dev/null", "10m400", "--verbose"],
        ["-v", "serve", "--nodes", "3"],
    ],
)
def test_verbose_adds_the_traceback_wherever_it_stands(
    capsys: Captured, arguments: list[str]
) -> None:
    assert run(arguments) in (1, 2)
    written = capsys.readouterr()
    assert written.err.startswith("Traceback (most recent call last):")
    assert written.err.splitlines()[-1].startswith("error: ")


# -------------------------------------------------------------------------------- kinds


def test_kinds_are_listed_with_their_settings(capsys: Captured) -> None:
    assert run(["kinds"]) == 0
    text = capsys.readouterr().out
    assert "sac: " in text
    assert "soft_ops = false  (true or false)" in text
    assert "ustep = 0  (a whole number from 0 to 7)" in text


def test_kinds_are_told_as_json(capsys: Captured) -> None:
    assert run(["kinds", "--json"]) == 0
    (sac,) = [one for one in json.loads(capsys.readouterr().out)["kinds"] if one["kind"] == "sac"]
    assert sac["protocol"] == "sac"
    settings = {one["name"]: one for one in sac["settings"]}
    assert settings["receiver"]["default"] == "device"
    assert settings["soft_ops"]["default"] is False
    assert all(one["help"] for one in sac["settings"])


# --------------------------------------------------------------------------------- send


@pytest.fixture(scope="module")
def bus() -> Iterator[Sacbus]:
    with served("--ephemeral", "--nodes", "10,11") as sacbus:
        yield sacbus


def test_the_dissector_is_where_it_says(capsys: Captured) -> None:
    assert run(["dissector"]) == 0
    path = Path(capsys.readouterr().out.removesuffix("\n"))
    assert path.name == "sac.lua"
    assert path.read_text(encoding="utf-8").startswith("-- A Wireshark dissector")


def test_send_says_who_acknowledged_and_how_soon(capsys: Captured, bus: Sacbus) -> None:
    assert run(["send", bus.link, "10m400"]) == 0
    written = capsys.readouterr()
    assert written.out.startswith("ACK from node 10, ")
    assert written.out.endswith(" us\n")
    assert written.err == ""


def test_send_tells_attempts_and_round_trip_as_json(capsys: Captured, bus: Sacbus) -> None:
    assert run(["send", bus.link, "11m4", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    round_trip = told.pop("round_trip_us")
    assert told == {"node": 11, "line": "m4", "outcome": "ack", "attempts": 1}
    assert isinstance(round_trip, int)
    assert round_trip >= 3_510  # 8 bytes, 385 us, 4 bytes: the line's own time


def test_a_broadcast_is_sent_and_nobody_answers(capsys: Captured, bus: Sacbus) -> None:
    assert run(["send", bus.link, "0S"]) == 0
    assert capsys.readouterr().out == "sent to all nodes; nobody answers a broadcast\n"
    assert run(["send", bus.link, "0S", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "node": 0,
        "line": "S",
        "outcome": "broadcast",
        "attempts": 1,
        "round_trip_us": None,
    }


@pytest.mark.slow
def test_send_goes_over_a_network_as_well(capsys: Captured) -> None:
    with served("--ephemeral", "--nodes", "10", "--tcp", "0", "--rfc2217", "0") as bus:
        for link in bus.ready["links"]:
            assert run(["send", link["url"], "10m400"]) == 0
            assert capsys.readouterr().out.startswith("ACK from node 10, ")


@pytest.mark.slow
def test_no_answer_to_what_was_repeated_is_status_4(capsys: Captured, bus: Sacbus) -> None:
    assert run(["send", bus.link, "99V100"]) == 4
    assert the_error(capsys).startswith("node 99: 'V100' sent 3 times, last answer silence")


def test_silence_after_what_must_not_run_twice_is_status_5(capsys: Captured, bus: Sacbus) -> None:
    assert run(["send", bus.link, "99m400"]) == 5
    assert "it may have been executed" in the_error(capsys)


@pytest.mark.slow
def test_who_accepts_duplicates_has_it_sent_again(capsys: Captured, bus: Sacbus) -> None:
    assert run(["send", bus.link, "99m400", "--accept-duplicates", "--json"]) == 4
    written = capsys.readouterr()
    assert json.loads(written.out)["attempts"] == 3
    assert json.loads(written.out)["outcome"] == "no answer"
    assert written.err.startswith("error: node 99")


def test_nak_every_time_is_status_3(capsys: Captured) -> None:
    with peer(NAK_10, NAK_10, NAK_10) as damaging:
        assert run(["send", damaging.path, "10m400"]) == 3
        assert "sent 3 times, last answer NAK: not executed" in the_error(capsys)
        assert len(damaging.heard) == 3


def test_nak_every_time_is_told_as_json_too(capsys: Captured) -> None:
    with peer(NAK_10, NAK_10, NAK_10) as damaging:
        assert run(["send", "--json", damaging.path, "10m400"]) == 3
    written = capsys.readouterr()
    assert json.loads(written.out) == {
        "node": 10,
        "line": "m400",
        "outcome": "nak",
        "attempts": 3,
        "round_trip_us": None,
    }
    assert written.err.count("\n") == 1


def test_an_ack_after_a_nak_says_how_many_attempts_it_took(capsys: Captured) -> None:
    with peer(NAK_10, ACK_10) as damaging:
        assert run(["send", damaging.path, "10m400"]) == 0
    assert capsys.readouterr().out.startswith("ACK from node 10 after 2 attempts, ")


def test_unknown_outcome_is_told_as_json_too(capsys: Captured) -> None:
    with peer() as silent:
        assert run(["send", silent.path, "10m400", "--json"]) == 5
        assert silent.heard == [b"\x02\x0a\x01m400\x03\xde\x00"]
    assert json.loads(capsys.readouterr().out)["outcome"] == "unknown"


def test_a_line_that_another_has_is_not_shared(capsys: Captured) -> None:
    with peer() as silent, serial.Serial(silent.path, exclusive=True):
        assert run(["send", silent.path, "10m400"]) == 1
        error = the_error(capsys)
        assert "another program has it" in error
        assert silent.path in error


# ----------------------------------------------------------------------- real processes


@pytest.mark.slow
def test_ctrl_c_ends_send_with_130_and_one_line() -> None:
    with peer() as silent, started("send", silent.path, "10V100", "--baud", "300") as sacbus:
        # At 300 baud silence takes half a second to be sure of, three times.
        until(lambda: silent.heard)
        assert sacbus.send_signal(signal.SIGINT) == 130
        assert sacbus.text == ""
        # The first line end is for the ^C that a terminal shows.
        assert sacbus.errors() == "\ninterrupted\n"


@pytest.mark.slow
def test_a_reader_that_left_is_no_traceback() -> None:
    ours, theirs = os.pipe()
    os.close(ours)
    try:
        ended = subprocess.run(
            [sys.executable, "-m", "sacbus", "kinds"],
            stdout=theirs,
            stderr=subprocess.PIPE,
            timeout=PATIENCE,
            check=False,
        )
    finally:
        os.close(theirs)
    assert (ended.returncode, ended.stderr) == (1, b"")


@pytest.mark.slow
def test_the_installed_script_is_the_same_program() -> None:
    script = Path(sys.executable).with_name("sacbus")
    if not script.exists():
        pytest.fail(f"{script} is missing; install the project first")
    ended = subprocess.run([script, "--version"], capture_output=True, timeout=PATIENCE, check=True)
    assert ended.stdout.decode() == f"sacbus {__version__}\n"


@pytest.mark.slow
def test_completion_for_the_shell_is_there() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", "from sacbus.__main__ import main; main()"],
        env={**os.environ, "_SACBUS_COMPLETE": "bash_source"},
        capture_output=True,
        timeout=PATIENCE,
        check=True,
    )
    assert b"_sacbus_completion" in ended.stdout
