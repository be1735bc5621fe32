"""A wire that several nodes share brings an edge to all of them in one instant."""

from __future__ import annotations

import asyncio

import pytest

from sacbus import open_bus
from sacbus.bus import NoSuchNode
from sacbus.daemon import Configuration
from sacbus.node import PinError
from sacbus.testing import VirtualBus


def test_held_commands_start_in_one_instant_in_real_time_too() -> None:
    nodes = (10, 11, 12)

    async def scene() -> list[int]:
        async with open_bus(Configuration(nodes=nodes)) as bus:
            mother = bus.mother()
            line = bus.shared_line("sync", nodes)
            started: list[int] = []
            all_started = asyncio.Event()

            def edge(pin: str, level: int, when: int) -> None:
                if (pin, level) == ("op_sa", 1):
                    started.append(when)
                    if len(started) == len(nodes):
                        all_started.set()

            for node in nodes:
                bus.panel(node).watch(edge)
                await mother.send(node, "m4s")
            assert started == []
            line.pull()
            await asyncio.wait_for(all_started.wait(), 30)
            return started

    first, *others = asyncio.run(scene())
    assert others == [first, first]


def test_an_edge_is_given_each_time(bus: VirtualBus) -> None:
    line = bus.hosted.shared_line("sync", bus.nodes)
    for turns in (1, 2):
        for node in bus.nodes.values():
            node.send("m200v300s")
        line.pull()
        bus.run_for("5 s")
        assert [node.position for node in bus.nodes.values()] == [200 * turns] * 3


def test_a_level_stays_until_it_is_driven_anew(bus: VirtualBus) -> None:
    line = bus.hosted.shared_line("estop", [10, 11])
    line.drive(0)
    bus.broadcast("m200v300")
    bus.run_for("5 s")
    assert [node.position for node in bus.nodes.values()] == [0, 0, 200]
    line.drive(1)
    bus.run_for("5 s")
    assert [node.position for node in bus.nodes.values()] == [200, 200, 200]


@pytest.mark.parametrize(("pin", "level"), [("nonsense", 0), ("clk", 1), ("sync", 2)])
def test_what_cannot_be_driven_is_refused(bus: VirtualBus, pin: str, level: int) -> None:
    line = bus.hosted.shared_line(pin, [10, 11])
    with pytest.raises(PinError, match=pin):
        line.drive(level)


def test_a_node_that_is_not_there_is_told(bus: VirtualBus) -> None:
    with pytest.raises(NoSuchNode, match="99"):
        bus.hosted.shared_line("sync", [10, 99])
