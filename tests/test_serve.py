"""The serving process from its first line to its exit status: real processes, real serial ports."""

from __future__ import annotations

import fcntl
import json
import os
import re
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from sacbus.wire import DC1, DC2, encode
from tests.serving import PATIENCE, Sacbus, client, served, started, until

pytestmark = pytest.mark.slow

ACK_10 = bytes.fromhex("02 01 0a 06")


def exchange(link: str, packet: bytes, answer: bytes) -> None:
    with client(link) as port:
        port.write(packet)
        assert port.read(len(answer)) == answer


def test_the_first_line_says_where_to_connect_and_a_client_there_moves_a_motor() -> None:
    with served("--ephemeral", "--nodes", "10-12,85", "--set", "soft_ops=true") as sacbus:
        assert sacbus.ready["event"] == "ready"
        (bus,) = sacbus.ready["buses"]
        assert bus["nodes"] == [{"node": node, "kind": "sac"} for node in (10, 11, 12, 85)]
        assert (bus["name"], bus["protocol"], bus["baud"]) == ("bus", "sac", 38_400)
        assert sacbus.ready["terminals"] == {}
        (link,) = sacbus.ready["links"]
        assert link["kind"] == "pty"
        # With soft ops the node itself tells when its motion begins and ends.
        begins, ends = (encode(0, 10, bytes((one,))) for one in (DC1, DC2))
        exchange(link["path"], encode(10, 1, b"m40v300"), ACK_10 + begins + ends)


def test_the_line_takes_its_time_when_paced() -> None:
    # A lower bound alone: 20 bytes, 502 us and 4 bytes each, and no machine is too fast for it.
    with served("--ephemeral") as sacbus, client(sacbus.link) as port:
        before = time.monotonic()
        for _ in range(50):
            port.write(encode(10, 1, b"V100 as before"))
            assert port.read(4) == ACK_10
        assert time.monotonic() - before >= 50 * 0.006_751


def test_without_pace_bus_time_runs_ahead_of_the_clock() -> None:
    with served("--ephemeral", "--no-pace") as sacbus, client(sacbus.link) as port:

        def refused_at(node: int) -> float:
            port.write(encode(node, 1, b"?4"))
            assert port.read(4) == bytes((2, 1, node, 6))

            def found(text: str) -> list[float]:
                events = [json.loads(line) for line in text.split("\n")[:-1]]
                return [one["time_us"] / 1e6 for one in events if one.get("node") == node]

            sacbus.read_until(found)
            return found(sacbus.text)[0]

        begun, before = time.monotonic(), refused_at(10)
        port.write(b"\x55" * 40_000)
        passed = refused_at(11) - before
        assert passed > 40_000 * 10 / 38_400
        assert passed > time.monotonic() - begun


def test_options_reach_the_bus() -> None:
    options = ("--echo", "--baud", "57600", "--receiver", "robust", "--nodes", "10")
    with served("--ephemeral", *options) as sacbus:
        assert sacbus.ready["buses"][0]["baud"] == 57_600
        with serial.Serial(sacbus.link, 57_600, timeout=PATIENCE) as port:
            # Only a robust receiver hears m132, and only with echo does its sender.
            packet = encode(10, 1, b"m132")
            port.write(packet)
            assert port.read(len(packet) + 4) == packet + ACK_10


SETS_9600 = """
import sys, serial
with serial.serial_for_url(sys.argv[1], 9600, timeout=30) as port:
    port.write(bytes.fromhex("02 0a 01 76 31 30 30 03 47 00"))
    sys.stdin.read()
"""


