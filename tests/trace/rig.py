"""Buses that are recorded, in virtual time; and an independent reader of VCD."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Coroutine
from io import BytesIO
from typing import Any, BinaryIO

from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.mother import Mother
from sacbus.trace import Recorder, Recording, read

Play = Callable[[HostedBus, Mother, Recorder], Coroutine[Any, Any, None]]


def recorded(
    play: Play, configuration: Configuration | None = None, sink: BinaryIO | None = None
) -> Recording:
    """What a play on a bus leaves in a recording."""
    into = sink or BytesIO()

    async def main() -> None:
        async with open_bus(configuration or Configuration(nodes=(10, 11))) as bus:
            mother = bus.mother()
            with Recorder(bus, into) as recorder:
                await play(bus, mother, recorder)

    run_virtual(Kernel(), main())
    return read(into)


async def two_axes(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    """Two commands, one of them held until sync falls; a stop; single pulses; a power cycle."""
    await mother.send(10, "m400v120")
    await mother.send(11, "m-200v60s")
    await asyncio.sleep(1)
    recorder.mark("sync falls", axis=11)
    bus.panel(11).drive("sync", 0)
    await asyncio.sleep(0.4)
    bus.panel(11).drive("sync", 1)
    await mother.send(11, "S")
    await mother.send(11, "+++")
    await asyncio.sleep(1)
    bus.panel(10).power(on=False)
    await asyncio.sleep(0.1)
    bus.panel(10).power(on=True)
    await asyncio.sleep(1.1)
    await mother.send(10, "m-50v100")
    await asyncio.sleep(1)


class Dump:
    """A VCD file, read by the letter of IEEE 1364 and by nothing of ours.

    ``edges``: for each signal, by its full name, the instants and levels of its changes.
    """

    def __init__(self, text: str) -> None:
        self.timescale = ""
        self.edges: dict[str, list[tuple[int, str]]] = {}
        names: dict[str, str] = {}
        scopes: list[str] = []
        head, _, body = text.partition("$enddefinitions $end")
        for words in re.findall(r"\$(\w+)\s+(.*?)\s*\$end", head, re.DOTALL):
            match words[0], words[1].split():
                case "timescale", [*scale]:
                    self.timescale = " ".join(scale)
                case "scope", [_, name]:
                    scopes.append(name)
                case "upscope", _:
                    scopes.pop()
                case "var", [_, "1", code, name]:
                    names[code] = ".".join((*scopes, name))
                case _:
                    pass
        now = 0
        for line in body.split():
            if line.startswith("#"):
                assert int(line[1:]) >= now
                now = int(line[1:])
            elif not line.startswith("$"):
                self.edges.setdefault(names[line[1:]], []).append((now, line[0]))
        self.end = now

    def rises(self, name: str) -> list[int]:
        """When a signal goes up; what it is at the beginning does not count."""
        edges = self.edges[name]
        return [when for when, level in edges[1:] if level == "1"]
