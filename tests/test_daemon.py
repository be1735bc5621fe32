"""Buses built from a configuration: in virtual and in real time, and taken down again."""

from __future__ import annotations

import asyncio
import json
import os
import threading
from collections.abc import Callable, Coroutine
from pathlib import Path
from random import Random
from typing import Any, TypeVar

import pytest
import serial

from sacbus import open_bus
from sacbus.bus import Bus
from sacbus.daemon import Configuration, HostedBus
from sacbus.host import RealHost, run_virtual
from sacbus.kernel import MS, SECOND, Kernel, LineRate, Ns
from sacbus.links import LinkError, MemoryLink, PathTaken, PtyLink
from sacbus.links.places import PtyAt
from sacbus.links.rfc2217 import Rfc2217Server
from sacbus.links.tcp import TcpServer
from sacbus.mother import LineLost, Mother
from sacbus.node import Heard, KindError, ReportKind, SettingError, find_kind
from sacbus.state import StateDirectory, StateError, read_memory
from sacbus.wire import encode

_T = TypeVar("_T")

ACK_10 = bytes.fromhex("02 01 0a 06")


def virtually(scene: Coroutine[Any, Any, _T]) -> _T:
    return run_virtual(Kernel(), scene)


async def until(condition: Callable[[], object]) -> None:
    """Let the loop turn until it holds; the time-out exists only to fail."""
    async with asyncio.timeout(30):
        while not condition():  # noqa: ASYNC110 (a bus in real time has no event to wait on)
            await asyncio.sleep(0)


# ------------------------------------------------------------------------ virtual time


def test_a_bus_opens_with_three_nodes_by_default() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            assert [(one.address, one.kind, one.state) for one in bus.snapshots()] == [
                (10, "sac", "STANDBY"),
                (11, "sac", "STANDBY"),
                (12, "sac", "STANDBY"),
            ]
            assert bus.links == []
            assert bus.bus.rate.baud == 38_400
            with pytest.raises(KeyError) as nobody:
                bus.snapshot(99)
            told = "no node 99 on bus, expected one of its own: 10, 11, 12"
            assert str(nobody.value) == told

    virtually(scene())


def test_ten_minutes_of_motion_are_over_at_once_and_exact() -> None:
    async def scene() -> float:
        async with open_bus() as bus:
            await bus.mother().send(10, "mv100")  # continuous, 333⅓ steps a second
            await asyncio.sleep(600)
            return bus.snapshot(10).position_steps

    assert virtually(scene()) == virtually(scene()) == pytest.approx(200_000, rel=1e-3)


def test_a_bus_can_be_waited_for_until_its_nodes_have_booted() -> None:
    async def scene(boot: str) -> tuple[str, int, str]:
        async with open_bus(Configuration(settings={"boot": boot})) as bus:
            before = bus.snapshot(11).state
            await bus.booted()
            return before, bus.now() // SECOND, bus.snapshot(11).state

    assert virtually(scene("booted")) == ("STANDBY", 0, "STANDBY")
    assert virtually(scene("cold")) == ("BOOT", 1, "STANDBY")


def test_the_same_configuration_gives_the_same_bytes_at_the_same_times() -> None:
    def trace(seed: int) -> list[tuple[int, bytes, bytes]]:
        found: list[tuple[int, bytes, bytes]] = []

        async def scene() -> None:
            async with open_bus(Configuration(nodes=(10, 11), seed=seed)) as bus:
                bus.bus.medium.watchers.append(
                    lambda one: found.append(
                        (one.start, one.data, one.arrived(0, len(one.data), seed))
                    )
                )
                link = MemoryLink()
                bus.attach(link)
                mother = bus.mother()
                client = link.client()
                call = asyncio.create_task(mother.send(10, "V100"))
                await asyncio.sleep(0.001)
                # A stranger on the medium itself talks over mother.
                bus.bus.medium.transmit("stranger", b"\x55", 0)
                await call
                client.write(encode(11, 1, b"m400"))
                await asyncio.sleep(1)

        virtually(scene())
        return found

    assert len(trace(1)) >= 5
    assert trace(1) == trace(1)
    assert trace(1) != trace(2)