@pytest.mark.parametrize("option", [("--rfc2217", "0"), ()], ids=["rfc2217", "pty"])
def test_a_program_at_a_wrong_rate_is_named_in_the_log_and_does_nothing(
    option: tuple[str, ...],
) -> None:
    with served("--ephemeral", *option) as sacbus:
        (link,) = sacbus.ready["links"]
        where = link.get("url") or link["path"]
        with subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", SETS_9600, where], stdin=subprocess.PIPE
        ) as program:
            report = sacbus.read_event("report")
            assert program.stdin is not None
            program.stdin.close()
            assert program.wait(PATIENCE) == 0
        assert (report["node"], report["what"]) == (None, "warning")
        assert where in report["text"]
        assert "has set 9600 baud, the line runs at 38400: bytes arrive garbled" in report["text"]
        assert sacbus.send_signal(signal.SIGTERM) == 0
        (bus,) = sacbus.read_event("stopped")["buses"]
        assert bus["bytes"] == 10
        assert [node["packets"] for node in bus["nodes"]] == [0, 0, 0]


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 0), (signal.SIGHUP, 129)]
)
def test_a_signal_closes_the_port_removes_symlink_and_lock_and_saves(
    tmp_path: Path, number: signal.Signals, status: int
) -> None:
    port, state = tmp_path / "port", tmp_path / "state"
    with served("--pty", str(port), "--state", str(state)) as sacbus:
        assert sacbus.link == str(port)
        device = port.readlink()
        made = device.stat().st_ctime_ns
        exchange(sacbus.link, encode(10, 1, b"m400"), ACK_10)
        assert sacbus.send_signal(number) == status
        assert [path.name for path in tmp_path.iterdir()] == ["state"]
        # Its number may be another program's by now.
        assert not device.exists() or device.stat().st_ctime_ns != made
        assert sorted(path.name for path in (state / "bus").iterdir()) == ["10", "11", "12"]
        stopped = json.loads(sacbus.text.splitlines()[-1])
        assert stopped["event"] == "stopped"
        assert stopped["buses"][0]["bytes"] == len(encode(10, 1, b"m400") + ACK_10)
        assert sacbus.errors() == ""


def test_who_ignores_hang_ups_is_left_running() -> None:
    # As nohup starts a program: with SIGHUP ignored.
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with served("--ephemeral") as sacbus:
            sacbus.process.send_signal(signal.SIGHUP)
            exchange(sacbus.link, encode(10, 1, b"m400"), ACK_10)
            assert sacbus.send_signal(signal.SIGTERM) == 0
    finally:
        signal.signal(signal.SIGHUP, before)


