"""The watchdog: who drives nodes and goes away leaves none moving. Virtual time and real links."""

from __future__ import annotations

import asyncio
import signal
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import serial

from sacbus import open_bus
from sacbus.configuration import Configuration, NodeAt
from sacbus.daemon import HostedBus
from sacbus.host import run_virtual
from sacbus.kernel import Kernel, LineRate
from sacbus.links import MemoryClient, MemoryLink
from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt
from sacbus.wire import MOTHER, encode
from tests.links.socat import Wire
from tests.serving import PATIENCE, client, served

#: Motion without an end, for node 10 and for everybody.
RUN = encode(10, MOTHER, b"M")
ALL_RUN = encode(0, MOTHER, b"M")
#: 20 commands, each of 2 s, one after the other.
MANY = b"".join(encode(10, MOTHER, b"m400v60") for _ in range(20))


class Stage:
    """A watched bus of nodes 10 to 12 in virtual time, and programs on memory links."""

    def __init__(self, bus: HostedBus) -> None:
        self.bus = bus

    def program(self) -> MemoryClient:
        link = MemoryLink(f"program {self.bus.talkers + 1}")
        self.bus.attach(link)
        return link.client()

    def moving(self) -> set[int]:
        return {one.address for one in self.bus.snapshots() if one.state != "STANDBY"}

    def reports(self) -> list[str]:
        return [one.text for one in self.bus.bus.reports if "watchdog" in one.text]


def staged(
    play: Callable[[Stage], Awaitable[None]],
    *,
    watchdog: bool = True,
    nodes: tuple[NodeAt | int, ...] = (10, 11, 12),
) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=nodes, watchdog=watchdog)) as bus:
            await play(Stage(bus))

    run_virtual(Kernel(), scene())


def test_nodes_that_move_stop_when_the_program_that_talked_leaves() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(ALL_RUN)
        await asyncio.sleep(1)
        assert stage.moving() == {10, 11, 12}
        program.close()
        assert stage.moving() == set()
        where = stage.bus.snapshot(10).position_steps
        await asyncio.sleep(1)
        assert stage.bus.snapshot(10).position_steps == where
        assert stage.reports() == ["watchdog: program 1 is gone, stopped nodes 10, 11, 12"]

    staged(play)


def test_without_a_watchdog_they_go_on() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(RUN)
        await asyncio.sleep(1)
        program.close()
        await asyncio.sleep(1)
        assert stage.moving() == {10}
        assert stage.reports() == []

    staged(play, watchdog=False)


def test_who_has_only_listened_may_come_and_go() -> None:
    async def play(stage: Stage) -> None:
        listening, program = stage.program(), stage.program()
        program.write(RUN)
        await asyncio.sleep(1)
        assert listening.read()
        listening.close()
        await asyncio.sleep(1)
        assert stage.moving() == {10}
        program.close()
        assert stage.moving() == set()
        assert stage.reports() == ["watchdog: program 2 is gone, stopped node 10"]

    staged(play)


def test_a_client_that_comes_after_one_that_talked_has_a_name_of_its_own() -> None:
    async def play(stage: Stage) -> None:
        link = MemoryLink("port")
        stage.bus.attach(link)
        first = link.client()
        first.write(encode(10, MOTHER, b"v100"))
        await asyncio.sleep(1)
        first.close()
        stage.program().write(RUN)
        await asyncio.sleep(1)
        link.client().close()
        assert stage.moving() == {10}
        assert stage.reports() == []

    staged(play)


def test_nothing_moves_nothing_is_said() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(encode(10, MOTHER, b"m1"))
        await asyncio.sleep(60)
        program.close()
        await asyncio.sleep(1)
        assert stage.reports() == []

    staged(play)