def test_a_client_on_a_link_is_answered_with_the_lines_times() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            link = MemoryLink()
            bus.attach(link)
            heard: list[tuple[int, bytes]] = []
            kernel = bus.host.kernel
            client = link.client(lambda data: heard.append((kernel.now, data)))
            client.write(encode(10, 1, b"m400"))
            await asyncio.sleep(10)
            assert heard == [(2_604_166 + 385_000 + 1_041_666, ACK_10)]
            assert bus.links == [link]
            assert bus.snapshot(10).position_steps == 400

    virtually(scene())


def test_echo_gives_a_client_its_own_bytes_back() -> None:
    async def scene(*, echo: bool) -> bytes:
        async with open_bus() as bus:
            link = MemoryLink()
            bus.attach(link, echo=echo)
            client = link.client()
            client.write(encode(10, 1, b"m400"))
            await asyncio.sleep(10)
            return client.read()

    assert virtually(scene(echo=False)) == ACK_10
    assert virtually(scene(echo=True)) == encode(10, 1, b"m400") + ACK_10


def test_on_two_lanes_master_and_nodes_talk_at_once_unharmed() -> None:
    async def scene(lanes: int) -> int:
        async with open_bus(Configuration(lanes=lanes)) as bus:
            mother = bus.mother()
            call = asyncio.create_task(mother.send(10, "V100"))
            await asyncio.sleep(0.0035)  # the ACK is on its way
            bus.bus.medium.transmit("stranger", b"\x55", bus.bus.medium.master_lane)
            await call
            return mother.statistics[10].sent

    assert virtually(scene(1)) == 2
    assert virtually(scene(2)) == 1


def test_a_megabyte_of_noise_on_one_bus_costs_another_of_the_same_loop_nothing() -> None:
    exchange = 2_604_166 + 385_000 + 1_041_666
    noise = Random(0).randbytes(1_000_000)

    async def scene() -> None:
        async with (
            open_bus(Configuration(name="A")) as good,
            open_bus(Configuration(name="B")) as bad,
        ):
            link = MemoryLink()
            bad.attach(link)
            link.client().write(noise)
            mother = good.mother()
            while bad.host.kernel.now < good.bus.rate.span(len(noise)):
                answer = await mother.send(10, "V100")
                assert (answer.attempts, answer.round_trip) == (1, exchange)
                await asyncio.sleep(0.5)
            assert bad.bus.medium.counters().bytes >= len(noise)
            assert mother.statistics[10].acks > 500
            assert good.bus.medium.counters().collided == 0
            assert good.bus.report_counts.total() == 0

    virtually(scene())


def test_mother_starts_as_soon_as_the_line_is_free() -> None:
    async def scene() -> int:
        async with open_bus() as bus:
            bus.bus.medium.transmit("stranger", b"\x55\x55", 0)
            return (await bus.mother().send(10, "V100")).round_trip

    assert virtually(scene()) == 520_833 + 2_604_166 + 385_000 + 1_041_666


# ----------------------------------------------------------------- what it refuses to open


@pytest.mark.parametrize(
    ("configuration", "error", "what"),
    [
        (Configuration(kind="toaster"), KindError, "'toaster' is not installed"),
        (Configuration(settings={"ustep": 9}), SettingError, "whole number from 0 to 7, got 9"),
        (Configuration(settings={"colour": 1}), SettingError, "setting 'colour'"),
        (Configuration(state=Path("/dev/null/x")), StateError, "cannot create the state directory"),
        (Configuration(links=(PtyAt(Path("/dev/null")),)), PathTaken, "/dev/null"),
    ],
)
def test_what_cannot_be_opened_is_told_in_one_line(
    configuration: Configuration, error: type[Exception], what: str
) -> None:
    async def scene() -> None:
        async with open_bus(configuration):
            pass

    with pytest.raises(error, match=what) as told:
        asyncio.run(scene())
    assert "\n" not in str(told.value)


# -------------------------------------------------------------------------------- memory


