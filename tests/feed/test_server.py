"""The daemon's side of the feed: what is told, to whom, and that it costs the bus nothing."""

from __future__ import annotations

import asyncio
import socket
import stat
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.feed import Feed, FeedServer, Line, Missed, Reached, Sent, Stopped, find
from sacbus.links import MemoryLink
from sacbus.mother import Mother
from sacbus.node import Report, ReportKind
from sacbus.wire import ack, encode
from tests.links.rig import until

M400 = encode(10, 1, b"m400")
#: From its first bit: ten bytes, the turnaround, the ACK's four.
M400_ENDS, ACK_STARTS, ACK_ENDS = 2_604_166, 2_989_166, 4_030_832


@asynccontextmanager
async def fed_bus(runtime: Path) -> AsyncIterator[tuple[HostedBus, FeedServer]]:
    async with open_bus(Configuration(nodes=(10, 11), name="bench")) as bus:
        feed = FeedServer(bus, runtime)
        assert await feed.open()
        try:
            yield bus, feed
        finally:
            feed.close()


@asynccontextmanager
async def looked_on(runtime: Path) -> AsyncIterator[Feed]:
    feed = await find(None, runtime)
    assert feed is not None
    try:
        yield feed
    finally:
        await feed.close()


async def told(feed: Feed, count: int) -> list[Line]:
    """The next lines but those of the time."""
    lines: list[Line] = []
    async with asyncio.timeout(30):
        while len(lines) < count:
            line = await feed.read()
            assert line is not None
            if not isinstance(line, Reached):
                lines.append(line)
    return lines


def test_the_hello_says_what_the_bus_is(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, _):
            bus.attach(MemoryLink())
            async with looked_on(runtime) as feed:
                hello = feed.hello
                assert (hello.bus, hello.protocol) == ("bench", "sac")
                assert (hello.baud, hello.bits, hello.lanes) == (38_400, 10, 1)
                assert hello.nodes == ((10, "sac"), (11, "sac"))
                assert [way.kind for way in hello.links] == ["memory"]
                assert hello.speed == 1
                assert 0 < hello.time <= bus.bus.kernel.now

    asyncio.run(scene())


def test_every_transmission_is_told_with_exact_times_and_its_sender(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, _), looked_on(runtime) as feed:
            link = MemoryLink()
            port = bus.attach(link)
            link.client().write(M400)
            asked, answered = await told(feed, 2)
            assert isinstance(asked, Sent)
            assert isinstance(answered, Sent)
            assert (asked.sender, asked.node, asked.data) == (port.name, None, M400)
            assert (answered.sender, answered.node) == ("node 10", 10)
            assert answered.data == ack(1, 10)
            start = asked.start
            assert asked.end == start + M400_ENDS
            assert (answered.start, answered.end) == (start + ACK_STARTS, start + ACK_ENDS)
            assert asked.hits == answered.hits == ()

    asyncio.run(scene())


def test_mother_is_named_and_so_are_reports(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, _), looked_on(runtime) as feed:
            await bus.mother().send(11, "?4")
            lines = await told(feed, 3)
            assert [type(one) for one in lines] == [Report, Sent, Sent]
            report, asked, _ = lines
            assert isinstance(report, Report)
            assert isinstance(asked, Sent)
            assert (report.address, report.kind, report.line) == (11, ReportKind.REFUSED, "?4")
            assert asked.sender == "mother"
            assert report == bus.bus.reports[-1]

    asyncio.run(scene())


def test_what_collided_is_told_as_it_arrived_with_the_times_of_the_overlap(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, _), looked_on(runtime) as feed:
            link = MemoryLink()
            bus.attach(link)
            # The second packet is on its way while the first one's ACK comes.
            link.client().write(M400 + M400)
            lines = [one for one in await told(feed, 2) if isinstance(one, Sent)]
            both = {one.sender: one for one in lines}
            answer = both["node 10"]
            (other,) = (one for one in lines if one is not answer)
            assert answer.hits == other.hits == ((answer.start, answer.end),)
            assert answer.data != ack(1, 10)
            assert other.data[:10] == M400
            assert other.data[10:] != M400

    asyncio.run(scene())


def test_the_time_is_told_after_what_happened(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, _), looked_on(runtime) as feed:
            await bus.mother().send(10, "V100")
            sent = [one for one in await told(feed, 2) if isinstance(one, Sent)]
            async with asyncio.timeout(30):
                while not isinstance(line := await feed.read(), Reached):
                    assert line is not None
            assert line.time > sent[-1].end
            assert line.clock > feed.hello.clock

    asyncio.run(scene())


