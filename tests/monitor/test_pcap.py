"""Captures that the monitor writes while it looks on: real processes, and one slow reader."""

from __future__ import annotations

import asyncio
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from nodes.sac import KIND
from sacbus.kernel import LineRate
from sacbus.monitor.pcap import Looked, PcapOutput
from sacbus.node import Said
from sacbus.watch import Spoken
from sacbus.wire import ack, encode
from sacbus.writer import WAITING
from tests.serving import PATIENCE, client, served, started, until
from tests.trace.captured import interfaces_of, packets_of, remarks_of, section_of, time_ns
from tests.trace.tshark import TSHARK, needs_tshark

M400 = encode(10, 1, b"m400")


def exchange(link: str, node: int = 10) -> None:
    with client(link) as port:
        port.write(encode(node, 1, b"m400"))
        assert port.read(4) == ack(1, node)


def read_until(descriptor: int, condition: Callable[[bytes], object]) -> bytes:
    """What comes from a pipe until the condition holds."""
    read = b""
    deadline = time.monotonic() + PATIENCE
    while not condition(read):
        readable, _, _ = select.select([descriptor], [], [], deadline - time.monotonic())
        assert readable, f"waited in vain, got {read!r}"
        more = os.read(descriptor, 65_536)
        assert more, f"it ended, got {read!r}"
        read += more
    return read


def has_packets(count: int) -> Callable[[bytes], bool]:
    def found(capture: bytes) -> bool:
        # Whole blocks only: what is written at once may come in pieces.
        at, seen = 0, 0
        while len(capture) >= at + 8:
            size = int.from_bytes(capture[at + 4 : at + 8], "little")
            seen += capture[at : at + 4] == b"\x06\0\0\0" and len(capture) >= at + size
            at += size
        return seen >= count

    return found


@pytest.mark.slow
def test_a_file_holds_what_the_text_tells_with_the_same_times(runtime: Path) -> None:
    port, file = str(runtime / "port"), runtime / "capture.pcapng"
    file.write_bytes(b"an old capture, which is longer than the new one" * 100)
    with (
        served("--ephemeral", "--pty", port),
        started("monitor", "--json", "--pcap", str(file), port) as monitor,
    ):
        begun = monitor.read_event("monitor")
        exchange(port)
        exchange(port, node=11)
        monitor.read_until(lambda text: text.count('"event":"ack"') == 2)
        assert monitor.send_signal(signal.SIGINT) == 130
        assert monitor.errors() == ""
    told: list[dict[str, Any]] = [json.loads(line) for line in monitor.text.splitlines()]
    said = [one for one in told if one["event"] in ("packet", "ack")]
    packets = packets_of(file.read_bytes())
    assert [one.packet_data.hex() for one in packets] == [one["bytes"] for one in said]
    assert [remarks_of(one)["sender"] for one in packets] == [one["sender"] for one in said]
    epochs = {time_ns(one) - event["start_ns"] for one, event in zip(packets, said, strict=True)}
    # Bus time 0 in time of day, the same for all: the differences stay exact.
    (epoch,) = epochs
    assert abs(epoch + begun["start_ns"] - time.time_ns()) < 3600 * 10**9
    (interface,) = interfaces_of(file.read_bytes())
    assert interface.options["if_name"] == "bus"
    assert interface.options["if_description"] == "sac at 38400 baud, exact times"


@pytest.mark.slow
def test_standard_output_is_the_capture_packet_by_packet(runtime: Path) -> None:
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port), started("monitor", "--pcap", "-", port) as monitor:
        assert monitor.process.stdout is not None
        output = monitor.process.stdout.fileno()
        capture = read_until(output, interfaces_of_all)
        for count in (2, 4):  # the line is still meanwhile: nothing waits for company
            exchange(port)
            capture += read_until(output, has_packets(2))
            assert len(packets_of(capture)) == count
        monitor.process.send_signal(signal.SIGINT)
        assert monitor.process.wait(PATIENCE) == 130
        assert os.read(output, 1) == b""
        assert "2 packets, 2 ACK" in monitor.errors()
    assert section_of(capture).length == -1