def test_memory_is_saved_when_the_bus_closes_and_obeyed_when_it_opens(tmp_path: Path) -> None:
    async def opened(configuration: Configuration) -> float:
        async with open_bus(configuration) as bus:
            await bus.mother().send(10, "m400")
            await asyncio.sleep(0.5)
            return bus.snapshot(10).position_pulses

    microsteps = Configuration(nodes=(10,), settings={"ustep": 2}, state=tmp_path)
    first = virtually(opened(microsteps))
    stored = json.loads((tmp_path / "bus" / "10").read_text())
    assert stored["kind"] == "sac"
    assert stored["memory"]["ustep"] == 2
    # What is stored wins over the configuration's factory values.
    assert virtually(opened(Configuration(nodes=(10,), state=tmp_path))) == first
    assert virtually(opened(Configuration(nodes=(10,)))) < first


def test_memory_is_saved_when_the_scene_fails_too(tmp_path: Path) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10, 11), state=tmp_path)):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        virtually(scene())
    assert sorted(path.name for path in (tmp_path / "bus").iterdir()) == ["10", "11"]


def test_a_bus_that_could_not_open_saves_nothing(tmp_path: Path) -> None:
    (tmp_path / "port").touch()
    configuration = Configuration(state=tmp_path / "state", links=(PtyAt(tmp_path / "port"),))

    async def scene() -> None:
        async with open_bus(configuration):
            pass

    with pytest.raises(PathTaken):
        asyncio.run(scene())
    assert list((tmp_path / "state" / "bus").iterdir()) == []


def test_a_memory_that_cannot_be_saved_is_told_and_the_others_are_saved(tmp_path: Path) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(state=tmp_path)):
            (tmp_path / "bus" / "10").unlink()
            (tmp_path / "bus" / "10").mkdir()
            (tmp_path / "bus" / "10" / "something").touch()

    with pytest.raises(StateError, match="cannot write node memory"):
        virtually(scene())
    assert (tmp_path / "bus" / "11").is_file()
    assert (tmp_path / "bus" / "12").is_file()


def test_a_memory_whose_remains_cannot_be_removed_keeps_no_other_from_being_saved(
    tmp_path: Path,
) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(state=tmp_path)):
            for address in (10, 11, 12):
                (tmp_path / "bus" / str(address)).unlink()
            (tmp_path / "bus" / f".10.{os.getpid()}.new").mkdir()

    with pytest.raises(StateError, match="cannot write node memory"):
        virtually(scene())
    assert {path.name for path in (tmp_path / "bus").iterdir() if path.is_file()} == {"11", "12"}


def test_the_stored_address_wins_and_the_difference_is_told(tmp_path: Path) -> None:
    StateDirectory(tmp_path, "bus").save(10, "sac", {"d_id": 77})

    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10, 11), state=tmp_path)) as bus:
            assert [one.address for one in bus.snapshots()] == [77, 11]
            (report,) = bus.bus.reports
            assert report.address == 10
            assert "77" in report.text
            assert "wins over the configured" in report.text
            assert (await bus.mother().send(77, "m400")).node == 77
            with pytest.raises(TimeoutError):
                await bus.mother().send(10, "V100")

    virtually(scene())
    # Its memory stays where the configuration looks for it.
    assert json.loads((tmp_path / "bus" / "10").read_text())["memory"]["d_id"] == 77
    assert not (tmp_path / "bus" / "77").exists()


def on_disk(place: Path, address: int) -> dict[str, object]:
    return read_memory(place / "bus" / str(address)).memory


def test_a_change_is_on_the_disk_at_once_in_virtual_time(tmp_path: Path) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(state=tmp_path)) as bus:
            await bus.mother().send(11, "$CJ2")
            assert on_disk(tmp_path, 11)["ustep"] == 2
            assert on_disk(tmp_path, 10)["ustep"] == 0
            await bus.mother().send(11, "qs")
            assert "queue" in on_disk(tmp_path, 11)

    virtually(scene())


