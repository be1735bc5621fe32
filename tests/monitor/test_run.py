"""The monitoring process from its first line to its exit status: real processes, real lines."""

from __future__ import annotations

import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from sacbus.wire import ack, encode
from tests.links.socat import Wire, needs_socat
from tests.serving import PATIENCE, Sacbus, client, served, started, until

pytestmark = pytest.mark.slow

M400, V100 = encode(10, 1, b"m400"), encode(11, 1, b"V100")


@contextmanager
def monitored(*arguments: str) -> Iterator[Sacbus]:
    """``sacbus monitor --json ARGUMENTS`` that looks at its line."""
    with started("monitor", "--json", *arguments) as monitor:
        monitor.ready = monitor.read_event("monitor")
        yield monitor


def events(text: str) -> list[dict[str, Any]]:
    """All whole lines of JSON."""
    return [json.loads(line) for line in text.split("\n")[:-1]]


def named(monitor: Sacbus, *names: str) -> list[str]:
    """The events so far that are among these."""
    return [one["event"] for one in events(monitor.text) if one["event"] in names]


def see(monitor: Sacbus, event: str, count: int = 1) -> list[dict[str, Any]]:
    """So many events of that name, once they are there."""

    def found(text: str) -> list[dict[str, Any]]:
        return [one for one in events(text) if one["event"] == event]

    return found(monitor.read_until(lambda text: len(found(text)) >= count))


def exchange(link: str, packet: bytes = M400, node: int = 10) -> None:
    with client(link) as port:
        port.write(packet)
        assert port.read(4) == ack(1, node)


# ----------------------------------------------------------------- on a bus of ours


def test_two_programs_are_seen_while_one_of_them_has_the_port_for_itself(runtime: Path) -> None:
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port, "--tcp", "0") as bus:
        url = bus.ready["links"][1]["url"]
        _, _, address = url.rpartition(":")
        with (
            client(port) as first,
            socket.create_connection(("127.0.0.1", int(address)), PATIENCE) as second,
            monitored(port) as monitor,
        ):
            assert (monitor.ready["through"], monitor.ready["link"]) == ("feed", port)
            assert (monitor.ready["protocol"], monitor.ready["nodes"]) == ("sac", [10, 11, 12])
            first.write(M400)
            assert first.read(4) == ack(1, 10)
            # What the other one hears is known to have passed, so it does not talk over it.
            heard = b""
            while len(heard) < len(M400) + 4:
                heard += second.recv(100)
            second.sendall(V100)
            assert first.read(len(V100) + 4) == V100 + ack(1, 11)
            acks = see(monitor, "ack", 2)
            packets = see(monitor, "packet", 2)
            assert [one["sender"] for one in packets[:1]] == [port]
            assert packets[1]["sender"].startswith("socket://")
            assert [one["destination"] for one in packets] == [10, 11]
            assert [one["body"] for one in packets] == ["m400", "V100"]
            assert [one["verdict"] for one in packets] == ["right", "right"]
            assert [one["sender"] for one in acks] == ["node 10", "node 11"]
            assert [one["delay_ns"] for one in acks] == [385_000, 385_000]
            assert [one["request_ns"] for one in acks] == [one["start_ns"] for one in packets]
            assert packets[0]["end_ns"] - packets[0]["start_ns"] == 2_604_166
            assert monitor.send_signal(signal.SIGINT) == 130
            assert monitor.errors() == ""
            summary = events(monitor.text)[-1]
            assert summary["event"] == "summary"
            assert (summary["packets"], summary["acks"], summary["naks"]) == (2, 2, 0)
            assert (summary["ack_delay_ns"], summary["collisions"]) == (385_000, 0)
            assert 0 < summary["load"] < 1


def test_other_names_of_a_link_lead_to_its_bus_and_so_does_none(runtime: Path) -> None:
    port, other = runtime / "port", runtime / "other"
    with served("--ephemeral", "--pty", str(port), "--tcp", "0") as bus:
        other.symlink_to(port)
        url = bus.ready["links"][1]["url"]
        for link in (str(other), url.replace("127.0.0.1", "localhost")):
            with monitored(link) as monitor:
                assert monitor.ready["bus"] == "bus"
        with monitored() as monitor:
            assert (monitor.ready["through"], monitor.ready["link"]) == ("feed", None)
            exchange(str(port))
            see(monitor, "ack")
            assert monitor.send_signal(signal.SIGTERM) == 0