def test_the_last_packet_of_who_leaves_moves_nothing_for_longer_than_a_millisecond() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(RUN)
        program.close()
        assert stage.moving() == set()
        # The packet arrives, the node begins, and is stopped.
        await asyncio.sleep(LineRate().span(7) / 1e9 + 0.000_5)
        assert stage.moving() == {10}
        await asyncio.sleep(0.001)
        assert stage.moving() == set()
        assert stage.reports() == ["watchdog: program 1 is gone, stopped node 10"]

    staged(play)


def test_what_waits_for_the_line_is_never_said_and_what_waits_in_a_node_never_runs() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(encode(10, MOTHER, b"m400v60"))
        await asyncio.sleep(0.1)
        program.write(encode(10, MOTHER, b"m400v60"))
        await asyncio.sleep(0.1)
        assert stage.bus.snapshot(10).pending
        program.write(encode(99, MOTHER, b"m400"))
        program.write(encode(11, MOTHER, b"m400"))
        program.close()
        await asyncio.sleep(60)
        here, there, _ = (one.position_steps for one in stage.bus.snapshots())
        assert 0 < here < 60
        assert not stage.bus.snapshot(10).pending
        # The packet to 99 was being sent, that to 11 waited.
        assert there == 0

    staged(play)


@pytest.mark.parametrize("line", [b"m400s1", b"m400t5000000"], ids=["held at sync", "waits"])
def test_a_command_that_has_been_loaded_and_waits_is_dropped(line: bytes) -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(encode(10, MOTHER, line))
        await asyncio.sleep(1)
        program.close()
        stage.program().write(encode(0, MOTHER, b"y"))
        await asyncio.sleep(60)
        assert stage.bus.snapshot(10).position_steps == 0
        assert stage.reports() == ["watchdog: program 1 is gone, stopped node 10"]

    staged(play)


def test_what_waits_for_the_estop_pin_to_be_let_go_is_dropped() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        stage.bus.panel(10).drive("estop", 0)
        program.write(RUN)
        await asyncio.sleep(1)
        assert stage.moving() == set()
        program.close()
        stage.bus.panel(10).drive("estop", 1)
        await asyncio.sleep(1)
        assert stage.moving() == set()
        assert stage.bus.snapshot(10).position_steps == 0

    staged(play)


def test_a_node_that_boots_or_is_off_is_left_alone() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(encode(11, MOTHER, b"M"))
        await asyncio.sleep(0.5)
        stage.bus.panel(12).power(on=False)
        program.close()
        assert [one.state for one in stage.bus.snapshots()] == ["BOOT", "STANDBY", "OFF"]
        assert stage.reports() == ["watchdog: program 1 is gone, stopped node 11"]

    staged(play, nodes=(NodeAt(10, "sac", {"boot": "cold"}), 11, 12))


def test_many_nodes_are_one_line() -> None:
    async def play(stage: Stage) -> None:
        program = stage.program()
        program.write(ALL_RUN)
        await asyncio.sleep(1)
        program.close()
        (report,) = stage.reports()
        assert report.endswith("stopped nodes 10, 11, 12, 13, 14, 15, 16, 17, 18, 19 and 40 more")

    staged(play, nodes=tuple(range(10, 60)))


def test_a_bus_that_is_taken_down_blames_nobody() -> None:
    reports: list[str] = []

    async def scene() -> None:
        configuration = Configuration(links=(TcpAt("127.0.0.1", 0),), watchdog=True)
        async with open_bus(configuration) as bus:
            bus.bus.report_watchers.append(lambda report: reports.append(report.text))
            url = urlsplit(bus.links[0].where)
            _, writer = await asyncio.open_connection(url.hostname, url.port)
            writer.write(RUN)
            await moves(bus)
        writer.close()

    asyncio.run(scene())
    assert reports == []


# --------------------------------------------------------------------- real links, real processes


async def moves(bus: HostedBus, *, at_all: bool = True) -> None:
    """Wait until node 10 moves, or does not."""
    async with asyncio.timeout(PATIENCE):
        while (bus.snapshot(10).state != "STANDBY") is not at_all:  # noqa: ASYNC110
            await asyncio.sleep(0.001)


