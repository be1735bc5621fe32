"""Mother for coroutines: on a bus in this process in virtual time, and on a real serial line."""

from __future__ import annotations

import asyncio
import os
import tty
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from sacbus import Mother, open_bus
from sacbus.daemon import Configuration, HostedBus
from sacbus.host import run_virtual
from sacbus.kernel import MS, SECOND, Kernel
from sacbus.links import LinkError
from sacbus.mother import (
    Acknowledged,
    BadRequest,
    LineLost,
    NoAnswer,
    Refused,
    UnknownOutcome,
    addressed_line,
)

TWO_NODES = Configuration(nodes=(10, 11))


def virtually(play: Callable[[HostedBus, Mother], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a bus with nodes 10 and 11, in virtual time."""

    async def scene() -> None:
        async with open_bus(TWO_NODES) as bus:
            await play(bus, bus.mother())

    run_virtual(Kernel(), scene())


def test_a_command_is_acknowledged_and_then_runs() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        loop = asyncio.get_running_loop()
        answer = await mother.send(10, "m400")
        assert answer == Acknowledged(10, 1, 2_604_166 + 385_000 + 1_041_666)
        assert loop.time() == answer.round_trip / SECOND
        await asyncio.sleep(600)
        assert bus.snapshot(10).position_steps == 400
        assert bus.snapshot(11).position_steps == 0

    virtually(play)


def test_any_number_of_tasks_may_call_and_are_served_in_turn() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        order: list[int] = []

        async def ask(number: int) -> None:
            await mother.send(10 + number % 2, f"m{number}")
            order.append(number)

        await asyncio.gather(*(ask(number) for number in range(1, 20)))
        assert order == list(range(1, 20))
        await asyncio.sleep(60)
        assert bus.snapshot(10).position_steps == sum(range(2, 20, 2))
        assert bus.snapshot(11).position_steps == sum(range(1, 20, 2))

    virtually(play)


def test_broadcast_returns_when_the_next_packet_may_follow() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        await mother.broadcast("m400")
        assert bus.host.kernel.now == 2_604_166 + 1 * MS
        await asyncio.sleep(60)
        assert [node.position_steps for node in bus.snapshots()] == [400, 400]
        assert mother.statistics[0].sent == 1

    virtually(play)


def test_silence_raises_what_is_known_of_the_outcome() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(UnknownOutcome, match="node 99: 'm400' sent once"):
            await mother.send(99, "m400")
        with pytest.raises(NoAnswer, match="sent 3 times"):
            await mother.send(99, "m400", accept_duplicates=True)
        with pytest.raises(TimeoutError):
            await mother.send(99, "V100")
        assert mother.statistics[99].timeouts == 7

    virtually(play)


def test_what_cannot_be_sent_is_refused_at_once() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(BadRequest, match="expected characters of one byte, got '→'"):
            await mother.send(10, "hello →")
        with pytest.raises(BadRequest, match="byte 03"):
            await mother.broadcast(b"m4\x03")
        with pytest.raises(ValueError, match="node 3"):
            await mother.send(3, "m400")
        assert bus.host.kernel.now == 0
        assert isinstance(await mother.send(10, b" \xe9"), Acknowledged)
        assert isinstance(await mother.send(10, " é"), Acknowledged)

    virtually(play)


def test_a_call_that_is_cancelled_before_its_turn_is_never_sent() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        first = asyncio.create_task(mother.send(10, "m400"))
        queued = asyncio.create_task(mother.send(10, "m7"))
        await asyncio.sleep(0)
        queued.cancel()
        await asyncio.wait([first, queued])
        assert queued.cancelled()
        await asyncio.sleep(60)
        assert bus.snapshot(10).position_steps == 400
        assert mother.statistics[10].sent == 1

    virtually(play)


def test_a_call_that_is_cancelled_on_its_way_leaves_the_line_in_order() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        # Nobody is at 99: uncancelled, this would be sent three times.
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.001):
                await mother.send(99, "V100")
        # The next one waits until the answer is overdue, as half duplex demands.
        assert isinstance(await mother.send(10, "m400"), Acknowledged)
        assert mother.statistics[99].sent == 1
        assert mother.statistics[10].sent == 1

    virtually(play)


def test_two_mothers_of_one_bus_take_no_answer_of_each_others() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        other = bus.mother()
        assert isinstance(await mother.send(10, "m400"), Acknowledged)
        assert isinstance(await other.send(11, "m400"), Acknowledged)
        assert mother.statistics[11].acks == other.statistics[10].acks == 0

    virtually(play)


def test_mother_waits_by_the_clock_of_her_bus() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        await mother.until(3 * SECOND + 1)
        assert mother.now == bus.now() == 3 * SECOND + 1
        await mother.until(2 * SECOND)
        assert mother.now == 3 * SECOND + 1

    virtually(play)


def test_who_waits_for_a_time_is_told_when_the_line_goes() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        waiting = asyncio.create_task(mother.until(3 * SECOND))
        cancelled = asyncio.create_task(mother.until(3 * SECOND))
        await asyncio.sleep(1)
        cancelled.cancel()
        mother.lose("unplugged")
        with pytest.raises(LineLost, match="unplugged"):
            await waiting
        assert cancelled.cancelled()
        with pytest.raises(LineLost, match="unplugged"):
            await mother.until(4 * SECOND)

    virtually(play)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("85m3000a2d1", (85, "m3000a2d1")),
        ("085m1", (85, "m1")),
        ("0S", (0, "S")),
        ("00S", (0, "S")),
        ("10", (10, "")),
        ("255 hello", (255, " hello")),
        ("10.hello", (10, ".hello")),
        ("10\n", (10, "\n")),
    ],
)
def test_a_line_is_read_as_at_a_terminal(text: str, expected: tuple[int, str]) -> None:
    assert addressed_line(text) == expected


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("m400", "expected an address before the command"),
        ("", "expected an address"),
        (" 10m400", "expected an address"),
        ("٣m1", "expected an address"),
        ("256m1", "expected an address from 4 to 255, or 0"),
        ("9" * 5_000 + "m1", "expected an address from 4 to 255, or 0"),
    ],
)
def test_a_line_without_a_possible_address_is_refused(text: str, what: str) -> None:
    with pytest.raises(BadRequest, match=what):
        addressed_line(text)


# ------------------------------------------------------------------- on a real serial line


class Peer:
    """The other end of a serial line; it says to each packet what its script says next."""

    def __init__(self, *answers: bytes) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._answers = list(answers)
        self.heard: list[bytes] = []
        self.spoken_to = asyncio.Event()

    def listen(self) -> None:
        asyncio.get_running_loop().add_reader(self.master, self._hear)

    def _hear(self) -> None:
        # Mother writes a packet in one piece, and a pty keeps it one.
        self.heard.append(os.read(self.master, 4_096))
        self.spoken_to.set()
        if self._answers:
            os.write(self.master, self._answers.pop(0))

    def hang_up(self) -> None:
        asyncio.get_running_loop().remove_reader(self.master)
        self.close()

    def close(self) -> None:
        for descriptor in (self.master, self._slave):
            if descriptor >= 0:
                os.close(descriptor)
        self.master = self._slave = -1


@contextmanager
def peer(*answers: bytes) -> Iterator[Peer]:
    made = Peer(*answers)
    try:
        yield made
    finally:
        made.close()


ACK_10 = bytes.fromhex("02 01 0a 06")
NAK_10 = bytes.fromhex("02 01 0a 15")


def on_a_line(peer: Peer, play: Callable[[Mother], Awaitable[None]]) -> None:
    async def scene() -> None:
        peer.listen()
        async with Mother.connect(peer.path) as mother:
            await play(mother)

    asyncio.run(scene())


def test_a_serial_port_is_driven_by_the_same_mother() -> None:
    with peer(ACK_10) as other:

        async def play(mother: Mother) -> None:
            answer = await mother.send(10, "m400")
            assert (answer.node, answer.attempts) == (10, 1)
            assert answer.round_trip > 0

        on_a_line(other, play)
        assert other.heard == [b"\x02\x0a\x01m400\x03\xde\x00"]


def test_nak_over_a_serial_port_is_retried_and_then_refused() -> None:
    with peer(NAK_10, NAK_10, ACK_10, NAK_10, NAK_10, NAK_10) as other:

        async def play(mother: Mother) -> None:
            assert (await mother.send(10, "m400")).attempts == 3
            with pytest.raises(Refused):
                await mother.send(10, "m400")

        on_a_line(other, play)
        assert len(other.heard) == 6


def test_an_answer_may_come_in_pieces_and_amid_noise() -> None:
    with peer(b"\xff\x55\x02\x01") as other:

        async def play(mother: Mother) -> None:
            call = asyncio.create_task(mother.send(10, "m400"))
            await other.spoken_to.wait()
            os.write(other.master, b"\x0a")
            os.write(other.master, b"\x06\x99")
            assert (await call).attempts == 1

        on_a_line(other, play)


def test_a_line_that_hangs_up_fails_what_waits_and_what_comes_later() -> None:
    with peer() as other:

        async def play(mother: Mother) -> None:
            waiting = [asyncio.create_task(mother.send(10, "m400")) for _ in range(2)]
            await other.spoken_to.wait()
            other.hang_up()
            for call in waiting:
                with pytest.raises(LineLost, match="the line is gone"):
                    await call
            with pytest.raises(ConnectionError):
                await mother.send(10, "m400")

        on_a_line(other, play)


def test_a_line_without_dtr_says_so() -> None:
    async def tcp() -> None:
        server = await asyncio.start_server(lambda _reader, writer: writer.close(), "127.0.0.1", 0)
        async with server:
            port = server.sockets[0].getsockname()[1]
            async with Mother.connect(f"socket://127.0.0.1:{port}") as mother:
                with pytest.raises(BadRequest, match="this line has no DTR to set"):
                    mother.pull_dtr()

    asyncio.run(tcp())
    with peer() as other:  # a pty has none either

        async def play(mother: Mother) -> None:
            with pytest.raises(BadRequest, match="this line has no DTR to set"):
                mother.set_dtr(asserted=True)

        on_a_line(other, play)

    async def hosted(_bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(BadRequest, match="this line has no DTR to set"):
            mother.pull_dtr()

    virtually(hosted)


def test_a_call_that_outlives_the_connection_is_told() -> None:
    async def scene(other: Peer) -> None:
        other.listen()
        async with Mother.connect(other.path) as mother:
            waiting = asyncio.create_task(mother.send(10, "m400"))
            await other.spoken_to.wait()
        with pytest.raises(LineLost, match="was closed"):
            await waiting
        with pytest.raises(LineLost, match="was closed"):
            await mother.send(10, "m400")
        # Open again, for the line was really let go.
        async with Mother.connect(other.path):
            pass

    with peer() as other:
        asyncio.run(scene(other))


def test_a_line_is_had_by_one_alone() -> None:
    async def scene(other: Peer) -> None:
        async with Mother.connect(other.path):
            with pytest.raises(LinkError, match="another program has it"):
                async with Mother.connect(other.path):
                    pass

    with peer() as other:
        asyncio.run(scene(other))


@pytest.mark.parametrize(
    ("link", "what"),
    [
        ("/nonexistent/port", "no such file"),
        ("/", "it is a directory"),
        ("/dev/null", "it is not a serial port"),
        ("socket://localhost:1", "connection refused"),
    ],
)
def test_a_link_that_cannot_be_had_is_told_in_one_line(link: str, what: str) -> None:
    async def scene() -> None:
        async with Mother.connect(link):
            pass

    with pytest.raises(LinkError, match=what) as told:
        asyncio.run(scene())
    assert link in str(told.value)
    assert "\n" not in str(told.value)


def test_who_is_asked_for_something_else_than_a_node_and_a_line_says_what_it_wants() -> None:
    async def play(_bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(BadRequest, match=r"^node '10': expected a whole number .*, got str$"):
            await mother.send("10", "m1")  # type: ignore[arg-type]  # what people do
        with pytest.raises(BadRequest, match=r"^line 400: expected str or bytes, got int$"):
            await mother.send(10, 400)  # type: ignore[arg-type]  # as above
        with pytest.raises(BadRequest, match=r"^line None: expected str or bytes"):
            await mother.broadcast(None)  # type: ignore[arg-type]  # as above

    virtually(play)
