"""A day of bus time with programs coming and going: what is used at its end is what was at noon."""

from __future__ import annotations

import asyncio
import gc
import os
import tracemalloc
from pathlib import Path

import pytest

from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.links import MemoryLink
from sacbus.links.places import PtyAt, Rfc2217At, TcpAt
from sacbus.wire import encode

pytestmark = pytest.mark.slow

HOUR = 3_600
REQUEST = encode(10, 1, b"m400v300")
ACK = bytes.fromhex("02 01 0a 06")


async def through_tcp(bus: HostedBus) -> None:
    host, _, port = bus.links[1].where.removeprefix("socket://").rpartition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(REQUEST)
    assert await reader.readexactly(4) == ACK
    writer.close()
    await writer.wait_closed()


async def through_the_pty(bus: HostedBus) -> None:
    descriptor = os.open(bus.links[0].where, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    os.write(descriptor, REQUEST)
    heard: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
    got = bytearray()

    def readable() -> None:
        got.extend(os.read(descriptor, 100))
        if len(got) >= len(ACK) and not heard.done():
            heard.set_result(bytes(got))

    asyncio.get_running_loop().add_reader(descriptor, readable)
    assert await heard == ACK
    asyncio.get_running_loop().remove_reader(descriptor)
    os.close(descriptor)


async def through_rfc2217(bus: HostedBus) -> None:
    # It asks for a wrong rate, says something, and is gone in the middle of it.
    host, _, port = bus.links[2].where.removeprefix("rfc2217://").rpartition(":")
    _, writer = await asyncio.open_connection(host, int(port))
    writer.write(b"\xff\xfb\x2c" + b"\xff\xfa\x2c\x01\x00\x00\x25\x80\xff\xf0" + REQUEST)
    await writer.drain()
    await asyncio.sleep(1)
    writer.transport.abort()


def descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="descriptors are counted in /proc")
def test_a_day_with_clients_coming_and_going_leaves_memory_and_descriptors_flat() -> None:
    used: list[tuple[int, int, int]] = []

    async def scene() -> None:
        links = (PtyAt(), TcpAt(), Rfc2217At())
        async with open_bus(Configuration(links=links)) as bus:
            memory = MemoryLink()
            bus.attach(memory)
            for hour in range(24):
                for _ in range(20):
                    await through_tcp(bus)
                    await through_the_pty(bus)
                    await through_rfc2217(bus)
                    client = memory.client()
                    client.write(REQUEST)
                    await asyncio.sleep(HOUR / 20)
                    assert client.read() == ACK
                    client.close()
                if hour in (11, 23):
                    gc.collect()
                    used.append((tracemalloc.get_traced_memory()[0], descriptors(), bus.talkers))
            assert bus.bus.kernel.now > 24 * HOUR * 10**9
            assert bus.snapshot(10).counters["ack"] == 24 * 20 * 3

    tracemalloc.start()
    try:
        run_virtual(Kernel(), scene())
    finally:
        tracemalloc.stop()
    (noon, open_at_noon, ports_at_noon), (evening, open_in_the_evening, ports) = used
    assert open_in_the_evening == open_at_noon
    assert ports == ports_at_noon == 2
    # A report a client is kept, up to a thousand; this is what a few hundred of them take.
    assert evening - noon < 200_000