def test_a_collision_is_told_with_both_senders(runtime: Path) -> None:
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port) as bus, monitored() as monitor:
        with client(bus.link) as line:
            line.write(M400 + M400)
            (collision,) = see(monitor, "collision")
        assert [one["sender"] for one in collision["senders"]] == [port, "node 10"]
        (silence,) = see(monitor, "no answer")
        assert (silence["destination"], silence["body"]) == (10, "m400")
        assert named(monitor, "packet", "collision", "no answer", "garbage") == [
            "packet",
            "collision",
            "no answer",
        ]


def test_text_is_for_people(runtime: Path) -> None:
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port), started("monitor", port) as monitor:
        assert monitor.process.stderr is not None
        heading = monitor.process.stderr.readline() + monitor.process.stderr.readline()
        assert f"bus bus ({port}): 3 nodes, sac at 38400 baud; exact times".encode() in heading
        exchange(port)
        exchange(port, encode(11, 1, b"?4"), 11)
        text = monitor.read_until(lambda text: text.count("ACK") == 2)
        # Seconds, silence before it, who to whom, the CRC, what it says.
        lines = text.splitlines()
        assert re.fullmatch(
            r" *\d+\.\d{6} {18}1 -> 10   ok      m400: move 400 full steps", lines[0]
        )
        assert re.fullmatch(r" *\d+\.\d{6} {5}\+0\.000385   10 -> 1 {12}ACK after 385 us", lines[1])
        assert re.fullmatch(r" *\d+\.\d{6} +node 11: refused in '\?4', column 1: .+", lines[3])
        assert "\x1b" not in text
        assert monitor.send_signal(signal.SIGINT) == 130
        summary = monitor.errors().splitlines()[-1]
        assert summary.startswith("2 packets, 2 ACK, 0 NAK, 0 unanswered, 0 garbage, 0 collisions")
        assert "ACK after 385 us (median), line " in summary


def test_what_is_not_asked_for_is_left_out_but_counted(runtime: Path) -> None:
    port = str(runtime / "port")
    with (
        served("--ephemeral", "--pty", port),
        monitored("--node", "11") as one_node,
        monitored("--errors") as faults,
        monitored("--node", "10", "--node", "12", "--clock") as two_nodes,
    ):
        for node in (10, 11, 12):
            exchange(port, encode(node, 1, b"V100"), node)
        exchange(port, encode(11, 1, b"?4"), 11)
        see(one_node, "ack", 2)
        see(faults, "report")
        see(two_nodes, "ack", 2)
        for monitor in (one_node, faults, two_nodes):
            assert monitor.send_signal(signal.SIGTERM) == 0
            assert events(monitor.text)[-1]["packets"] == 4
        assert [one["event"] for one in events(one_node.text)[1:-1]] == [
            "packet",
            "ack",
            "packet",
            "report",
            "ack",
        ]
        assert {one["event"] for one in events(faults.text)} == {"monitor", "report", "summary"}
        told = [one for one in events(two_nodes.text) if "source" in one]
        assert [(one["source"], one["destination"]) for one in told] == [
            (1, 10),
            (10, 1),
            (1, 12),
            (12, 1),
        ]
        assert all(re.match(r"\d{4}-\d\d-\d\dT.*\.\d{6}", one["clock"]) for one in told)


def test_when_the_bus_ends_it_says_so_in_one_line(runtime: Path) -> None:
    port = str(runtime / "port")
    for number, why in ((signal.SIGTERM, "has ended"), (signal.SIGKILL, "was killed")):
        with served("--ephemeral", "--pty", port) as bus, monitored(port) as monitor:
            bus.send_signal(number)
            assert monitor.wait() == 1
            assert monitor.errors() == (
                f"error: the bus {why}, {port}, start it again, or let --wait wait for it\n"
            )
            assert events(monitor.text)[-1]["event"] == "summary"
        # What a killed bus leaves behind goes with the next look.
        assert len(list((runtime / "sacbus").iterdir())) == (number == signal.SIGKILL)
    with started("monitor") as monitor:
        assert monitor.wait() == 1
    assert list((runtime / "sacbus").iterdir()) == []


