"""Two axes started in sync: they start at one instant and draw a straight line."""

from __future__ import annotations

import pytest

from sacbus.testing import VirtualBus


@pytest.mark.sacbus(nodes="10,11")
@pytest.mark.parametrize("speed", [60, 120])
def test_two_axes_start_together_and_stay_together(bus: VirtualBus, speed: int) -> None:
    # S at the end: each holds its command until sync is released.
    bus.send(10, f"m400v{speed}s")
    bus.send(11, f"m400v{speed}s")
    bus.expect(node=(10, 11), state="SYNC", position=0)

    bus.broadcast("y")
    bus.expect(node=(10, 11), position=400, state="STANDBY", within="5 s")

    bus.expect(node=(10, 11), start_skew="1 us")
    bus.expect(node=(10, 11), deviation=1)


@pytest.mark.sacbus(nodes="10,11")
def test_every_pulse_of_one_has_its_twin(bus: VirtualBus) -> None:
    for node in bus.nodes.values():
        node.send("m400v120s")
    bus.broadcast("y")
    bus.run_for("5 s")
    left, right = (node.track.pulses(0, bus.now) for node in bus.nodes.values())
    assert left.tolist() == right.tolist()
