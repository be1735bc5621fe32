"""``sacbus scan`` and ``sacbus estop`` against a real bus, as a user types them."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sacbus.cli import run
from tests.serving import PATIENCE, Sacbus, client, served

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def bus() -> Iterator[Sacbus]:
    with served("--ephemeral", "--nodes", "10,85") as sacbus:
        yield sacbus


@pytest.fixture(scope="module")
def modules() -> Iterator[Sacbus]:
    with served("--ephemeral", "--kind", "ss-mst67", "--nodes", "4-6", "--baud", "9600") as sacbus:
        yield sacbus


def test_scan_prints_who_answers_and_how_soon(capsys: Captured, bus: Sacbus) -> None:
    assert run(["scan", bus.link, "--nodes", "10,84-86"]) == 0
    written = capsys.readouterr()
    lines = written.out.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["node 10", "node 85"]
    assert all(" us" in line for line in lines)
    assert written.err == ""  # no terminal, no progress


@pytest.mark.slow
def test_scan_of_all_addresses_finds_the_two_and_tells_it_as_json(
    capsys: Captured, bus: Sacbus
) -> None:
    assert run(["scan", bus.link, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["asked"] == 252
    assert [one["node"] for one in told["found"]] == [10, 85]
    for one in told["found"]:
        assert one["round_trip_us"] >= 2_989  # six bytes, 385 us, four bytes
        assert one["attempts"] >= 1


def test_nobody_there_is_status_4_and_one_line(capsys: Captured, bus: Sacbus) -> None:
    assert run(["scan", bus.link, "--nodes", "20-22"]) == 4
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err == (
        f"error: nobody answers, {bus.link}, check the wires, the power and the baud rate (38400)\n"
    )
    assert run(["scan", bus.link, "--nodes", "20", "--json"]) == 4
    assert json.loads(capsys.readouterr().out) == {"asked": 1, "found": []}


@pytest.mark.parametrize("nodes", ["3-9", "none", "x", "10,10"])
def test_addresses_that_make_no_sense_are_status_2(
    capsys: Captured, bus: Sacbus, nodes: str
) -> None:
    assert run(["scan", bus.link, "--nodes", nodes]) == 2
    error = capsys.readouterr().err
    assert "--nodes" in error
    assert error.count("\n") == 1


@pytest.mark.slow
def test_on_a_terminal_scan_shows_how_far_it_is_and_leaves_nothing_of_it(bus: Sacbus) -> None:
    screen, terminal = os.openpty()
    try:
        process = subprocess.Popen(
            [sys.executable, "-m", "sacbus", "scan", bus.link, "--nodes", "80-85"],
            stdout=subprocess.PIPE,
            stderr=terminal,
        )
        out, _ = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
        assert out.startswith(b"node 85: ")
        shown = b""
        while select.select([screen], [], [], 0)[0]:
            shown += os.read(screen, 65_536)
        assert b"sweep 1: 6 of 6, 1 found" in shown
        assert shown.endswith(b"\r\x1b[K")
    finally:
        os.close(screen)
        os.close(terminal)


@pytest.mark.slow
def test_a_node_is_told_when_it_is_found_also_where_no_terminal_is() -> None:
    # To ask 161 absent ones, three times each, takes minutes at this rate.
    slow = ("--baud", "300")
    with served("--ephemeral", "--nodes", "10", *slow) as bus:
        command = [sys.executable, "-m", "sacbus", "scan", bus.link, "--nodes", "10,90-250", *slow]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("node 10: ")
            assert process.poll() is None
            process.terminate()


def test_estop_says_what_it_has_sent(capsys: Captured, bus: Sacbus) -> None:
    assert run(["estop", bus.link]) == 0
    written = capsys.readouterr()
    assert written.out == "S sent 3 times to all nodes; nobody answers a broadcast\n"
    assert written.err == ""
    assert run(["estop", bus.link, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"outcome": "broadcast", "line": "S", "sent": 3}


def test_estop_says_when_there_is_no_line(capsys: Captured) -> None:
    assert run(["estop", "/nonexistent"]) == 1
    assert "/nonexistent" in capsys.readouterr().err


def test_what_estop_puts_on_the_line_is_s_three_times(tmp_path: Path) -> None:
    port = tmp_path / "bus"
    with served("--ephemeral", "--nodes", "10", "--tcp", "0", "--pty", str(port)) as sacbus:
        url = sacbus.ready["links"][1]["url"]
        with client(str(port)) as listening:
            assert run(["estop", url]) == 0
            assert listening.read(21) == bytes.fromhex("02 00 01 53 03 39 00") * 3


@pytest.mark.parametrize("command", [["estop"], ["scan", "--nodes", "4-6"], ["send"], ["terminal"]])
def test_a_bus_of_another_protocol_is_refused_before_a_byte_goes_out(
    capsys: Captured, modules: Sacbus, command: list[str]
) -> None:
    line = ["4S"] if command == ["send"] else []
    assert run([command[0], modules.link, *command[1:], *line]) == 1
    assert capsys.readouterr().err == (
        "error: this line speaks superstepper, to which a SAC's commands mean something else, "
        f"{modules.link}, take a master of that protocol: nothing was sent\n"
    )
    assert run(["ss", modules.link, "4", "status", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    # Bytes of a SAC's would have moved it, or cut this question in two.
    assert (told["framing_error"], told["overrun"], told["status"]["busy"]) == (False,) * 3