def interfaces_of_all(capture: bytes) -> bool:
    """Whether the section and its interface are there; they are written at once."""
    return b"sac at 38400 baud" in capture


@pytest.mark.slow
def test_a_line_that_is_none_of_ours_has_times_of_arrival(runtime: Path) -> None:
    file = runtime / "capture.pcapng"
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with started("monitor", "--json", "--pcap", str(file), link) as monitor:
            line, _ = server.accept()
            with line:
                monitor.read_event("monitor")
                before = time.time_ns()
                line.sendall(M400 + ack(1, 10))
                monitor.read_event("ack")
                until(lambda: has_packets(2)(file.read_bytes()))
                after = time.time_ns()
                assert monitor.send_signal(signal.SIGINT) == 130
    asked, answered = packets_of(file.read_bytes())
    assert (asked.packet_data, answered.packet_data) == (M400, ack(1, 10))
    # Counted back at the line's rate: it began before it came.
    line_time = LineRate().span(len(M400) + 4)
    assert before - line_time - 10**9 < time_ns(asked) < time_ns(answered) < after + 10**9
    assert remarks_of(answered)["delay"] == "not known"
    assert "sender" not in remarks_of(asked)
    (interface,) = interfaces_of(file.read_bytes())
    assert interface.options["if_name"] == link
    assert interface.options["if_description"] == "sac at 38400 baud, times of arrival"


@pytest.mark.slow
def test_a_reader_that_leaves_is_noticed_while_nobody_speaks(runtime: Path) -> None:
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port), started("monitor", "--pcap", "-", port) as monitor:
        assert monitor.process.stdout is not None
        read_until(monitor.process.stdout.fileno(), interfaces_of_all)
        monitor.process.stdout.close()
        assert monitor.process.wait(PATIENCE) == 1
        assert monitor.errors().count("\n") == 1  # what it looked at, and nothing else


@pytest.mark.slow
def test_the_reader_of_a_named_pipe_is_waited_for(runtime: Path) -> None:
    port, pipe = str(runtime / "port"), runtime / "pipe"
    os.mkfifo(pipe)
    with (
        served("--ephemeral", "--pty", port),
        started("monitor", "--pcap", str(pipe), port) as monitor,
    ):
        with pipe.open("rb", buffering=0) as reader:
            capture = read_until(reader.fileno(), interfaces_of_all)
            exchange(port)
            capture += read_until(reader.fileno(), has_packets(2))
        assert monitor.wait() == 1
    assert len(packets_of(capture)) == 2


@pytest.mark.slow
def test_what_is_not_wanted_is_not_captured(runtime: Path) -> None:
    port, file = str(runtime / "port"), runtime / "capture.pcapng"
    with (
        served("--ephemeral", "--pty", port),
        started("monitor", "--json", "--node", "11", "--pcap", str(file), port) as monitor,
    ):
        monitor.read_event("monitor")
        exchange(port)
        exchange(port, node=11)
        monitor.read_event("ack")
        assert monitor.send_signal(signal.SIGINT) == 130
    assert [one.packet_data for one in packets_of(file.read_bytes())] == [
        encode(11, 1, b"m400"),
        ack(1, 11),
    ]


