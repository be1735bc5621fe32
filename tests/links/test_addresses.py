"""Where servers listen: hosts, addresses, ports, and what is said of those that cannot be had."""

from __future__ import annotations

import asyncio
import os
import resource
import socket
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import pytest_asyncio

from tests.links.rig import ServerRig, rig_of, until
from tests.links.servers import KINDS, AnyServer, ignore, port_of, refusal

pytestmark = pytest.mark.asyncio

NOBODY = 65_534

# Python loads its codec of host names when it is first used, and for good or not at all: not in a
# test that lets it have no file.
"".encode("idna")


@pytest_asyncio.fixture
async def rig(kind: str) -> AsyncIterator[ServerRig]:
    async with rig_of(kind) as rig:
        assert isinstance(rig, ServerRig)
        yield rig


async def test_the_port_is_the_system_s_choice_until_one_is_given(
    server: type[AnyServer],
) -> None:
    first = server()
    assert port_of(first) == 0
    await first.open(ignore)
    port = port_of(first)
    assert port != 0
    assert first.where.split("://")[1] == f"127.0.0.1:{port}"
    first.close()
    assert port_of(first) == 0
    second = server("127.0.0.1", port)
    await second.open(ignore)
    assert port_of(second) == port
    second.close()


async def test_a_server_may_be_opened_again_at_its_port_at_once(kind: str) -> None:
    server, program = KINDS[kind]
    chosen = server()
    await chosen.open(ignore)
    port = port_of(chosen)
    chosen.close()
    it = server("127.0.0.1", port)
    for turn in range(1, 4):
        await it.open(ignore)
        client = program(it.where)
        client.write(b"x")
        await until(lambda: it.counters.bytes_in == turn)
        it.close()
        client.close()
    assert it.counters.clients == 3


async def test_a_port_that_is_taken_is_told_in_one_line(
    rig: ServerRig, server: type[AnyServer]
) -> None:
    error = await refusal(server("127.0.0.1", port_of(rig.server)))
    assert str(error) == (
        f"the port is taken, {rig.where}, end the program that has it, or choose another port"
    )
    client = await rig.client_is_known()
    client.write(b"undisturbed")
    await until(lambda: rig.heard == b"undisturbed")


@pytest.mark.parametrize("host", ["no.such.host", "a..b", "x" * 70, "1.2.3.4.5", "a b"])
async def test_a_host_that_does_not_exist_is_told_in_one_line(
    server: type[AnyServer], host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def resolve(host: str, _port: int, **_settings: object) -> object:
        host.encode("idna")  # as the system's resolver does first; no test asks a real one
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(asyncio.get_running_loop(), "getaddrinfo", resolve)
    error = await refusal(server(host, 7000))
    assert error.what.startswith("no such host (")
    assert error.where.endswith(f"://{host}:7000")
    assert error.remedy == "check the name, or give an address"


async def test_an_address_of_another_machine_is_told_in_one_line(
    server: type[AnyServer],
) -> None:
    error = await refusal(server("192.0.2.1", 0))
    assert error.what == "this machine has no such address"
    assert error.remedy.startswith("use 127.0.0.1 or ::1 for this machine alone, 0.0.0.0")


@pytest.mark.parametrize("port", [-1, 65_536])
async def test_a_port_that_cannot_be_is_told_in_one_line(
    server: type[AnyServer], port: int
) -> None:
    assert (await refusal(server("127.0.0.1", port))).what == "there is no such port"


@pytest.fixture
def unprivileged() -> Iterator[None]:
    """An ordinary user's rights, which root lays down for the while."""
    first = Path("/proc/sys/net/ipv4/ip_unprivileged_port_start")
    if not first.exists() or int(first.read_text()) <= 80:
        pytest.skip("here anybody may have a port below 1024")
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    yield
    os.seteuid(0)


async def test_a_port_of_the_system_s_is_told_in_one_line(
    server: type[AnyServer], unprivileged: None
) -> None:
    error = await refusal(server("127.0.0.1", 80))
    assert (error.what, error.remedy) == ("permission denied", "choose a port from 1024 on")


def _has_ipv6() -> bool:
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        return False
    return True


@pytest.mark.skipif(not _has_ipv6(), reason="this machine has no IPv6")
async def test_ipv6_is_served_and_its_address_stands_in_brackets(kind: str) -> None:
    server, program = KINDS[kind]
    rig = ServerRig(server("::1"), program)
    await rig.start()
    assert rig.where.split("://")[1] == f"[::1]:{port_of(rig.server)}"
    client = await rig.client_is_known()
    client.write(b"six")
    await until(lambda: rig.heard == b"six")
    assert " from [::1]:" in rig.link.where
    assert str(await refusal(server("::1", port_of(rig.server)))).startswith("the port is taken")
    rig.close()


async def test_a_name_stands_for_the_addresses_it_has(kind: str) -> None:
    server, program = KINDS[kind]
    chosen = server("localhost")
    await chosen.open(ignore)
    port = port_of(chosen)
    chosen.close()
    rig = ServerRig(server("localhost", port), program)
    await rig.start()
    assert rig.where.endswith(f"://localhost:{port}")
    client = await rig.client_is_known()
    client.write(b"by name")
    await until(lambda: rig.heard == b"by name")
    rig.close()


@pytest.mark.skipif(not Path("/proc/net").exists(), reason="all of 127.x.x.x is loopback on Linux")
async def test_only_this_machine_gets_in_unless_an_address_says_otherwise(kind: str) -> None:
    server, program = KINDS[kind]
    closed, wide = server(), server("0.0.0.0")  # noqa: S104 (that is the point)
    for it in (closed, wide):
        await it.open(ignore)
    with pytest.raises(ConnectionRefusedError):
        program(f"tcp://127.0.0.2:{port_of(closed)}")
    client = program(f"tcp://127.0.0.2:{port_of(wide)}")
    await until(lambda: wide.counters.clients == 1)
    client.close()
    for it in (closed, wide):
        it.close()


async def test_a_system_without_a_socket_to_give_is_told_in_one_line(
    server: type[AnyServer],
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        error = await refusal(server())
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert error.what.startswith("cannot be listened on (")
