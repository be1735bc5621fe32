"""Super Stepper modules in a test: a program of one's own drives them as their master."""

from __future__ import annotations

import pytest

from sacbus.mother.superstepper import NoReply, SuperStepper
from sacbus.testing import VirtualBus


@pytest.mark.sacbus(kind="ss-mst67", nodes="3,4")
@pytest.mark.asyncio
async def test_a_module_homes_and_then_moves_by_steps(bus: VirtualBus) -> None:
    master = SuperStepper.on(bus)
    await master.home(3, speed=10_000)
    await bus.expected(node=3, velocity=-60, state="CRUISE", within="2 s")

    bus.node(3).drive("home", 0)
    status = await master.status(3)
    assert (status.busy, status.home_complete) == (False, True)

    there = bus.node(3).position
    await master.microsteps(3, 8)
    await master.move_steps(3, 1_600, speed=1_000)
    await bus.expected(node=3, state="STANDBY", within="5 s")
    assert bus.node(3).position == there + 200
    assert await master.steps_run(3) == 1_600


@pytest.mark.sacbus(kind="ss-mst67", nodes="3", jmp2="closed")
@pytest.mark.asyncio
async def test_in_9_bit_mode_everything_is_the_same(bus: VirtualBus) -> None:
    master = SuperStepper.on(bus)
    await master.move_at_speed(3, 4_000, accelerate=False)
    await bus.expected(node=3, velocity=150)
    with pytest.raises(NoReply, match="nobody at that address"):
        await master.stop(9)
