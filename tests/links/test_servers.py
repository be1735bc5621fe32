"""What every server must do: many programs at once, and none of them at another's expense."""

from __future__ import annotations

import asyncio
import shutil
import socket
import struct
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
import pytest_asyncio

from sacbus.links import Link, LinkError, tcp
from sacbus.links.rfc2217 import Rfc2217Link
from tests.links.programs import TcpProgram
from tests.links.rig import Ear, ServerRig, rig_of, until
from tests.links.servers import KINDS, ignore, port_of

pytestmark = pytest.mark.asyncio


@pytest_asyncio.fixture
async def rig(kind: str) -> AsyncIterator[ServerRig]:
    async with rig_of(kind) as rig:
        assert isinstance(rig, ServerRig)
        yield rig


def answer_all(rig: ServerRig) -> None:
    def deliver(data: bytes) -> None:
        rig.heard.extend(data)
        rig.link.send(b"answer")

    rig.deliver = deliver


async def test_each_program_has_a_link_of_its_own(rig: ServerRig) -> None:
    clients = [await rig.client_is_known() for _ in range(3)]
    ears = [Ear(client) for client in clients]
    assert len({link.where for link in rig.links}) == 3
    for number, link in enumerate(rig.links):
        link.send(b"for %d" % number)
    for number, ear in enumerate(ears):
        await until(lambda: ear.has(b"for %d" % number))
    for number, client in enumerate(clients):
        client.write(b"x" * (number + 1))
    await until(lambda: [link.counters.bytes_in for link in rig.links] == [1, 2, 3])
    counters = rig.counters
    assert (counters.clients, counters.bytes_in, counters.bytes_out) == (3, 6, 15)


async def test_who_leaves_disturbs_nobody_and_is_counted_on(rig: ServerRig) -> None:
    stays, leaves = await rig.client_is_known(), await rig.client_is_known()
    ear = Ear(stays)
    leaves.write(b"bye")
    await until(lambda: rig.heard == b"bye")
    await rig.leave(leaves)
    await until(lambda: rig.gone)
    assert rig.gone == [rig.links[1]]
    rig.links[0].send(b"still here")
    await until(lambda: ear.has(b"still here"))
    stays.write(b" me too")
    await until(lambda: rig.heard == b"bye me too")
    assert rig.counters.bytes_in == 10
    assert rig.counters.clients == 2


async def test_sixty_four_programs_may_come_at_once(rig: ServerRig) -> None:
    clients = [rig.client() for _ in range(64)]
    await until(lambda: len(rig.links) == 64)
    ears = [Ear(client) for client in clients]
    for client in clients:
        client.write(b"x")
    await until(lambda: rig.heard == b"x" * 64)
    for link in rig.links:
        link.send(b"to all")
    for ear in ears:
        await until(lambda: ear.has(b"to all"))
    assert rig.counters.clients == 64


@pytest.mark.slow
async def test_a_program_that_does_not_read_holds_up_nobody(rig: ServerRig) -> None:
    await rig.client_is_known()
    ear = Ear(await rig.client_is_known())
    sleeper, reader = rig.links
    for turn in range(1, 1001):
        sleeper.send(bytes(1024))
        reader.send(bytes(1024))
        await until(lambda: ear.has_bytes(turn * 1024))
    assert sleeper.counters.dropped_out > 0
    assert sleeper.counters.bytes_out < 1_000_000
    assert reader.counters.dropped_out == 0


async def test_what_does_not_fit_is_dropped_chunk_by_chunk(rig: ServerRig) -> None:
    # A packet of which a part is missing would be garbage; RFC 2217 could even lose its way.
    await rig.client_is_known()
    counters = rig.link.counters
    while counters.dropped_out < 3 * 1000:
        rig.link.send(b"\xff" * 1000)
    assert counters.dropped_out == 3 * 1000
    assert counters.bytes_out % 1000 == 0


