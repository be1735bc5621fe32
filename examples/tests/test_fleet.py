"""250 nodes on one line, each with a command of its own, all started at one instant."""

from __future__ import annotations

import pytest

from sacbus.testing import VirtualBus


# Without soft ops: 250 nodes that told of their start would talk at one instant.
@pytest.mark.sacbus(nodes="4-253", soft_ops=False)
def test_250_nodes_start_at_once_and_none_is_forgotten(bus: VirtualBus) -> None:
    for address, node in bus.nodes.items():
        node.send(f"m{address}v120s")
    bus.expect(node="all", state="SYNC", position=0)

    bus.broadcast("y")
    bus.expect(node="all", state="STANDBY", within="3 s")

    assert {address: node.position for address, node in bus.nodes.items()} == {
        address: address for address in range(4, 254)
    }
    bus.expect(node="all", start_skew="1 us")
    bus.expect(acks=250, retries=0, collisions=0)
