"""``sacbus ss`` in a process of its own, against modules that ``sacbus serve`` hosts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from tests.serving import served

pytestmark = pytest.mark.slow


def ss(*arguments: str) -> tuple[int, str, str]:
    """Its exit status, and what it said."""
    ran = subprocess.run(
        [sys.executable, "-m", "sacbus", "ss", *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return ran.returncode, ran.stdout.strip(), ran.stderr.strip()


@pytest.fixture(scope="module")
def link(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    port = str(tmp_path_factory.mktemp("ss") / "steppers")
    with served("--ephemeral", "--kind", "ss-mst67", "--nodes", "0-3", "--pty", port):
        yield port


def test_a_session_from_move_to_stop(link: str) -> None:
    assert ss(link, "3", "microsteps", "8", "--decay", "slow") == (0, "ACK", "")
    assert ss(link, "3", "move-at-speed", "4000", "--at-once", "--ccw") == (0, "ACK", "")
    assert ss(link, "3", "status") == (0, "busy", "")
    status, said, _ = ss(link, "3", "steps-run", "--json")
    report = json.loads(said)
    assert (status, report["outcome"], report["module"]) == (0, "ack", 3)
    assert report["value"] > 0
    assert ss(link, "3", "change-speed", "8000") == (0, "ACK", "")
    assert ss(link, "3", "stop", "--at-once", "--off") == (0, "ACK", "")
    assert ss(link, "3", "status") == (0, "at rest", "")


def test_memories_are_written_and_read(link: str) -> None:
    assert ss(link, "2", "write", "0x10", "66")[0] == 0
    assert ss(link, "2", "read", "0x10") == (0, "66 (0x42)", "")
    assert ss(link, "2", "read", "3", "--word") == (0, "32000 (0x7d00)", "")
    assert ss(link, "2", "read", "1", "--eeprom") == (0, "2 (0x02)", "")
    assert ss(link, "1", "home", "--speed", "4000", "--most", "2")[0] == 0
    assert ss(link, "1", "move-steps", "0", "--speed", "4000", "--rate", "slow")[0] == 0


def test_silence_is_told_with_its_own_status(link: str) -> None:
    status, said, error = ss("--json", link, "9", "status")
    assert status == 4
    assert json.loads(said) == {
        "module": 9,
        "message": "read the byte at RAM 0x06",
        "outcome": "no answer",
        "attempts": 3,
    }
    assert error.startswith("error: module 9: 'read the byte at RAM 0x06' sent 3 times: no answer")


@pytest.mark.parametrize("place", range(5))
def test_options_stand_wherever_one_likes(link: str, place: int) -> None:
    words = [link, "2", "read", "0x1f"]
    for option in (["--json", "--baud", "9600"], ["--baud=9600", "-v", "--json"]):
        status, said, error = ss(*words[:place], *option, *words[place:])
        assert (status, error) == (0, "")
        assert json.loads(said)["message"] == "read the byte at RAM 0x1f"


def test_another_rate_behind_the_command_is_the_lines(link: str) -> None:
    # On a pty of another rate modules hear nothing that they understand.
    assert ss(link, "3", "status", "--baud", "2400")[0] in (3, 4, 5)
    assert ss(link, "3", "stop")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (("32", "status"), 2, "'ADDRESS': expected a whole number from 0 to 31, got '32'"),
        (("status",), 2, "'ADDRESS': expected a whole number from 0 to 31, got 'status'"),
        (("3", "move-step", "1600"), 2, "No such command 'move-step', did you mean 'move-steps'?"),
        (("3", "halt"), 2, "No such command 'halt', expected move-at-speed, move-steps, home, "),
        (
            ("3", "move-steps", "-1600", "--speed", "2500"),
            2,
            "'STEPS': expected a number from 0 to 65535, got '-1600': steps count up, --ccw turns",
        ),
        (("3", "write", "1", "-1"), 2, "'BYTE': expected a number from 0 to 255, got '-1'"),
        (("3", "stop", "-1"), 2, "unexpected extra argument"),
        (
            ("3", "--speed", "2500", "move-steps", "400"),
            2,
            "--speed is an option of a command, expected behind its name, as in 3 move-steps 400 ",
        ),
        (("3", "--ccw", "move-steps", "400"), 2, "--ccw is an option of a command, expected"),
        (("3", "--rate=slow", "move-steps", "400"), 2, "--rate is an option of a command, expect"),
        (("3", "read", "256"), 2, "expected a number from 0 to 255, got '256'"),
        (("3", "read", "x"), 2, "expected a number from 0 to 255, got 'x'"),
        (("3", "read", "0", "--word", "--eeprom"), 2, "leave --word or --eeprom out"),
        (("3", "microsteps", "3"), 2, "expected 1, 2, 4 or 8, got '3'"),
        (("3", "move-steps", "5"), 2, "Missing option '--speed'"),
        (("3", "status", "--baud"), 2, "Option '--baud' requires an argument"),
        (
            ("3", "status", "--baud", "fast"),
            2,
            "'--baud': expected a whole number from 300 to 4000000, got 'fast'",
        ),
        (("3", "stop", "--jsn"), 2, "No such option '--jsn'"),
        (("--sped", "5", "3", "stop"), 2, "No such option '--sped'"),
    ],
)
def test_mistakes_are_told_in_one_line(
    arguments: tuple[str, ...], status: int, told: str, link: str
) -> None:
    ended, said, error = ss(link, *arguments)
    assert (ended, said) == (status, "")
    assert told in error
    assert error.count("\n") == 0


def test_a_line_that_cannot_be_had_is_told(link: str) -> None:
    status, _, error = ss("/no/such/port", "3", "status")
    assert status == 1
    assert error.startswith("error: cannot open the line (no such file), /no/such/port")
    master, slave = os.openpty()
    assert ss("--nine", os.ttyname(slave), "3", "status")[2].startswith(
        "error: no ninth bits there"
    )
    os.close(master)
    os.close(slave)


def test_a_line_that_speaks_something_else_is_refused_before_a_byte_goes_out(link: str) -> None:
    def refused(spoken: str, mine: str, where: str, advice: str) -> tuple[int, str, str]:
        what = f"this line speaks {spoken}, to which messages of {mine} mean something else"
        return 1, "", f"error: {what}, {where}, {advice}: nothing was sent"

    plain, nine = "superstepper", "superstepper-9"
    assert ss("--nine", link, "3", "stop") == refused(plain, nine, link, "leave --nine out")
    with served("--ephemeral", "--nodes", "10") as sacs:
        advice = "take a master of that protocol"
        assert ss(sacs.link, "10", "stop") == refused("sac", plain, sacs.link, advice)
    closed = ["--kind", "ss-mst67", "--nodes", "3", "--baud", "9600", "--set", "jmp2=closed"]
    with served("--ephemeral", *closed) as modules:
        there = modules.link
        assert ss(there, "3", "stop") == refused(nine, plain, there, "add --nine")
