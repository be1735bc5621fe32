"""Four axes whose steps go to their drivers on five lines: none is lost on the way."""

from __future__ import annotations

import pytest

from sacbus.simad import decode, encode, merge
from sacbus.testing import VirtualBus

AXES = range(10, 14)


@pytest.mark.sacbus(nodes="10-13", ustep=3)
def test_the_drivers_end_where_the_nodes_are(bus: VirtualBus) -> None:
    for axis, command in zip(
        AXES, ("m800v300s", "m-700v262s", "m600v225s", "m-800v300s"), strict=True
    ):
        bus.send(axis, command)
    bus.broadcast("y")
    bus.expect(node=AXES, state="STANDBY", within="5 s")

    tracks = [bus.track(axis) for axis in AXES]
    steps = merge(
        [track.pulses(0, bus.now) for track in tracks],
        [track.directions(0, bus.now) for track in tracks],
    )
    lines = encode(steps, len(AXES))
    assert lines.report.lines == 5
    assert max(axis.delay_max for axis in lines.report.axes) < 20_000  # ns

    driven = decode(lines.edges)
    for number, axis in enumerate(AXES):
        _, ways = driven.of_axis(number)
        assert ways.sum() == bus.node(axis).pulses