def test_the_stale_symlink_of_a_killed_run_is_replaced(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with served("--pty", str(port), "--ephemeral") as killed:
        assert killed.send_signal(signal.SIGKILL) == -signal.SIGKILL
    assert port.is_symlink()
    with served("--pty", str(port), "--ephemeral") as sacbus:
        exchange(str(port), encode(10, 1, b"m400"), ACK_10)
        assert sacbus.send_signal(signal.SIGTERM) == 0
    assert list(tmp_path.iterdir()) == []


def refused(*arguments: str) -> str:
    """What ``serve`` says when it does not begin: one line."""
    with started("serve", "--ephemeral", *arguments) as sacbus:
        assert sacbus.wait() == 1
        assert sacbus.text == ""
        error = sacbus.errors()
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    return error


def test_anything_else_at_the_path_is_refused_and_left_untouched(tmp_path: Path) -> None:
    file, directory, symlink, dangling = (tmp_path / name for name in "abcd")
    file.write_text("mine")
    (directory / "below").mkdir(parents=True)
    symlink.symlink_to(file)
    dangling.symlink_to("/dev/pts/9999")
    assert "a file is in the way" in refused("--pty", str(file))
    assert "a directory is in the way" in refused("--pty", str(directory))
    assert f"a symlink to {file} that is not ours" in refused("--pty", str(symlink))
    assert "a symlink to /dev/pts/9999 that is not ours" in refused("--pty", str(dangling))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c", "d"]
    assert file.read_text() == "mine"
    assert (directory / "below").is_dir()
    assert symlink.readlink() == file
    assert str(dangling.readlink()) == "/dev/pts/9999"


def test_a_path_that_is_served_is_refused_and_the_first_serves_on(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with served("--pty", str(port), "--ephemeral") as first:
        expected = f"the path is served by process {first.process.pid}, {port}"
        assert expected in refused("--pty", str(port))
        exchange(str(port), encode(10, 1, b"m400"), ACK_10)


def test_reports_are_json_lines_and_give_line_and_column() -> None:
    with served("--ephemeral") as sacbus:
        exchange(sacbus.link, encode(10, 1, b"V100 "), ACK_10)
        exchange(sacbus.link, encode(11, 1, b"?4"), bytes.fromhex("02 01 0b 06"))
        report = sacbus.read_event("report")
        assert (report["node"], report["what"], report["line"]) == (11, "refused", "?4")
        assert report["column"] == 1
        assert report["time_us"] > 0
        assert sacbus.send_signal(signal.SIGTERM) == 0
        assert sacbus.read_event("stopped")["buses"][0]["reports"] == {"refused": 1}


def test_a_process_that_was_held_up_says_so_and_by_how_much() -> None:
    # Soft ops: that the motion ends is told on the line, so it has to be punctual.
    with served("--ephemeral", "--set", "soft_ops=true") as sacbus:
        exchange(sacbus.link, encode(10, 1, b"m100v120a999d999"), ACK_10)
        sacbus.process.send_signal(signal.SIGSTOP)
        # Until after the end of the motion, 0.25 s: then it is due.
        stopped = time.monotonic()
        until(lambda: time.monotonic() - stopped > 0.5)
        sacbus.process.send_signal(signal.SIGCONT)
        late = sacbus.read_event("late")
        assert late["bus"] == "bus"
        assert late["late_us"] > 10_000
        assert late["time_us"] > 0
        assert sacbus.send_signal(signal.SIGTERM) == 0
        lateness = sacbus.read_event("stopped")["buses"][0]["lateness"]
        assert lateness["count"] > 0
        assert 0 <= lateness["p50_us"] <= lateness["p99_us"] <= lateness["worst_us"]
        assert lateness["worst_us"] >= late["late_us"]


def test_what_was_wrong_with_the_memory_is_told_once_it_serves(tmp_path: Path) -> None:
    (tmp_path / "bus").mkdir()
    (tmp_path / "bus" / "11").write_text("worn")
    with served("--state", str(tmp_path)) as sacbus:
        report = sacbus.read_event("report")
        assert (report["node"], report["what"]) == (11, "warning")
        assert "kept as 11.damaged" in report["text"]


def test_without_a_terminal_there_are_plain_lines_and_no_control_characters() -> None:
    with started("serve", "--ephemeral", "--nodes", "10,12-14") as sacbus:
        text = sacbus.read_until(lambda text: "Ctrl-C ends it\n" in text)
        first, connect, _ = text.splitlines()
        assert first.endswith(": 4 sac nodes (10,12-14) at 38400 baud")
        link = connect.removeprefix("connect to ")
        exchange(link, encode(10, 1, b" \x1b[2J bell \x07"), ACK_10)
        sacbus.read_until(lambda text: "bell" in text)
        assert sacbus.send_signal(signal.SIGINT) == 130
        assert "\\x1b[2J bell \\x07" in sacbus.text
        assert "\x1b" not in sacbus.text
        assert "\x07" not in sacbus.text
        assert re.search(r"stopped; port closed; \d+ transmissions.* collided\n$", sacbus.text)


def test_when_nobody_reads_its_output_any_more_serve_ends_in_order(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with served("--pty", str(port), "--ephemeral") as sacbus:
        assert sacbus.process.stdout is not None
        sacbus.process.stdout.close()
        with client(str(port)) as line:
            # In one go: upon the first report the other end may be closed already.
            line.write(encode(10, 1, b"?") * 2)
            assert sacbus.process.wait(30) == 1
        assert sacbus.errors() == ""
    assert list(tmp_path.iterdir()) == []


# -------------------------------------------------------------------- on a terminal


@contextmanager
def on_a_terminal(*arguments: str, columns: int, lines: int) -> Iterator[Sacbus]:
    """``sacbus serve`` with its output on a terminal of that size."""
    master, slave = os.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
    # shutil.get_terminal_size looks there first.
    environment = {
        name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "sacbus", "serve", *arguments],
        stdin=subprocess.DEVNULL,
        stdout=slave,
        stderr=subprocess.PIPE,
        env=environment,
    )
    os.close(slave)
    with process:
        try:
            yield Sacbus(process, master)
        finally:
            process.kill()
            os.close(master)


def drawings(text: str) -> list[list[str]]:
    """The tables that a terminal was shown, each as its lines, without colours."""
    plain = re.sub(r"\x1b\[\d*m", "", text).replace("\r\n", "\n")
    return [part.splitlines() for part in re.split(r"\x1b\[\d+A\x1b\[J|(?=node  state)", plain)]


def rows(text: str, address: int) -> list[list[str]]:
    """What the table said of a node, one entry per drawing."""
    return [
        line.split()
        for lines in drawings(text)
        for line in lines
        if line.split()[:1] == [str(address)]
    ]


def test_the_live_table_shows_the_motor_turn_and_stop_at_exactly_400_steps(
    tmp_path: Path,
) -> None:
    port = tmp_path / "port"
    with on_a_terminal("--pty", str(port), "--ephemeral", columns=80, lines=24) as sacbus:
        sacbus.read_until(lambda text: len(rows(text, 12)) >= 1)
        assert rows(sacbus.text, 10)[0][:4] == ["10", "STANDBY", "0", "0.0"]
        exchange(str(port), encode(10, 1, b"m400v120"), ACK_10)

        def turns(text: str) -> list[list[str]]:
            return [one for one in rows(text, 10) if one[1] != "STANDBY" and 0 < int(one[2]) < 400]

        seen = turns(sacbus.read_until(turns))[0]
        assert 0 <= int(seen[2]) < 400
        assert float(seen[3]) > 0
        assert "m400" in seen[4]
        sacbus.read_until(lambda text: rows(text, 10)[-1][1:3] == ["STANDBY", "400"])
        # It stays there; the table ends with what was true last, and the ACK is counted.
        assert sacbus.send_signal(signal.SIGINT) == 130
        assert rows(sacbus.text, 10)[-1] == ["10", "STANDBY", "400", "0.0", "1", "0"]
        assert rows(sacbus.text, 11)[-1] == ["11", "STANDBY", "0", "0.0", "0", "0"]
        # How late that was is no matter of this test; a long figure takes the bytes' place.
        line = r"line \d+% busy, 2 transmissions,( 18 bytes,)? 0 collided, late p50 \d+ p99 \d+ us"
        assert re.search(line, sacbus.text)
        end = r"late by \d+ us \(p50\).*\r\nstopped; port closed; \d+ transmissions.* collided\r\n$"
        assert re.search(end, sacbus.text)
        # Reports above the table, and the last words, are as long as they are.
        table = re.compile(r" *\d+  |node |line ")
        drawn = [line for lines in drawings(sacbus.text) for line in lines if table.match(line)]
        assert len(drawn) > 4
        assert max(map(len, drawn)) < 80


def test_reports_stand_above_the_table() -> None:
    with on_a_terminal("--ephemeral", columns=100, lines=30) as sacbus:
        text = sacbus.read_until(lambda text: rows(text, 12))
        link = text.split("connect to ")[1].split()[0]
        exchange(link, encode(10, 1, b"?4"), ACK_10)
        sacbus.read_until(lambda text: "refused in '?4'" in text.split("connect to")[1])
        assert sacbus.send_signal(signal.SIGTERM) == 0
        # The last drawing is of the end, however short a time after the one before.
        assert rows(sacbus.text, 10)[-1] == ["10", "STANDBY", "0", "0.0", "1", "0"]


def test_more_nodes_than_the_terminal_has_lines_never_scroll_it() -> None:
    with on_a_terminal("--ephemeral", "--nodes", "10-99", columns=80, lines=12) as sacbus:
        sacbus.read_until(lambda text: "more nodes" in text and "collided" in text)
        assert sacbus.send_signal(signal.SIGTERM) == 0
        assert max(len(lines) for lines in drawings(sacbus.text)) < 12


def test_without_the_table_a_terminal_gets_plain_lines() -> None:
    with on_a_terminal("--ephemeral", "--no-table", columns=80, lines=24) as sacbus:
        sacbus.read_until(lambda text: "Ctrl-C ends it" in text)
        assert sacbus.send_signal(signal.SIGINT) == 130
        assert "\x1b" not in sacbus.text
        assert "STANDBY" not in sacbus.text


def test_a_terminal_that_is_closed_ends_serve_in_order(tmp_path: Path) -> None:
    port = tmp_path / "port"
    master, slave = os.openpty()
    # A session of its own with this terminal, as a window's shell has it.
    start = (
        "import fcntl, os, sys, termios; os.setsid(); fcntl.ioctl(1, termios.TIOCSCTTY, 0);"
        "os.execv(sys.executable, [sys.executable, '-m', 'sacbus', 'serve', *sys.argv[1:]])"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", start, "--pty", str(port), "--ephemeral"],
        stdin=subprocess.DEVNULL,
        stdout=slave,
        stderr=slave,
    )
    os.close(slave)
    with process:
        try:
            until(port.is_symlink)
            os.close(master)
            # Whichever it notices first: the signal, or that nothing can be written.
            assert process.wait(30) in (129, 1)
        finally:
            process.kill()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_reader_that_stops_reading_stops_neither_the_bus_nor_its_end(tmp_path: Path) -> None:
    with served("--ephemeral", "--no-pace", "--pty", str(tmp_path / "port")) as sacbus:
        with client(sacbus.link) as port:
            # Each is reported in a line of its own: more than a pipe and the writer hold.
            for _ in range(3_000):
                port.write(encode(10, 1, b"no such command, to fill a line with words"))
                assert port.read(4) == bytes.fromhex("02 01 0a 06")
        # Nobody has read a report so far, and it ends in order all the same.
        sacbus.process.send_signal(signal.SIGTERM)
        assert sacbus.process.wait(PATIENCE) == 0
    assert list(tmp_path.iterdir()) == []