def test_who_waits_sees_it_come_and_go_and_come_back(runtime: Path) -> None:
    port = str(runtime / "port")
    with started("monitor", "--json", "--wait", port) as monitor:
        (remark,) = see(monitor, "remark")
        assert remark["text"] == f"cannot open the line (no such file), {port}, waiting for it"
        for turn in (1, 2):
            with served("--ephemeral", "--pty", port) as bus:
                assert {one["through"] for one in see(monitor, "monitor", turn)} == {"feed"}
                exchange(port)
                see(monitor, "ack", turn)
                bus.send_signal(signal.SIGTERM)
            ended = see(monitor, "remark", turn + 1)[turn]
            assert ended["text"] == f"the bus has ended, {port}, waiting for it"
        assert monitor.send_signal(signal.SIGINT) == 130
        assert monitor.errors() == ""
        assert events(monitor.text)[-1]["acks"] == 2


def test_several_buses_are_listed_and_one_must_be_named(runtime: Path) -> None:
    a, b = str(runtime / "a"), str(runtime / "b")
    with served("--ephemeral", "--pty", a), served("--ephemeral", "--pty", b):
        with started("monitor") as monitor:
            assert monitor.wait() == 1
            error = monitor.errors()
        assert error.startswith("error: several buses run, ")
        assert error.count("\n") == 1
        assert {a, b} <= set(re.findall(r"[^ ,()]+", error))
        with monitored(b) as monitor:
            exchange(b)
            assert see(monitor, "packet")[0]["sender"] == b


@pytest.mark.parametrize("form", ["text", "json"])
def test_a_reader_that_leaves_ends_it_quietly(runtime: Path, form: str) -> None:
    port = str(runtime / "port")
    options = ("--json",) if form == "json" else ()
    with served("--ephemeral", "--pty", port), started("monitor", *options, port) as monitor:
        assert monitor.process.stdout is not None
        if form == "json":
            monitor.read_event("monitor")
        else:
            assert monitor.process.stderr is not None
            monitor.process.stderr.readline()
            monitor.process.stderr.readline()
        monitor.process.stdout.close()
        # Two writes: the first one may be taken by a pipe that is just being closed.
        for _ in range(2):
            exchange(port)
        assert monitor.process.wait(PATIENCE) == 1
        assert monitor.errors() == ""


def test_a_reader_that_stops_reading_delays_neither_the_bus_nor_the_end(runtime: Path) -> None:
    port = str(runtime / "port")
    with (
        served("--ephemeral", "--no-pace", "--pty", port) as bus,
        started("monitor", "--json", port) as monitor,
    ):
        monitor.read_event("monitor")
        with client(bus.link) as line:
            # More than pipe, writer, socket and feed hold together: 8 kB a line of it.
            for _ in range(60):
                line.write(b"\x55" * 40_960)
                line.write(V100)
                assert line.read(4) == ack(1, 11)
        # Whoever reads in the end learns how much is missing.
        monitor.read_until(lambda text: '"event":"missed"' in text)
        assert monitor.send_signal(signal.SIGINT) == 130
        told = events(monitor.text)
        missed = sum(one["lines"] for one in told if one["event"] == "missed")
        assert told[-1]["missed"] == missed > 0
        assert told[-1]["packets"] + told[-1]["acks"] < 120


def test_colours_are_for_a_terminal_and_hanging_up_ends_it(runtime: Path) -> None:
    port = str(runtime / "port")
    master, slave = os.openpty()
    with served("--ephemeral", "--pty", port):
        process = subprocess.Popen(
            [sys.executable, "-m", "sacbus", "monitor", port],
            stdin=subprocess.DEVNULL,
            stdout=slave,
            stderr=subprocess.PIPE,
        )
        os.close(slave)
        with process:
            try:
                assert process.stderr is not None
                process.stderr.readline()
                process.stderr.readline()
                exchange(port)
                terminal = Sacbus(process, master)
                terminal.read_until(lambda text: "ACK after 385 us\x1b[0m" in text)
                assert "\x1b[32m" in terminal.text
                assert terminal.send_signal(signal.SIGHUP) == 129
            finally:
                process.kill()
                os.close(master)


