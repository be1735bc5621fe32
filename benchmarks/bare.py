"""The least that any server must do, for each way in: what sacbus is measured beside.

Each answers every 20 bytes with four. They print where they are, as ``benchmarks.server`` says.
"""

from __future__ import annotations

import asyncio
import os
import pty
import select
import time
import tty

import serial_asyncio

from benchmarks import REQUEST
from sacbus.kernel import SECOND, LineRate
from sacbus.wire import ack
from sacbus.wire.times import turnaround

ANSWER = ack(1, 10)


async def pty_echo() -> None:
    """An ``add_reader`` callback, ``os.read`` and ``os.write``."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    got = 0

    def read() -> None:
        nonlocal got
        got += len(os.read(master, 65_536))
        while got >= len(REQUEST):
            got -= len(REQUEST)
            os.write(master, ANSWER)

    asyncio.get_running_loop().add_reader(master, read)
    print(os.ttyname(slave), flush=True)


class _TcpEcho(asyncio.BufferedProtocol):
    def __init__(self) -> None:
        self._buffer = memoryview(bytearray(65_536))
        self._got = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def get_buffer(self, _sizehint: int) -> memoryview:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._got += nbytes
        while self._got >= len(REQUEST):
            self._got -= len(REQUEST)
            self._transport.write(ANSWER)


async def tcp_echo() -> None:
    """A ``BufferedProtocol``; asyncio sets TCP_NODELAY."""
    server = await asyncio.get_running_loop().create_server(_TcpEcho, "127.0.0.1", 0)
    print(f"socket://127.0.0.1:{server.sockets[0].getsockname()[1]}", flush=True)


class _SerialEcho(asyncio.Protocol):
    def __init__(self) -> None:
        self._got = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        self._got += len(data)
        while self._got >= len(REQUEST):
            self._got -= len(REQUEST)
            self._transport.write(ANSWER)  # type: ignore[attr-defined]  # it ships no types


async def serial_echo(path: str) -> None:
    """pyserial-asyncio as its documentation shows it."""
    await serial_asyncio.create_serial_connection(
        asyncio.get_running_loop(), _SerialEcho, path, baudrate=38_400
    )
    print(path, flush=True)


def select_echo() -> None:
    """A loop of bare ``select`` calls that answers in the line's time.

    Ends with standard input, and then prints how late its calls came back: p50 and p99 in us.
    """
    master, slave = pty.openpty()
    tty.setraw(slave)
    rate = LineRate()
    packet, answer = len(REQUEST), len(ANSWER)
    begins = rate.span(packet) + turnaround(packet - 6, nul_follows=True)
    # What an exchange has to wait for: the packet's end, the answer's start, and its end.
    waits = [ns / SECOND for ns in (rate.span(packet), begins, begins + rate.span(answer))]
    late: list[float] = []
    print(os.ttyname(slave), flush=True)
    while 0 not in (ready := select.select([master, 0], [], [])[0]):
        came = time.monotonic()
        assert ready == [master]
        assert len(os.read(master, 65_536)) == packet
        for wait in waits:
            while (left := came + wait - time.monotonic()) > 0:
                select.select([0], [], [], left)
            late.append(-left)
        os.write(master, ANSWER)
    late.sort()
    print(late[len(late) // 2] * 1e6, late[len(late) * 99 // 100] * 1e6)