def test_a_change_is_on_the_disk_soon_in_real_time(tmp_path: Path) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(state=tmp_path)) as bus:
            await bus.mother().send(11, "$CJ2")
            await until(lambda: on_disk(tmp_path, 11)["ustep"] == 2)
            assert "sacbus memory" in {thread.name for thread in threading.enumerate()}
            await bus.mother().send(12, "$CJ3")
        # All that was waiting is written when the bus is closed, and nobody is left to write.
        assert on_disk(tmp_path, 12)["ustep"] == 3
        assert "sacbus memory" not in {thread.name for thread in threading.enumerate()}

    asyncio.run(scene())


def test_a_node_that_has_a_new_address_keeps_its_file(tmp_path: Path) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,), state=tmp_path)) as bus:
            mother = bus.mother()
            await mother.send(10, "$CM99")
            await mother.send(10, "$R")
            await mother.send(99, "$CJ2")

    virtually(scene())
    assert [one.name for one in (tmp_path / "bus").iterdir()] == ["10"]
    assert (on_disk(tmp_path, 10)["d_id"], on_disk(tmp_path, 10)["ustep"]) == (99, 2)


@pytest.mark.parametrize("run", [virtually, asyncio.run])
def test_a_save_that_fails_while_the_bus_runs_is_reported_and_the_node_goes_on(
    tmp_path: Path, run: Callable[[Coroutine[Any, Any, None]], None]
) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,), state=tmp_path)) as bus:
            mother = bus.mother()
            (tmp_path / "bus" / "10").unlink()
            (tmp_path / "bus" / "10" / "something").mkdir(parents=True)
            await mother.send(10, "$CJ2")
            await until(lambda: bus.bus.reports)
            (report,) = bus.bus.reports
            assert (report.address, report.kind) == (10, ReportKind.WARNING)
            assert "cannot write node memory" in report.text
            assert str(tmp_path / "bus" / "10") in report.text
            await mother.send(10, "v100")
            (tmp_path / "bus" / "10" / "something").rmdir()
            (tmp_path / "bus" / "10").rmdir()
            await mother.send(10, "$CJ3")
            await until((tmp_path / "bus" / "10").is_file)
            assert len(bus.bus.reports) == 1

    run(scene())
    assert on_disk(tmp_path, 10)["ustep"] == 3


def test_a_damaged_memory_is_told_and_the_node_starts_as_new(tmp_path: Path) -> None:
    (tmp_path / "bus").mkdir()
    (tmp_path / "bus" / "11").write_text("worn")

    async def scene() -> None:
        async with open_bus(Configuration(state=tmp_path)) as bus:
            (report,) = bus.bus.reports
            assert report.address == 11
            assert "kept as 11.damaged, factory values used" in report.text
            assert (await bus.mother().send(11, "m400")).node == 11

    virtually(scene())
    assert (tmp_path / "bus" / "11.damaged").read_text() == "worn"


def test_without_a_state_directory_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))

    async def scene() -> None:
        async with open_bus() as bus:
            await bus.mother().send(10, "m400")

    virtually(scene())
    assert list(tmp_path.iterdir()) == []


# ----------------------------------------------------------------------------- real time


def test_in_real_time_a_scaled_bus_runs_as_much_faster() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(speed=100)) as bus:
            clock, kernel = asyncio.get_running_loop().time, bus.host.kernel
            link = MemoryLink()
            bus.attach(link)
            client = link.client()
            begun_after = clock()
            client.write(encode(10, 1, b"m400"))
            begun, begun_before = kernel.now, clock()
            await until(lambda: bus.snapshot(10).position_steps == 400)
            ended_after = clock()
            bus.snapshot(10)
            passed, ended_before = (kernel.now - begun) / SECOND, clock()
            # Between readings of the clock on both sides, whatever the machine does meanwhile.
            assert passed <= 100 * (ended_before - begun_after) + 1e-6
            assert passed >= 100 * (ended_after - begun_before) - 1e-6
            assert client.read() == ACK_10

    asyncio.run(scene())


def test_without_pace_answers_come_before_their_line_time_is_over() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(pace=False)) as bus:
            link = MemoryLink()
            bus.attach(link)
            client = link.client()
            # 20 exchanges are 150 ms on the line; here each is over before the next line of code.
            for _ in range(20):
                client.write(encode(10, 1, b"V100 as before"))
                assert client.read() == ACK_10
            assert bus.host.kernel.now > 20 * 6 * MS

    asyncio.run(scene())