async def test_what_was_kept_for_a_program_that_leaves_is_dropped_and_counted(
    rig: ServerRig,
) -> None:
    client = await rig.client_is_known()
    link = rig.link
    while not link.counters.dropped_out:
        link.send(bytes(1000))
    dropped = link.counters.dropped_out
    await rig.leave(client)
    await until(lambda: rig.gone)
    # As much as the transport may keep; the system's own buffers tell nobody.
    assert link.counters.dropped_out - dropped > tcp.BOUND - 2000
    assert rig.counters.dropped_out == link.counters.dropped_out


async def test_what_was_kept_and_has_gone_out_is_not_counted_as_dropped(rig: ServerRig) -> None:
    client = await rig.client_is_known()
    counters = rig.link.counters
    while not counters.dropped_out:
        rig.link.send(bytes(1000))
    dropped = counters.dropped_out
    ear = Ear(client)
    await until(lambda: ear.has_bytes(counters.bytes_out))
    await rig.leave(client)
    await until(lambda: rig.gone)
    assert counters.dropped_out - dropped < 1000


async def test_what_is_kept_when_the_server_closes_is_counted_too(rig: ServerRig) -> None:
    await rig.client_is_known()
    while not rig.link.counters.dropped_out:
        rig.link.send(bytes(1000))
    dropped = rig.counters.dropped_out
    rig.shut()
    assert rig.counters.dropped_out - dropped > tcp.BOUND - 2000


async def test_small_packets_go_out_at_once(rig: ServerRig) -> None:
    await rig.client_is_known()
    stream = rig.link._stream if isinstance(rig.link, Rfc2217Link) else rig.link
    assert isinstance(stream, tcp.TcpLink)
    assert stream._transport is not None
    sock = stream._transport.get_extra_info("socket")
    assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) != 0


async def test_a_program_that_resets_has_left_and_what_it_said_is_heard(rig: ServerRig) -> None:
    other = Ear(await rig.client_is_known())
    client = TcpProgram(rig.where)
    client.write(b"last words")
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    client.close()
    await until(lambda: rig.gone)
    assert rig.heard == b"last words"
    rig.links[0].send(b"next")
    await until(lambda: other.has(b"next"))


async def test_a_program_that_resets_in_silence_has_left_all_the_same(rig: ServerRig) -> None:
    await rig.client_is_known()
    client = rig._programs[0]
    assert isinstance(client, TcpProgram)
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    rig.forget(client)
    await until(lambda: rig.gone)
    rig.link.send(b"late")
    assert rig.link.counters.dropped_out == 4


async def test_all_of_a_program_that_talks_and_leaves_is_heard_though_it_is_answered(
    rig: ServerRig,
) -> None:
    # It closes with answers unread, and is sent more after that: the connection is reset under it.
    answer_all(rig)
    for _ in range(20):
        rig.heard.clear()
        client = rig.client()
        client.write(bytes(30_000))
        rig.forget(client)
        await until(lambda: len(rig.heard) == 30_000)


async def test_a_program_that_writes_no_more_still_gets_its_answers(rig: ServerRig) -> None:
    client = await rig.client_is_known()
    assert isinstance(client, TcpProgram)
    client.write(b"question")
    client.socket.shutdown(socket.SHUT_WR)
    await until(lambda: rig.heard == b"question")
    ear = Ear(client)
    rig.link.send(b"answer")
    await until(lambda: ear.has(b"answer"))
    assert rig.gone == []


async def test_a_program_that_writes_no_more_is_let_go_when_nothing_passes(
    rig: ServerRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tcp, "LINGER", 0.05)
    client = await rig.client_is_known()
    assert isinstance(client, TcpProgram)
    client.write(b"question")
    client.socket.shutdown(socket.SHUT_WR)
    await until(lambda: rig.heard == b"question")
    loop = asyncio.get_running_loop()
    start, ear = loop.time(), Ear(client)

    def spoken_to_for_long() -> bool:
        rig.link.send(b"answer")
        ear.has_bytes(0)
        return loop.time() > start + 3 * tcp.LINGER

    await until(spoken_to_for_long)
    assert rig.gone == []
    await until(lambda: rig.gone)
    with pytest.raises(LinkError, match=r"the program has left, .+, wait until it connects again"):
        rig.link.open(rig.hear)