@pytest.mark.slow
@needs_tshark
def test_tshark_reads_along(runtime: Path) -> None:
    port = str(runtime / "port")
    assert TSHARK is not None
    with served("--ephemeral", "--pty", port), started("monitor", "--pcap", "-", port) as monitor:
        reading = [
            TSHARK,
            "-l",
            "-i",
            "-",
            "-X",
            f"lua_script:{KIND.protocol.dissector}",
            "-c",
            "2",
        ]
        ran = subprocess.Popen(
            [*reading, "-T", "fields", "-e", "sac.command", "-e", "sac.response_time"],
            stdin=monitor.process.stdout,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        assert monitor.process.stdout is not None
        monitor.process.stdout.close()  # ours: tshark alone reads it
        assert monitor.process.stderr is not None
        monitor.process.stderr.readline()
        with ran:
            exchange(port)
            text, _ = ran.communicate(timeout=PATIENCE)
        assert text.decode().splitlines() == ["move 400 full steps\t", "\t0.000385000"]
        assert monitor.process.wait(PATIENCE) == 1


# ---------------------------------------------------------------- what is refused, and why


@pytest.mark.slow
def test_a_file_keeps_what_it_holds_until_there_is_something_to_look_at(runtime: Path) -> None:
    file = runtime / "capture.pcapng"
    file.write_bytes(b"an old capture")
    with started("monitor", "--pcap", str(file), str(runtime / "nowhere")) as monitor:
        assert monitor.wait() == 1
    assert file.read_bytes() == b"an old capture"


@pytest.mark.slow
def test_where_nothing_can_be_written_is_told_in_a_line(runtime: Path) -> None:
    file = runtime / "nowhere" / "capture.pcapng"
    with started("monitor", "--pcap", str(file)) as monitor:
        assert monitor.wait() == 1
        assert monitor.errors() == f"error: No such file or directory, {file}\n"


@pytest.mark.slow
def test_standard_output_is_not_for_two(runtime: Path) -> None:
    with started("monitor", "--pcap", "-", "--json") as monitor:
        assert monitor.wait() == 2
        assert monitor.errors() == (
            "error: --pcap - and --json both want standard output, give --pcap a file, "
            "see sacbus monitor --help\n"
        )


@pytest.mark.slow
def test_a_terminal_is_spared_a_capture(runtime: Path) -> None:
    master, slave = os.openpty()
    ran = subprocess.run(
        [sys.executable, "-m", "sacbus", "monitor", "--pcap", "-"],
        stdin=subprocess.DEVNULL,
        stdout=slave,
        stderr=subprocess.PIPE,
        check=False,
        timeout=PATIENCE,
    )
    os.close(slave)
    os.close(master)
    assert ran.returncode == 2
    assert ran.stderr.decode().startswith(
        "error: --pcap - writes bytes that are not for a terminal"
    )


# ------------------------------------------------------------------------ a slow reader


def test_what_a_slow_reader_does_not_take_is_counted_in_the_next_packet() -> None:
    line = Looked("wire", None, "sac", LineRate(), 1, "times")
    said = Said("garbage", None, None, b"U" * 250, "noise", "", 250)
    entries = 3 * WAITING
    reading, writing = os.pipe()
    read: list[bytes] = []

    def read_to_the_end() -> None:
        while more := os.read(reading, 65_536):
            read.append(more)

    async def scene() -> None:
        output = PcapOutput(writing, lambda fault: pytest.fail(repr(fault)))
        output.begin(line, 0)
        for number in range(entries):  # a pipe holds some 200 of these
            output.show(Spoken(number, number, None, 0, None, said, said.data))
        output.begin(line, 0)  # an interface more, for which there is no room
        reader = threading.Thread(target=read_to_the_end, daemon=True)
        reader.start()
        await output.room()
        output.show(Spoken(entries, entries, None, 0, None, said, said.data))
        output.close()
        os.close(writing)
        reader.join(PATIENCE)

    asyncio.run(scene())
    os.close(reading)
    packets = packets_of(b"".join(read))
    assert (packets[0].interface_id, packets[-1].interface_id) == (0, 1)
    assert time_ns(packets[-1]) == entries
    assert len(packets) > WAITING
    assert len(packets) < entries
    # Each entry's time is its number: what is missing before a packet is what it counts.
    expected = 0
    for packet in packets:
        expected += packet.options.get("epb_dropcount", 0)
        assert time_ns(packet) == expected
        expected += 1