def test_mother_works_in_real_time_too() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            assert (await bus.mother().send(10, "m400a999d999")).attempts == 1
            await bus.mother().broadcast("y")
            await until(lambda: bus.snapshot(10).state == "CRUISE")

    asyncio.run(scene())


@pytest.mark.slow
def test_250_nodes_answer_a_round_over_a_pty_each_ack_from_the_right_one() -> None:
    addresses = range(4, 254)

    def round_of(port: serial.Serial) -> list[bytes]:
        answers = []
        for address in addresses:
            port.write(encode(address, 1, b"V100"))
            answers.append(port.read(4))
        return answers

    async def scene() -> None:
        everybody = Configuration(nodes=tuple(addresses), links=(PtyAt(),), pace=False)
        async with open_bus(everybody) as bus:
            with serial.Serial(bus.links[0].where, 38_400, timeout=30) as port:
                answers = await asyncio.to_thread(round_of, port)
                assert answers == [bytes((2, 1, address, 6)) for address in addresses]
                # A broadcast reaches all and nobody answers: the next bytes are to the next packet.
                port.write(encode(0, 1, b"m5v1000"))
                await until(lambda: all(node.position_steps == 5 for node in bus.snapshots()))
                port.write(encode(200, 1, b"V100"))
                assert await asyncio.to_thread(port.read, 4) == bytes((2, 1, 200, 6))
                assert port.in_waiting == 0

    asyncio.run(scene())


def test_the_pty_and_its_symlink_are_gone_when_the_bus_closes(tmp_path: Path) -> None:
    path = tmp_path / "port"

    async def scene() -> str:
        async with open_bus(Configuration(links=(PtyAt(path),))) as bus:
            assert bus.links[0].where == str(path)
            assert path.is_symlink()
            assert path.with_name("port.lock").is_file()
            return str(path.readlink())

    device = asyncio.run(scene())
    assert list(tmp_path.iterdir()) == []
    assert not Path(device).exists()


def test_a_bus_that_is_closed_takes_nothing_in() -> None:
    async def scene() -> HostedBus:
        async with open_bus() as bus:
            pass
        bus.host.arrive(lambda: pytest.fail("called"))
        bus.host.close()
        return bus

    assert asyncio.run(scene()).host.kernel.next_at() is None


def test_a_client_at_another_baud_rate_is_garbled_both_ways_and_told_once() -> None:
    async def scene() -> tuple[bytes, bytes, list[str], float]:
        async with open_bus() as bus:
            link = MemoryLink(where="memory", baud=38_400)
            bus.attach(link)
            client = link.client(baud=9_600)
            client.write(encode(10, 1, b"m400"))
            client.write(encode(11, 1, b"m400"))
            await asyncio.sleep(1)
            wrong = client.read()
            # Mother's traffic reaches the client too, at the wrong rate as anything else.
            await bus.mother().send(12, "y")
            heard = client.read()
            client.baud = 38_400
            client.write(encode(10, 1, b"m5"))
            await asyncio.sleep(1)
            assert client.read() == ACK_10
            return (
                wrong,
                heard,
                [str(one) for one in bus.bus.reports],
                bus.snapshot(10).position_steps,
            )

    wrong, heard, reports, steps = virtually(scene())
    assert ACK_10 not in wrong
    assert heard[:7] != encode(12, 1, b"y")
    assert len(heard) >= len(encode(12, 1, b"y"))
    assert steps == 5
    told = [one for one in reports if "baud" in one]
    assert told == [
        (
            "line: warning: the program on memory has set 9600 baud, the line runs at 38400: "
            "bytes arrive garbled"
        )
    ]


def test_a_second_bus_does_not_get_the_memory_that_the_first_one_has(tmp_path: Path) -> None:
    async def scene() -> None:
        configuration = Configuration(state=tmp_path)
        async with open_bus(configuration):
            with pytest.raises(StateError, match="in use by another sacbus"):
                async with open_bus(configuration):
                    pass
        async with open_bus(configuration):
            pass  # given back

    virtually(scene())


