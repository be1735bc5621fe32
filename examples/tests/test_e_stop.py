"""An emergency stop in mid-move, by an async controller with pytest-asyncio."""

from __future__ import annotations

import asyncio

import pytest

from sacbus import Mother
from sacbus.testing import VirtualBus


class Guard:
    """The controller under test: it stops everything when the door opens. Yours is imported."""

    def __init__(self, mother: Mother) -> None:
        self._mother = mother
        self.door = asyncio.Event()

    async def watch(self) -> None:
        await self.door.wait()
        await self._mother.broadcast("S")  # stop with prejudice: at once, no ramp


@pytest.mark.asyncio
@pytest.mark.sacbus(nodes="10,11")
async def test_the_door_stops_both_motors_in_mid_move(bus: VirtualBus, mother: Mother) -> None:
    guard = Guard(mother)
    watching = asyncio.create_task(guard.watch())
    await mother.send(10, "m2000v300a2d2")
    await mother.send(10, "m-500")  # waits in the queue, and must not be done later
    await mother.send(11, "m-2000v300a2d2")
    await bus.expected(node=(10, 11), state="CRUISE", within="5 s")

    guard.door.set()
    await bus.expected(node=(10, 11), velocity=0, within="5 ms")
    stopped = bus.now
    await watching

    await bus.expected(node=(10, 11), state="STANDBY", for_="1 min")
    for node in bus.nodes.values():
        assert 100 < abs(node.position) < 1900
        assert node.track.pulses(stopped, bus.now).size == 0