def test_while_nobody_looks_on_the_bus_does_not_know_of_it(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, _):
            medium = bus.bus.medium
            assert (medium.watchers, bus.bus.report_watchers) == ([], [])
            async with looked_on(runtime), looked_on(runtime):
                await until(lambda: len(medium.watchers) == 1)
                assert len(bus.bus.report_watchers) == 1
            await bus.mother().send(10, "V100")
            # Who has left without a word is noticed when the next lines go out.
            await until(lambda: not medium.watchers)
            assert bus.bus.report_watchers == []

    asyncio.run(scene())


def test_who_sends_nothing_and_says_so_is_told_all_the_same(runtime: Path) -> None:
    # As `socat -u` and `nc` with no input do: they close their sending half at once.
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, feed):
            reader, writer = await asyncio.open_unix_connection(feed.where)
            writer.write(b"who are you?\n")
            writer.write_eof()
            async with asyncio.timeout(30):
                assert b'"event":"hello"' in await reader.readline()
                await until(lambda: bus.bus.medium.watchers)
                await bus.mother().send(10, "V100")
                assert b'"sender":"mother"' in await reader.readline()
            writer.close()
            await writer.wait_closed()

    asyncio.run(scene())


async def _say_much(mother: Mother, bus: HostedBus, lines: int) -> None:
    for _ in range(lines):
        bus.tell("a report of some length, so that it takes fewer of them " * 10)
    await mother.send(10, "V100")


@pytest.mark.slow
def test_a_slow_reader_misses_lines_and_is_told_how_many(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (bus, feed):
            mother = bus.mother()
            with socket.socket(socket.AF_UNIX) as slow:
                slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_096)
                slow.connect(str(feed.where))
                slow.settimeout(0)
                await until(lambda: bus.bus.medium.watchers)
                async with looked_on(runtime) as quick:
                    # More than socket and bound hold, and mother is answered all the same.
                    for _ in range(20):
                        await _say_much(mother, bus, 100)
                        lines = await told(quick, 102)
                        assert not any(isinstance(one, Missed) for one in lines)
                held = feed._clients[0]._transport
                assert held is not None
                assert 0 < held.get_write_buffer_size() < 2 * 256 * 1024
                text = b""

                def read_on() -> bool:
                    nonlocal text
                    with suppress(BlockingIOError):
                        text += slow.recv(65_536)
                    return b'"missed"' in text.rpartition(b"\n")[0]

                await until(read_on)
                got = [one for one in text.splitlines() if b'"report"' in one or b'"sent' in one]
                (missed,) = [one for one in text.splitlines() if b'"missed"' in one]
                assert missed.startswith(b'{"event":"missed","lines":')
                assert len(got) + int(missed[26:-1]) >= 2_000

    asyncio.run(scene())


def test_the_end_is_told_and_leaves_nothing_behind(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (_, server), looked_on(runtime) as feed:
            (path,) = runtime.iterdir()
            assert path == server.where
            assert stat.S_IMODE(path.stat().st_mode) == 0o600
            server.close()
            server.close()
            assert await told(feed, 1) == [Stopped()]
            assert await feed.read() is None
        assert list(runtime.iterdir()) == []

    asyncio.run(scene())


def test_a_closed_feed_can_be_opened_again(runtime: Path) -> None:
    async def scene() -> None:
        async with fed_bus(runtime) as (_, server):
            server.close()
            assert await server.open()
            async with looked_on(runtime) as feed:
                assert feed.hello.bus == "bench"

    asyncio.run(scene())


def test_a_feed_that_cannot_be_had_is_reported_and_the_bus_does_without(tmp_path: Path) -> None:
    async def scene() -> None:
        (tmp_path / "file").write_text("mine")
        async with open_bus(Configuration(nodes=(10,))) as bus:
            assert not await FeedServer(bus, tmp_path / "file").open()
            assert not await FeedServer(bus, tmp_path / ("long" * 30)).open()
            texts = [report.text for report in bus.bus.reports]
            assert [text.partition(" (")[0] for text in texts] == ["no feed for sacbus monitor"] * 2
            assert "set XDG_RUNTIME_DIR to a directory of yours" in texts[0]
            assert str(tmp_path / "file") in texts[0]

    asyncio.run(scene())
