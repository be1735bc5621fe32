"""How fast a recorded bus runs in virtual time, beside the same bus unrecorded.

250 nodes, soft ops off, each loop the 30 commands of the companion's queue for ten minutes of bus
time, while mother polls one of them after the other, ten a second. The bus is opened, its queues
filled and its loops started within the time that is taken. The goal is a 200th of the ten minutes.
"""

from __future__ import annotations

import asyncio
import tempfile
from pathlib import Path
from typing import BinaryIO, Final

from benchmarks.figure import Figure, alternate
from nodes.sac import SacNode
from sacbus.daemon import Configuration, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import SECOND, Kernel
from sacbus.language.queue_file import read_rows
from sacbus.trace import Recorder

QUEUE: Final = Path(__file__).parent.parent / "tests" / "data" / "companion-queue.txt"
NODES: Final = tuple(range(4, 254))

#: Seconds of bus time, and between two polls.
SPELL: Final = 600
POLL: Final = 0.1


async def looping(sink: BinaryIO | None) -> int:
    """The ten minutes; where the first node is at their end."""
    rows = [one.row.motion for one in read_rows(QUEUE.read_text().splitlines(), QUEUE.name)]
    async with open_bus(Configuration(nodes=NODES)) as bus:
        for node in bus.bus.nodes:
            assert isinstance(node, SacNode)
            node.board.commands.queue.load(rows)
        recorder = None if sink is None else Recorder(bus, sink)
        mother = bus.mother()
        for address in NODES:
            await mother.send(address, "la")
        for number in range(round(SPELL / POLL)):
            await mother.send(NODES[number % len(NODES)], " ")
            await asyncio.sleep(POLL)
        if recorder is not None:
            recorder.close()
        assert bus.now() > SPELL * SECOND
        assert bus.bus.report_counts.keys() == {"warning"}  # the queue has a ramp of giant steps
        return bus.snapshot(NODES[0]).position_pulses


def recorded() -> int:
    """To a file, as everybody would."""
    with tempfile.TemporaryFile("wb", buffering=0) as sink:
        return run_virtual(Kernel(), looping(sink))


def unrecorded() -> int:
    """The same, for nobody."""
    return run_virtual(Kernel(), looping(None))


def figures(rounds: int) -> list[Figure]:
    """The ratio to real time, and to the same run without a recording."""
    assert recorded() == unrecorded()
    took, least = alternate(recorded, unrecorded, min(rounds, 5))
    return [
        Figure(
            "250 nodes looping, all of it recorded",
            SPELL / took,
            "x real time",
            took / least,
            "the time of the same unrecorded",
            200.0,
            "value, at least",
        )
    ]