# ------------------------------------------------------------------ a line of others


@contextmanager
def other_bus() -> Iterator[tuple[int, str]]:
    """A pty that nobody of ours serves: its master's end, and its path."""
    master, slave = os.openpty()
    os.set_blocking(master, False)
    try:
        yield master, os.ttyname(slave)
    finally:
        os.close(slave)
        os.close(master)


def test_a_plain_listener_decodes_and_never_writes_a_byte(runtime: Path) -> None:
    with other_bus() as (master, path):
        with monitored(path) as monitor:
            assert (monitor.ready["through"], monitor.ready["bus"]) == ("link", None)
            os.write(master, M400)
            (packet,) = see(monitor, "packet")
            os.write(master, ack(1, 10))
            (answer,) = see(monitor, "ack")
            os.write(master, encode(99, 1, b"V100"))
            see(monitor, "no answer")
            os.write(master, b"hello")
            see(monitor, "garbage")
            assert (packet["body"], packet["sender"]) == ("m400", None)
            assert 0 < packet["end_ns"] - packet["start_ns"] <= 2_604_166
            # The answer was written only after the packet had been told; that may have been less
            # than a ms after it, and then it came in less time than a line would have taken.
            assert answer["request_ns"] == packet["start_ns"]
            delay = answer["delay_ns"]
            assert delay is None or delay == answer["start_ns"] - packet["end_ns"] >= 0
            assert monitor.send_signal(signal.SIGTERM) == 0
            summary = events(monitor.text)[-1]
            assert (summary["packets"], summary["unanswered"], summary["garbage"]) == (2, 1, 1)
            assert monitor.errors() == ""
        with pytest.raises(BlockingIOError):
            os.read(master, 100)


def test_a_tcp_server_is_listened_to_and_hears_nothing(runtime: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        url = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with started("monitor", "--json", "--baud", "115200", url) as monitor:
            line, _ = server.accept()
            with line:
                monitor.ready = monitor.read_event("monitor")
                assert (monitor.ready["through"], monitor.ready["baud"]) == ("link", 115_200)
                line.sendall(M400)
                (packet,) = see(monitor, "packet")
                assert 0 < packet["end_ns"] - packet["start_ns"] <= 868_055
                line.shutdown(socket.SHUT_WR)
                assert monitor.wait() == 1
                line.settimeout(PATIENCE)
                assert line.recv(100) == b""
            error = monitor.errors()
        assert error.startswith("error: the line is gone (")
        assert error.endswith(f", {url}, start it again, or let --wait wait for it\n")
        assert error.count("\n") == 1


@needs_socat
def test_a_wire_between_two_others_is_listened_to(runtime: Path) -> None:
    wire = Wire()
    wire.plug()
    try:
        with monitored(wire.near) as monitor, client(wire.far) as line:
            assert monitor.ready["through"] == "link"
            line.write(M400 + ack(1, 10))
            (answer,) = see(monitor, "ack")
            assert answer["request_ns"] == see(monitor, "packet")[0]["start_ns"]
            assert select.select([line.fileno()], [], [], 0)[0] == []
    finally:
        wire.close()


def test_a_link_that_is_not_there_is_refused_in_one_line(runtime: Path) -> None:
    with started("monitor", str(runtime / "nothing")) as monitor:
        assert monitor.wait() == 1
        assert monitor.text == ""
        error = monitor.errors()
    assert error.startswith("error: ")
    assert str(runtime / "nothing") in error
    assert error.count("\n") == 1


def test_a_stopped_bus_is_no_reason_to_hang(runtime: Path) -> None:
    # It answers nobody, so its port is opened like anybody's; that is refused where it is in use.
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port) as bus, client(port):
        bus.process.send_signal(signal.SIGSTOP)
        try:
            with started("monitor", port) as monitor:
                assert monitor.wait() == 1
                assert "another program has it" in monitor.errors()
        finally:
            bus.process.send_signal(signal.SIGCONT)
        until(lambda: bus.process.poll() is None)
