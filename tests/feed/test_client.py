"""Finding the bus that is meant among those that run, those that did, and those that are stuck."""

from __future__ import annotations

import asyncio
import socket
from contextlib import AsyncExitStack
from pathlib import Path

import pytest

from sacbus.daemon import Configuration, open_bus
from sacbus.feed import FeedServer, Reached, SeveralBuses, client, find, running
from sacbus.links import LinkError, PtyLink
from tests.links.rig import until


async def serve(stack: AsyncExitStack, runtime: Path, name: str, link: Path) -> FeedServer:
    bus = await stack.enter_async_context(open_bus(Configuration(nodes=(10,), name=name)))
    bus.attach(PtyLink(link))
    feed = FeedServer(bus, runtime)
    assert await feed.open()
    stack.callback(feed.close)
    return feed


@pytest.mark.slow
def test_the_bus_is_found_by_its_link_and_the_others_are_left_alone(runtime: Path) -> None:
    async def scene() -> None:
        async with AsyncExitStack() as stack:
            first = await serve(stack, runtime, "first", runtime / "a")
            second = await serve(stack, runtime, "second", runtime / "b")
            for asked, name in (("a", "first"), ("b", "second")):
                feed = await find(str(runtime / asked), runtime)
                assert feed is not None
                assert feed.hello.bus == name
                await feed.close()
                await feed.close()
            feed = await find(str((runtime / "b").readlink()), runtime)
            assert feed is not None
            assert feed.hello.bus == "second"
            await until(lambda: len(first._clients) == 0)
            assert len(second._clients) == 1
            await feed.close()
            assert await find(str(runtime / "c"), runtime) is None

    asyncio.run(scene())


def test_without_a_link_it_must_be_the_only_one(runtime: Path) -> None:
    async def scene() -> None:
        with pytest.raises(LinkError) as refused:
            await find(None, runtime)
        assert str(refused.value) == (
            f"no bus of this user runs, {runtime}, start one or give a LINK"
        )
        async with AsyncExitStack() as stack:
            await serve(stack, runtime, "first", runtime / "a")
            feed = await find(None, runtime)
            assert feed is not None
            await feed.close()
            await serve(stack, runtime, "second", runtime / "b")
            with pytest.raises(SeveralBuses) as refused:
                await find(None, runtime)
            assert str(refused.value) == (
                f"several buses run, first ({runtime}/a), second ({runtime}/b), "
                "give the LINK of one"
            )

    asyncio.run(scene())


def test_remains_of_killed_runs_are_removed_on_the_way(runtime: Path) -> None:
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(runtime / "1-1.feed"))
        dead.listen()
    assert asyncio.run(running(runtime)) == []
    assert list(runtime.iterdir()) == []


def test_what_does_not_say_hello_in_time_or_at_all_is_passed_over(
    runtime: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client, "PATIENCE", 0.05)

    async def babble(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"220 mail.example.org\r\n")
        writer.close()

    async def scene() -> None:
        with socket.socket(socket.AF_UNIX) as stuck:
            stuck.bind(str(runtime / "1-1.feed"))
            stuck.listen()
            async with AsyncExitStack() as stack:
                server = await asyncio.start_unix_server(babble, runtime / "2-1.feed")
                stack.callback(server.close)
                await serve(stack, runtime, "sound", runtime / "a")
                (feed,) = await running(runtime)
                assert feed.hello.bus == "sound"
                await feed.close()

    asyncio.run(scene())


def test_a_line_that_was_cut_off_is_the_end(runtime: Path) -> None:
    async def scene() -> None:
        async with AsyncExitStack() as stack:
            server = await serve(stack, runtime, "bus", runtime / "a")
            feed = await find(None, runtime)
            assert feed is not None
            await until(lambda: server._clients)
            transport = server._clients[0]._transport
            assert transport is not None
            transport.write(b'{"event":"weather"}\n{"event":"ti')
            transport.close()
            async with asyncio.timeout(30):
                while isinstance(line := await feed.read(), Reached):
                    pass
            assert line is None
            await feed.close()

    asyncio.run(scene())
