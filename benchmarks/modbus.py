"""pymodbus as a baseline: its own server and its own client, as its examples use them."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import serial
from pymodbus import FramerType
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

__all__ = ["client", "serve_pty", "serve_tcp", "write"]

#: One device, of a hundred registers.
DEVICE = SimDevice(10, [SimData(0, count=100, values=0, datatype=DataType.REGISTERS)])

#: The fastest rate that a port has, for a server or client that takes account of it.
BAUD = 4_000_000

Client = AsyncModbusSerialClient | AsyncModbusTcpClient


async def serve_pty() -> ModbusSerialServer:
    """A server on a pty whose path is printed."""
    serial.protocol_handler_packages.append("benchmarks")
    server = ModbusSerialServer(DEVICE, framer=FramerType.RTU, port="ptmaster://", baudrate=BAUD)
    await server.serve_forever(background=True)
    return server


async def serve_tcp() -> ModbusTcpServer:
    """A server on a port of the loopback that the system chooses; its URL is printed."""
    with socket.create_server(("127.0.0.1", 0)) as found:
        port = found.getsockname()[1]
    server = ModbusTcpServer(DEVICE, address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    print(f"socket://127.0.0.1:{port}", flush=True)
    return server


@asynccontextmanager
async def client(where: str) -> AsyncIterator[Client]:
    """A client on a pty's path or a ``socket://`` URL."""
    scheme, _, rest = where.partition("://")
    made: Client
    if rest:
        host, _, port = rest.partition(":")
        made = AsyncModbusTcpClient(host, port=int(port))
    else:
        made = AsyncModbusSerialClient(scheme, framer=FramerType.RTU, baudrate=BAUD)
    assert await made.connect()
    try:
        yield made
    finally:
        made.close()
        await asyncio.sleep(0)


async def write(modbus: Client, times: int) -> None:
    """So many registers written, one after the other."""
    for number in range(times):
        answer = await modbus.write_register(number % 100, number % 65_536, device_id=10)
        assert not answer.isError(), answer
