"""Foreign peers of a client: what others offer as a line, and what can be done there."""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
import subprocess
import tty
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest
import serial
from serial import rfc2217

from tests.links.programs import PtyProgram
from tests.links.socat import Wire
from tests.serving import PATIENCE, until

__all__ = [
    "OPENED",
    "SER2NET",
    "Far",
    "PortManagerPeer",
    "TcpPeer",
    "free_port",
    "of_port_manager",
    "of_pty",
    "of_ser2net",
    "of_tcp",
]

SER2NET: Final = shutil.which("ser2net", path=os.environ.get("PATH", "") + ":/usr/sbin")


@dataclass
class Far:
    """The far end of an open-able line: it gives back what it hears, and says things itself."""

    link: str
    say: Callable[[bytes], object]
    hang_up: Callable[[], object]


def free_port() -> int:
    """A port that nobody listens on; free for as long as nobody else finds it."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
        assert isinstance(port, int)
        return port


# ------------------------------------------------------------------------------------ a serial port


@asynccontextmanager
async def of_pty() -> AsyncIterator[Far]:
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    loop = asyncio.get_running_loop()

    def say_back() -> None:
        os.write(master, os.read(master, 65_536))

    def hang_up() -> None:
        nonlocal master
        if master >= 0:
            loop.remove_reader(master)
            os.close(slave)
            os.close(master)
            master = -1

    loop.add_reader(master, say_back)
    try:
        yield Far(os.ttyname(slave), lambda data: os.write(master, data), hang_up)
    finally:
        hang_up()


# ---------------------------------------------------------------------------------------- plain TCP


class TcpPeer(asyncio.Protocol):
    """A TCP server that answers what ``reply`` makes of what it hears; the last program counts."""

    def __init__(self, reply: Callable[[bytes], bytes] = bytes) -> None:
        self._reply = reply
        self.heard = bytearray()
        self.transports: list[asyncio.Transport] = []

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transports.append(transport)

    def data_received(self, data: bytes) -> None:
        self.heard += data
        self.say(self._reply(data))

    def say(self, data: bytes) -> None:
        self.transports[-1].write(data)

    def hang_up(self) -> None:
        self.transports[-1].close()

    @asynccontextmanager
    async def served(self, scheme: str = "socket", host: str = "127.0.0.1") -> AsyncIterator[str]:
        """Its URL."""
        server = await asyncio.get_running_loop().create_server(lambda: self, host, 0)
        port = server.sockets[0].getsockname()[1]
        try:
            yield f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"
        finally:
            server.close()
            for transport in self.transports:
                transport.abort()
            await asyncio.sleep(0)


@asynccontextmanager
async def of_tcp() -> AsyncIterator[Far]:
    peer = TcpPeer()
    async with peer.served() as link:
        yield Far(link, peer.say, peer.hang_up)


# ----------------------------------------------------------------------------------------- RFC 2217


class PortManagerPeer(TcpPeer):
    """A server made of pyserial's PortManager, as its example is, before a port that loops."""

    def __init__(self, reply: Callable[[bytes], bytes] = bytes) -> None:
        super().__init__(reply)
        self.port: serial.SerialBase = serial.serial_for_url("loop://")
        self.manager: rfc2217.PortManager

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.manager = rfc2217.PortManager(self.port, self)  # type: ignore[arg-type]  # a writer

    def write(self, telnet: bytes) -> None:
        """PortManager's: to the client, as it is."""
        self.transports[-1].write(telnet)

    def data_received(self, data: bytes) -> None:
        super().data_received(b"".join(self.manager.filter(data)))

    def say(self, data: bytes) -> None:
        self.write(b"".join(self.manager.escape(data)))


@asynccontextmanager
async def of_port_manager() -> AsyncIterator[Far]:
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link:
        yield Far(link, peer.say, peer.hang_up)


@asynccontextmanager
async def of_ser2net() -> AsyncIterator[Far]:
    """Debian's server, before one of two ptys; on the other is who gives back what it hears."""
    if SER2NET is None:
        pytest.skip("ser2net is not installed")
    wire = Wire()
    wire.plug()
    port = free_port()
    configuration = wire.directory / "ser2net.yaml"
    configuration.write_text(
        "%YAML 1.1\n---\n"
        "connection: &one\n"
        f"    accepter: telnet(rfc2217),tcp,127.0.0.1,{port}\n"
        f"    connector: serialdev,{wire.near},9600n81,local\n"
    )
    process = subprocess.Popen(
        [SER2NET, "-n", "-c", str(configuration)],
        stdin=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    program = PtyProgram(wire.far)
    loop = asyncio.get_running_loop()

    def hang_up() -> None:
        process.terminate()
        process.wait(PATIENCE)

    loop.add_reader(program.descriptor, lambda: program.write(program.read()))
    try:
        until(lambda: _listening(port))
        yield Far(f"rfc2217://127.0.0.1:{port}", program.write, hang_up)
    finally:
        loop.remove_reader(program.descriptor)
        program.close()
        hang_up()
        wire.close()


def _listening(port: int) -> bool:
    """Whether somebody listens there, found out without a connection that would be somebody's."""
    entries = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return any(entry[3] == "0A" and int(entry[1].split(":")[1], 16) == port for entry in entries)


#: Every kind of peer that a line can be opened to.
OPENED: Final[dict[str, Callable[[], AbstractAsyncContextManager[Far]]]] = {
    "pty": of_pty,
    "plain TCP": of_tcp,
    "pyserial's PortManager": of_port_manager,
    "ser2net": of_ser2net,
}
