"""Transactions per second: mother's requests with their ACKs, beside pymodbus' in the same run.

Mother for coroutines, one request outstanding, each a motion command's worth of bytes to a node
that moves nothing. In memory the bus runs in virtual time and in the same process; over a pty and
TCP it is a process of its own, as ``sacbus serve --no-pace`` is, with nodes that answer at once and
are never deaf, and mother leaves no gap. pymodbus writes a register: its asyncio client, its
asyncio server, a process of its own, on the same kind of pty or over TCP.

Wall time: a transaction is work of two processes that wait for each other. Rounds alternate.
"""

from __future__ import annotations

import asyncio
import statistics
import time

from benchmarks import modbus
from benchmarks.client import Client, Server
from benchmarks.figure import Figure, alternate
from benchmarks.kernel import EVENTS, bare_heap
from sacbus import open_bus
from sacbus.configuration import Configuration
from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.mother import Mother

TRANSACTIONS = 500
IN_MEMORY = 5_000
LINE = b"v100".ljust(14)


async def send(mother: Mother, times: int) -> None:
    """So many requests to node 10, one after the other."""
    for _ in range(times):
        await mother.send(10, LINE)


def figures(rounds: int) -> list[Figure]:
    """Transactions per second; the goal over a pty is five times pymodbus'."""
    return [_in_memory(rounds), *_over_a_pty(rounds), _over_tcp(rounds)]


def _in_memory(rounds: int) -> Figure:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            await send(bus.mother(), IN_MEMORY)

    def act() -> None:
        run_virtual(Kernel(), scene())

    act()
    took, baseline = alternate(act, bare_heap, rounds)
    return Figure(
        "transactions in memory, virtual time",
        IN_MEMORY / took,
        "/s",
        IN_MEMORY / took / (EVENTS / 5 / baseline),
        "5 bare heap events a transaction",
    )


def _over_a_pty(rounds: int) -> list[Figure]:
    ours, theirs, bare = asyncio.run(_measure("pty", rounds))
    baseline = f"pymodbus' ({TRANSACTIONS / theirs:,.0f} /s)"
    return [
        Figure(
            "transactions over a pty, no gaps",
            TRANSACTIONS / ours,
            "/s",
            theirs / ours,
            baseline,
            5.0,
            "ratio, at least",
        ),
        # What is left when nothing is done with the bytes.
        Figure(
            "the same bytes over a pty, echo and pyserial",
            TRANSACTIONS / bare,
            "/s",
            theirs / bare,
            baseline,
        ),
    ]


def _over_tcp(rounds: int) -> Figure:
    ours, theirs, _ = asyncio.run(_measure("tcp", rounds))
    return Figure(
        "transactions over TCP, no gaps",
        TRANSACTIONS / ours,
        "/s",
        theirs / ours,
        f"pymodbus' ({TRANSACTIONS / theirs:,.0f} /s)",
    )


async def _measure(link: str, rounds: int) -> tuple[float, float, float]:
    """Median seconds of a round: ours, pymodbus', and that of an echo over a pty."""
    took: tuple[list[float], ...] = ([], [], [])
    with (
        Server(f"bus-{link}-quick") as bus,
        Server(f"modbus-{link}") as device,
        Client("pty-echo") as echo,
    ):
        async with (
            Mother.connect(bus.where, gap=0) as mother,
            modbus.client(device.where) as registers,
        ):
            await send(mother, 20)
            await modbus.write(registers, 20)
            for _ in range(rounds):
                began = time.perf_counter()
                await send(mother, TRANSACTIONS)
                took[0].append(time.perf_counter() - began)
                began = time.perf_counter()
                await modbus.write(registers, TRANSACTIONS)
                took[1].append(time.perf_counter() - began)
                took[2].append(echo.exchange(TRANSACTIONS))
    ours, theirs, bare = (statistics.median(rounds_of) for rounds_of in took)
    return ours, theirs, bare
