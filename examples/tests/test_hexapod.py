"""A hexapod on six nodes: six legs that go different ways in the same time."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from sacbus.testing import VirtualBus

LEGS = range(20, 26)

pytestmark = pytest.mark.sacbus(nodes="20-25", slow=30)


def pose(bus: VirtualBus, steps: Mapping[int, int], seconds: float) -> None:
    """Have each leg go its steps in the same time, all from the same instant on."""
    for leg, way in steps.items():
        rpm = round(abs(way) / 200 / seconds * 60)  # 200 full steps are a turn
        bus.send(leg, f"m{way}v{rpm}a999d999s")  # 999: no ramp
    bus.expect(node=LEGS, state="SYNC")
    bus.broadcast("y")
    bus.expect(node=LEGS, state="STANDBY", within=f"{seconds + 1} s")


def test_it_stands_up_with_all_legs_at_once(bus: VirtualBus) -> None:
    pose(bus, dict.fromkeys(LEGS, 200), 1)
    bus.expect(node=LEGS, position=200)
    bus.expect(node=LEGS, start_skew="1 us")


def test_it_tilts_in_a_straight_line_of_all_six_axes(bus: VirtualBus) -> None:
    ways = {20: 100, 21: 50, 22: -50, 23: -100, 24: -50, 25: 50}
    pose(bus, ways, 0.5)
    assert {leg: bus.node(leg).position for leg in LEGS} == ways
    bus.expect(node=LEGS, deviation=1.5)
    assert (bus.counts["retries"], bus.counts["collisions"]) == (0, 0)