@asynccontextmanager
async def watched(place: Place) -> AsyncIterator[HostedBus]:
    async with open_bus(Configuration(links=(place,), watchdog=True)) as bus:
        yield bus


#: A program that sets node 10 going on the port or URL that it is given, and stays until killed.
PROGRAM = f"""
import serial, sys, time
port = serial.serial_for_url(sys.argv[1], 38400, timeout=20)
port.write({RUN!r})
assert port.read(4) == bytes.fromhex("02 01 0a 06")
time.sleep(60)
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pty", "tcp", "rfc2217"])
def test_a_program_that_is_killed_leaves_nothing_moving(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It is known by what TCP tells at once: to wait until the link is let go would take too long.
    monkeypatch.setattr("sacbus.links.tcp.LINGER", 10 * PATIENCE)
    places: dict[str, Place] = {
        "pty": PtyAt(tmp_path / "port"),
        "tcp": TcpAt("127.0.0.1", 0),
        "rfc2217": Rfc2217At("127.0.0.1", 0),
    }

    async def scene() -> None:
        async with watched(places[kind]) as bus:
            where = bus.links[0].where
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-W", "ignore", "-c", PROGRAM, where
            )
            try:
                await moves(bus)
            finally:
                process.send_signal(signal.SIGKILL)
            await process.wait()
            await moves(bus, at_all=False)
            (report,) = [one.text for one in bus.bus.reports if "watchdog" in one.text]
            assert report.startswith(f"watchdog: {where}")
            assert report.endswith("is gone, stopped node 10")

    asyncio.run(scene())


@pytest.mark.slow
def test_an_adapter_that_is_pulled_out_leaves_nothing_moving() -> None:
    wire = Wire()

    async def scene() -> None:
        wire.plug()
        async with watched(AdapterAt(wire.near)) as bus:
            with serial.Serial(wire.far, 38_400) as real_master:
                real_master.write(RUN)
                await moves(bus)
                wire.unplug()
                await moves(bus, at_all=False)
            texts = [one.text for one in bus.bus.reports]
            assert texts[-1] == f"watchdog: {wire.near} is gone, stopped node 10"

    try:
        asyncio.run(scene())
    finally:
        wire.close()


@pytest.mark.slow
def test_serve_tells_what_its_watchdog_has_stopped(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with served("--ephemeral", "--watchdog", "--pty", str(port)) as bus:
        with client(str(port)) as program:
            program.write(RUN)
            assert program.read(4) == bytes.fromhex("02 01 0a 06")
        text = bus.read_until(lambda text: "watchdog" in text)
        assert f"watchdog: {port} is gone, stopped node 10" in text


@pytest.mark.slow
def test_a_configuration_asks_for_a_watchdog_too(tmp_path: Path) -> None:
    config = tmp_path / "bus.toml"
    config.write_text(
        "state = false\n[[bus]]\nwatchdog = true\n[[bus.nodes]]\naddress = 10\n"
        '[[bus.links]]\nkind = "tcp"\n'
    )
    with served(str(config)) as bus:
        url = urlsplit(bus.ready["links"][0]["url"])
        with socket.create_connection((url.hostname, url.port), timeout=PATIENCE) as program:
            program.sendall(RUN)
            assert program.recv(4) == bytes.fromhex("02 01 0a 06")
        text = bus.read_until(lambda text: "watchdog" in text)
        assert "is gone, stopped node 10" in text


def test_serve_refuses_the_option_beside_a_configuration(tmp_path: Path) -> None:
    config = tmp_path / "bus.toml"
    config.write_text("[[bus]]\n")
    done = subprocess.run(
        [sys.executable, "-m", "sacbus", "serve", str(config), "--watchdog"],
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 2
    assert b"--watchdog and a configuration contradict each other" in done.stderr
