"""The server processes that the pty benchmarks talk to: ``python -m benchmarks.server KIND``.

KIND is ``paced`` or ``unpaced`` (sacbus) or one of the least that any server must do: ``echo``, a
pty whose requests are answered with four bytes from an ``add_reader`` callback, and ``select``, one
that answers in the line's time from a loop of bare ``select`` calls. Prints the port's path; each
line on its standard input is answered with the processor time used so far, in seconds. ``select``
prints how late its calls came back instead, p50 and p99 in us, when its standard input ends.
"""

from __future__ import annotations

import asyncio
import os
import pty
import select
import sys
import time
import tty

from benchmarks import REQUEST
from sacbus.daemon import Configuration, open_bus
from sacbus.kernel import SECOND, LineRate
from sacbus.links.places import PtyAt
from sacbus.wire import ack
from sacbus.wire.times import turnaround

ANSWER = ack(1, 10)


async def serve_echo() -> None:
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
    await _tell_time()


def serve_select() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    rate = LineRate()
    packet, answer = len(REQUEST), len(ANSWER)
    ack = rate.span(packet) + turnaround(packet - 6, nul_follows=True)
    # What an exchange has to wait for: the packet's end, the answer's start, and its end.
    waits = [ns / SECOND for ns in (rate.span(packet), ack, ack + rate.span(answer))]
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


async def serve_bus(*, pace: bool) -> None:
    configuration = Configuration(links=(PtyAt(),), pace=pace)
    async with open_bus(configuration) as bus:
        print(bus.links[0].where, flush=True)
        await _tell_time()


async def _tell_time() -> None:
    loop = asyncio.get_running_loop()
    ended = loop.create_future()

    def asked() -> None:
        if os.read(0, 4_096):
            print(time.process_time(), flush=True)
        else:
            loop.remove_reader(0)
            ended.set_result(None)

    loop.add_reader(0, asked)
    await ended


def main(argv: list[str]) -> int:
    kind = argv[0]
    if kind == "select":
        serve_select()
        return 0
    asyncio.run(serve_echo() if kind == "echo" else serve_bus(pace=kind == "paced"))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
