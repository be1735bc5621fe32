"""The server processes that benchmarks talk to: ``python -m benchmarks.server KIND [PATH]``.

KIND is ``bus`` (paced), ``bus-unpaced``, ``tcp`` and ``tcp-many`` (unpaced), ``bus-pty-quick`` and
``bus-tcp-quick`` (whose nodes answer at once, and are never deaf), ``adapter`` (at PATH),
``modbus-pty`` and ``modbus-tcp`` (pymodbus), or the least that any server must do in its place:
``pty-echo``, ``tcp-echo``, ``serial-echo`` (at PATH), ``select``. Prints where to connect; each
line on its standard input is answered with the processor time used so far, in seconds.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
from collections.abc import Awaitable, Callable

from benchmarks import bare
from sacbus.daemon import Configuration, open_bus
from sacbus.links.places import AdapterAt, PtyAt, TcpAt
from sacbus.selector import real_loop

#: Where 64 nodes sit, so that each of 64 requests in a row is another node's. On two lanes, since
#: on one their answers would collide with the requests behind them.
MANY = tuple(range(10, 74))

#: No gaps: nothing to wait for but the bytes.
QUICK = {"turnaround": False, "deaf_time": False}

BUSES: dict[str, Callable[[str], Configuration]] = {
    "bus": lambda _: Configuration(links=(PtyAt(),)),
    "bus-unpaced": lambda _: Configuration(links=(PtyAt(),), pace=False),
    "tcp": lambda _: Configuration(links=(TcpAt("127.0.0.1", 0),), pace=False),
    "tcp-many": lambda _: Configuration(
        nodes=MANY, lanes=2, links=(TcpAt("127.0.0.1", 0),), pace=False
    ),
    "bus-pty-quick": lambda _: Configuration(links=(PtyAt(),), pace=False, settings=QUICK),
    "bus-tcp-quick": lambda _: Configuration(
        links=(TcpAt("127.0.0.1", 0),), pace=False, settings=QUICK
    ),
    "adapter": lambda path: Configuration(links=(AdapterAt(path),)),
}
BARE: dict[str, Callable[[str], Awaitable[object]]] = {
    "pty-echo": lambda _: bare.pty_echo(),
    "tcp-echo": lambda _: bare.tcp_echo(),
    "serial-echo": bare.serial_echo,
    "modbus-pty": lambda _: _modbus("serve_pty"),
    "modbus-tcp": lambda _: _modbus("serve_tcp"),
}


async def serve_bus(configuration: Configuration) -> None:
    async with open_bus(configuration) as bus:
        print(bus.links[0].where, flush=True)
        await _tell_time()


async def serve_bare(serving: Awaitable[object]) -> None:
    await serving
    await _tell_time()


async def _modbus(serve: str) -> None:
    from benchmarks import modbus  # noqa: PLC0415 (nobody else waits for it)

    await getattr(modbus, serve)()


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
    kind, path = argv[0], "".join(argv[1:])
    if kind == "select":
        bare.select_echo()
    elif kind in BARE:
        asyncio.run(serve_bare(BARE[kind](path)))
    else:
        # The loop that ``sacbus serve`` runs in.
        with asyncio.Runner(loop_factory=real_loop) as runner:
            runner.run(serve_bus(BUSES[kind](path)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