def test_mother_hears_that_the_bus_is_closed_before_and_after() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            mother = bus.mother()
            waiting = asyncio.ensure_future(mother.send(99, "y"))
            await asyncio.sleep(0)  # it is on its way
        for request in (waiting, mother.send(10, "y")):
            with pytest.raises(LineLost, match="the bus is closed"):
                async with asyncio.timeout(10):
                    await request

    asyncio.run(scene())
    virtually(scene())


def test_every_link_is_closed_with_its_bus(tmp_path: Path) -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            bus.attach(PtyLink(tmp_path / "mine"))
            with pytest.raises(PathTaken):
                bus.attach(PtyLink(tmp_path / "mine"))
            assert len(bus.links) == 1

    asyncio.run(scene())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"nodes": (3,)}, "nodes: expected addresses from 4 to 255, got 3"),
        ({"nodes": (10, 11, 10)}, "nodes: expected every address once, got 10 twice"),
        ({"speed": float("nan")}, "speed: expected a number from 0.000001 to 1000000"),
        ({"speed": float("inf")}, "speed: expected a number from 0.000001 to 1000000"),
        ({"baud": 0}, "baud: expected 300 to 4000000, got 0"),
        ({"lanes": 3}, "lanes: expected 1 or 2, got 3"),
    ],
)
def test_what_no_bus_can_be_is_refused(wrong: dict[str, Any], message: str) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(**wrong)):
            pass

    with pytest.raises(SettingError, match=message):
        virtually(scene())


def test_a_setting_that_is_given_wins_over_memory_and_is_kept(tmp_path: Path) -> None:
    async def steps(**settings: object) -> float:
        async with open_bus(Configuration(state=tmp_path, settings=settings)) as bus:
            await bus.mother().send(10, "m400p")
            await asyncio.sleep(10)
            return bus.snapshot(10).position_steps

    assert virtually(steps()) == 400
    assert virtually(steps(ustep=1)) == 200
    assert virtually(steps()) == 200
    assert virtually(steps(ustep=0)) == 400


def test_a_client_may_write_from_within_what_it_hears() -> None:
    async def scene() -> list[str]:
        async with open_bus(Configuration(pace=False)) as bus:
            link = MemoryLink()
            bus.attach(link)
            heard: list[str] = []

            def hear(data: bytes) -> None:
                heard.append(data.hex())
                if len(heard) == 1:
                    client.write(encode(11, 1, b"y"))

            client = link.client(hear)
            client.write(encode(10, 1, b"y"))
            await until(lambda: len(heard) == 2)
            return heard

    assert asyncio.run(scene()) == ["02010a06", "02010b06"]


class StuckLink(MemoryLink):
    """A link that cannot take down what it stands behind, such as a symlink in a locked folder."""

    def close(self) -> None:
        super().close()
        raise LinkError("cannot remove the symlink", self.where, "remove it by hand")


