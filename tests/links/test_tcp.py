"""TCP as it is: what its server does beyond what every server does."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from typing import Any

import pytest
import pytest_asyncio

from sacbus.links import LinkError, tcp
from sacbus.links.link import FormattedLink
from sacbus.links.tcp import TcpServer
from tests.links.programs import TcpProgram
from tests.links.rig import Ear, ServerRig, until

pytestmark = pytest.mark.asyncio


@pytest_asyncio.fixture
async def rig() -> AsyncIterator[ServerRig]:
    rig = ServerRig(TcpServer(), TcpProgram)
    await rig.start()
    yield rig
    rig.close()


async def test_without_an_address_it_is_for_this_machine() -> None:
    assert TcpServer().where == "socket://127.0.0.1:0"
    assert TcpServer("", 7000).where == "socket://127.0.0.1:7000"
    assert TcpServer("::", 7000).where == "socket://[::]:7000"


async def test_what_would_be_telnet_is_data_like_all_else(rig: ServerRig) -> None:
    negotiation = b"\xff\xfb\x00\xff\xfa\x2c\x01\x00\x00\x25\x80\xff\xf0\xff\xff"
    client = await rig.client_is_known()
    client.write(negotiation)
    ear = Ear(client)
    await until(lambda: rig.heard == negotiation)
    rig.link.send(negotiation)
    await until(lambda: ear.has(negotiation))


async def test_it_knows_no_rate_and_no_format(rig: ServerRig) -> None:
    await rig.client_is_known()
    assert rig.link.client_baud() is None
    assert not isinstance(rig.link, FormattedLink)


async def test_a_chunk_beyond_the_bound_passes_whole_when_nothing_waits(rig: ServerRig) -> None:
    ear = Ear(await rig.client_is_known())
    big = bytes(range(256)) * 4096
    rig.link.send(big)
    rig.link.send(b"more")
    assert rig.link.counters.bytes_out == len(big)
    assert rig.link.counters.dropped_out == 4
    await until(lambda: ear.has_bytes(len(big)))
    rig.link.send(b"more")
    await until(lambda: ear.has_bytes(len(big) + 4))
    assert ear.heard == big + b"more"


async def test_what_waits_for_a_slow_reader_stays_within_the_bound(rig: ServerRig) -> None:
    client, link = await rig.client_is_known(), rig.link
    assert isinstance(client, TcpProgram)
    assert isinstance(link, tcp.TcpLink)
    assert link._transport is not None
    for turn in range(2000):
        link.send(bytes(997))
        assert link._transport.get_write_buffer_size() <= tcp.BOUND
        if turn % 10 == 0:
            client.socket.recv(997)
            await asyncio.sleep(0)
    assert link.counters.dropped_out > 0


#: Not of this machine; one that is taken; two that are free.
FOREIGN, TAKEN, FREE, SECOND = "192.0.2.1", "127.0.0.1", "127.0.0.3", "127.0.0.4"


@pytest_asyncio.fixture
async def port() -> AsyncIterator[int]:
    """A port that is taken, at one address."""
    taken = TcpServer(TAKEN)
    await taken.open(lambda link: lambda: None)
    yield int(taken.where.rsplit(":", 1)[1])
    taken.close()


def stand_for(addresses: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have all names stand for these addresses."""

    async def resolve(_host: str, port: int, **_settings: object) -> list[Any]:
        kind = (socket.AF_INET, socket.SOCK_STREAM, 6, "")
        return [(*kind, (address, port)) for address in addresses]

    monkeypatch.setattr(asyncio.get_running_loop(), "getaddrinfo", resolve)


@pytest.mark.parametrize(
    "addresses", [[FREE], [FREE, SECOND], [FOREIGN, FREE], [FREE, FOREIGN], [FREE, FREE]]
)
async def test_a_name_is_served_at_those_of_its_addresses_that_can_be_had(
    addresses: list[str], port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_for(addresses, monkeypatch)
    server = TcpServer("several.example", port)
    await server.open(lambda link: lambda: None)
    for address in {*addresses} - {FOREIGN}:
        TcpProgram(f"socket://{address}:{port}").close()
    server.close()


@pytest.mark.parametrize("addresses", [[TAKEN, FREE], [FREE, TAKEN], [FREE, FOREIGN, TAKEN]])
async def test_a_name_is_not_served_by_half_when_somebody_else_has_the_port(
    addresses: list[str], port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_for(addresses, monkeypatch)
    with pytest.raises(LinkError, match=r"the port is taken, socket://several.example:"):
        await TcpServer("several.example", port).open(lambda link: lambda: None)


async def test_a_name_is_served_at_one_address_when_the_system_chooses_the_port(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stand_for([FREE, SECOND], monkeypatch)
    server = TcpServer("several.example")
    await server.open(lambda link: lambda: None)
    assert len(server._listeners) == 1
    server.close()


async def test_opening_that_is_cancelled_leaves_nothing_open() -> None:
    server = TcpServer("localhost")
    opening = asyncio.create_task(server.open(lambda link: lambda: None))
    await asyncio.sleep(0)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    rig = ServerRig(server, TcpProgram)
    await rig.start()
    rig.close()