@pytest.mark.skipif(shutil.which("socat") is None, reason="socat is not installed")
async def test_socat_may_write_a_packet_and_leave_at_once(rig: ServerRig, tmp_path: Path) -> None:
    packet = tmp_path / "packet"
    packet.write_bytes(bytes(range(255)) * 100)
    answer_all(rig)
    socat = await asyncio.create_subprocess_exec(
        "socat", "-u", f"FILE:{packet}", f"TCP:127.0.0.1:{port_of(rig.server)}"
    )
    assert await socat.wait() == 0
    await until(lambda: rig.heard == packet.read_bytes())


@pytest.mark.skipif(shutil.which("nc") is None, reason="nc is not installed")
async def test_nc_may_ask_shut_its_side_and_be_answered(rig: ServerRig) -> None:
    answer_all(rig)
    nc = await asyncio.create_subprocess_exec(
        "nc",
        *("-N", "127.0.0.1", str(port_of(rig.server))),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    out, _ = await nc.communicate(b"question")
    assert out.endswith(b"answer")
    assert rig.heard == b"question"


async def test_leaving_is_told_once_to_whom_the_program_came(rig: ServerRig) -> None:
    await rig.client_is_known()
    await rig.client_is_known()
    rig.links[0].close()
    assert rig.gone == [rig.links[0]]
    rig.shut()
    assert rig.gone == rig.links
    rig.shut()
    await asyncio.sleep(0)
    assert rig.gone == rig.links


async def test_who_is_not_wanted_may_be_hung_up_on_at_once(kind: str) -> None:
    server, program = KINDS[kind]
    turned_away: list[Link] = []

    def admit(link: Link) -> Callable[[], None]:
        link.close()
        return lambda: turned_away.append(link)

    it = server()
    await it.open(admit)
    client = program(it.where)
    await until(lambda: turned_away)
    assert not it.counters.dropped_out
    it.close()
    client.close()
    assert len(turned_away) == 1


async def test_a_fault_in_letting_one_in_ends_that_one_alone(kind: str) -> None:
    server, program = KINDS[kind]
    faults: list[object] = []
    asyncio.get_running_loop().set_exception_handler(
        lambda _loop, context: faults.append(context.get("exception"))
    )
    links: list[Link] = []

    def admit(link: Link) -> Callable[[], None]:
        links.append(link)
        if len(links) == 1:
            raise ValueError("a bug")
        return ignore(link)

    it = server()
    await it.open(admit)
    first = program(it.where)
    await until(lambda: faults)
    second = program(it.where)
    await until(lambda: it.counters.clients == 1 and len(links) == 2)
    second.write(b"x")
    await until(lambda: it.counters.bytes_in == 1)
    assert [str(fault) for fault in faults] == ["a bug"]
    it.close()
    for client in (first, second):
        client.close()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
async def test_who_comes_while_the_server_closes_finds_it_closed(kind: str) -> None:
    server, program = KINDS[kind]
    faults: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, fault: faults.append(fault))
    for turns in range(4):
        it = server()
        came: list[Link] = []

        def admit(link: Link) -> Callable[[], None]:
            came.append(link)
            return ignore(link)

        await it.open(admit)
        client = program(it.where)
        for _ in range(turns):
            await asyncio.sleep(0)
        it.close()
        seen = len(came)
        ear = Ear(client)
        with pytest.raises(OSError, match=r"closed|reset"):
            await until(lambda: ear.has_bytes(1000))
        assert len(came) == seen
        client.close()
    assert faults == []


async def test_a_link_tells_in_its_place_which_program_it_is(rig: ServerRig) -> None:
    client = await rig.client_is_known()
    assert isinstance(client, TcpProgram)
    host, port = client.socket.getsockname()
    assert rig.link.where == f"{rig.where} from {host}:{port}"
    assert rig.link.kind == rig.server.kind