def test_a_link_that_cannot_be_closed_is_told_and_keeps_nothing_else_open(tmp_path: Path) -> None:
    mothers: list[Mother] = []

    async def hosting() -> None:
        async with open_bus(Configuration(links=(PtyAt(tmp_path / "port"),))) as bus:
            bus.attach(StuckLink())
            mothers.append(bus.mother())

    async def scene() -> None:
        with pytest.raises(LinkError, match="cannot remove the symlink"):
            await hosting()
        assert list(tmp_path.iterdir()) == []
        with pytest.raises(LineLost):
            await mothers[0].send(10, "y")

    asyncio.run(scene())


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:set(Daemon|Name).. is deprecated:DeprecationWarning"
)  # pyserial's
def test_mark_and_space_parity_over_rfc_2217_set_the_ninth_bits_on_a_line_that_has_some() -> None:
    rate = LineRate(9_600, bits=11)

    class NinthBits:
        def __init__(self) -> None:
            self.heard: list[tuple[bytes, bytes | None]] = []

        def hear(self, heard: Heard, now: Ns) -> None:
            self.heard.append((heard.data, heard.ninth))

    def address_then_operands(url: str) -> None:
        """What a controller of a nine-bit bus does: the parity is switched for the header."""
        with serial.serial_for_url(url, 9_600, parity=serial.PARITY_MARK, timeout=20) as port:
            port.write(b"\x51")
            port.parity = serial.PARITY_SPACE
            port.write(b"\x01\x02")
            port.parity = serial.PARITY_NONE
            port.write(b"\xff")

    async def scene() -> None:
        kernel = Kernel()
        bus = Bus(kernel, find_kind("sac").protocol, rate=rate)
        hosted = HostedBus(
            Configuration(nodes=()), bus, RealHost(kernel, asyncio.get_running_loop())
        )
        ear = NinthBits()
        bus.medium.listen(0, ear, None)
        try:
            server = Rfc2217Server(baud=9_600)
            await hosted.let_in(server)
            await asyncio.to_thread(address_then_operands, server.where)
            async with asyncio.timeout(20):
                while sum(len(data) for data, _ in ear.heard) < 4:  # noqa: ASYNC110
                    await asyncio.sleep(0.001)
        finally:
            hosted.close()
        assert b"".join(data for data, _ in ear.heard) == b"\x51\x01\x02\xff"
        assert b"".join(ninth or b"" for _, ninth in ear.heard) == b"\x01\x00\x00\x01"
        assert bus.report_counts == {}

    asyncio.run(scene())


class Quick(MemoryLink):
    """Whose program has said something before `open` comes back, as a pty's may."""

    def open(self, deliver: Callable[[bytes], None]) -> None:
        super().open(deliver)
        deliver(encode(10, 1, b"v1"))


class Refused(MemoryLink):
    def open(self, deliver: Callable[[bytes], None]) -> None:
        raise LinkError("no such thing", "nowhere", "do without")


def test_what_a_program_says_while_its_link_is_being_opened_is_heard() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            link = Quick()
            bus.attach(link)
            heard = bytearray()
            link.client(heard.extend)
            await asyncio.sleep(1)
            assert heard == bytes.fromhex("02 01 0a 06")

    run_virtual(Kernel(), scene())


def test_a_link_that_cannot_be_opened_leaves_nobody_on_the_line() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            with pytest.raises(LinkError):
                bus.attach(Refused())
            with pytest.raises(LinkError):
                bus.attach_live(Refused())
            assert bus.talkers == 0
            assert bus.bus.medium._lanes[0].listeners == [] == bus.bus.medium._taps

    run_virtual(Kernel(), scene())


def test_what_is_told_of_a_link_has_the_time_of_the_telling() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            began = bus.now()
            while isinstance(bus.host, RealHost) and bus.host.bus_now() < began + 20 * MS:  # noqa: ASYNC110
                await asyncio.sleep(0)
            bus.tell("gone")
            assert bus.bus.reports[-1].when >= began + 20 * MS

    asyncio.run(scene())


def test_those_who_leave_are_heard_to_the_end_but_not_without_bound() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=())) as bus:
            server = TcpServer()
            await bus.let_in(server)
            host, _, port = server.where.removeprefix("socket://").rpartition(":")
            for _ in range(30):
                _, writer = await asyncio.open_connection(host, int(port))
                writer.write(b"U" * 4_000)
                writer.close()
                await writer.wait_closed()
            await asyncio.sleep(60 * 60)
            assert bus.talkers == 0
            # The last of them may have found the line free again.
            assert 4_000 <= bus.bus.medium.counters().bytes < 30 * 4_000

    virtually(scene())


@pytest.mark.parametrize("run", [virtually, asyncio.run])
def test_a_bus_beside_another_has_its_time_and_leaves_it_running(
    run: Callable[[Coroutine[Any, Any, None]], None],
) -> None:
    async def scene() -> None:
        async with asyncio.timeout(20), open_bus(Configuration(nodes=(10,), name="one")) as one:
            async with open_bus(Configuration(nodes=(10,), name="other"), beside=one) as other:
                assert other.host.kernel is one.host.kernel
                await asyncio.gather(one.mother().send(10, "V1"), other.mother().send(10, "V1"))
                assert one.now() <= other.now()
            await one.mother().send(10, "V2")

    run(scene())
