"""Autorun after power loss: a node works on without a master."""

from __future__ import annotations

import pytest

from sacbus.testing import VirtualBus


@pytest.mark.sacbus(nodes=10)
def test_a_node_does_its_work_again_when_power_is_back(bus: VirtualBus) -> None:
    node = bus.node(10)
    # There and back, saved in EEPROM; autorun over positions 1 and 2 from the next boot on.
    for line in "q1m200v120a2d2", "q2m-200v120a2d2", "qs", "$CA2":
        node.send(line)
    bus.run_for("1 s")
    assert node.position == 0

    node.power(on=False)
    bus.expect(node=10, state="OFF", for_="2 s")
    node.power(on=True)
    assert node.state == "BOOT"

    for position in 200, 0, 200:
        bus.expect(node=10, position=position, within="5 s")
    node.send("S")
    bus.expect(node=10, state="STANDBY", for_="5 s")
