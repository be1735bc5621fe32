"""A minute between DC1 and DC2 tells what a node's time is worth, and what repairs it."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from sacbus import Mother
from sacbus.kernel import SECOND
from sacbus.mother import BadRequest, LineLost, NoAnswer, Stopped
from sacbus.mother.calibration import RPMS, NoSoftOp, Unlikely, calibrate
from sacbus.motion import Drive
from sacbus.testing import VirtualBus
from sacbus.wire.times import MOTHER_GAP

pytestmark = pytest.mark.asyncio


@pytest.mark.parametrize("rpm", RPMS)
async def test_a_node_with_a_true_clock_needs_nothing(
    bus: VirtualBus, mother: Mother, rpm: int
) -> None:
    found = await calibrate(mother, 10, rpm=rpm)
    assert found.measured_ns == found.nominal_ns
    assert found.factor == 1
    assert (found.clock_ppm, found.ihd, found.xclk, found.left_ppm) == (0, 8, 0, 0)
    assert found.steps == rpm * 200
    # A minute, and what the ramps take longer than the cruise that they stand for.
    assert 60 <= found.measured_ns / SECOND < 61.5
    assert bus.node(10).position == rpm * 200


@pytest.mark.sacbus(
    nodes={10: {"ppm": 300}, 11: {"ppm": -450}, 12: {"ppm": 9_000}, 13: {"ppm": -9_000}}
)
@pytest.mark.parametrize(
    ("node", "ppm", "ihd", "xclk"),
    [(10, 300, 5, 0), (11, -450, 12, 0), (12, 9_000, 0, 82), (13, -9_000, 98, 0)],
)
async def test_what_is_proposed_repairs_the_velocity(
    bus: VirtualBus, mother: Mother, node: int, ppm: int, ihd: int, xclk: int
) -> None:
    found = await calibrate(mother, node, rpm=60)
    assert found.clock_ppm == pytest.approx(ppm, abs=0.1)
    assert found.factor == pytest.approx(1 / (1 + ppm / 1e6), abs=1e-7)
    assert (found.ihd, found.xclk) == (ihd, xclk)
    for letter, value in (("H", found.ihd), ("I", found.xclk)):
        await mother.send(node, f"$C{letter}{value}")
    await mother.send(node, "$R")
    again = await calibrate(mother, node, rpm=60, drive=Drive(ihd=ihd, xclk=xclk))
    assert again.clock_ppm == pytest.approx(ppm, abs=0.1)
    # Half a count is 50 ppm at 60 RPM; the rest of the ramps is not made up for as exactly.
    assert abs(again.factor - 1) < 150e-6
    assert (again.ihd, again.xclk) == (ihd, xclk)
    assert found.left_ppm is not None
    assert again.left_ppm == pytest.approx(found.left_ppm, abs=0.1)
    assert (1 / again.factor - 1) * 1e6 == pytest.approx(found.left_ppm, abs=120)


@pytest.mark.sacbus(nodes={10: {"ihd": 20, "xclk": 3, "ustep": 3, "sprf": 400, "slow": 30}})
async def test_the_settings_of_the_node_are_taken_into_account(
    bus: VirtualBus, mother: Mother
) -> None:
    drive = Drive(ihd=20, xclk=3, ustep=3, sprf=400, slow_rpm=30)
    found = await calibrate(mother, 10, rpm=20, seconds=2, drive=drive)
    # 3750 ticks a pulse, nine of which are lost.
    assert found.factor == pytest.approx(1 - (9 / 1875), abs=1e-9)
    assert (found.clock_ppm, found.ihd, found.xclk, found.left_ppm) == (0, 8, 0, 0)
    unaware = await calibrate(mother, 10, rpm=20, seconds=2, drive=replace(drive, ihd=8, xclk=0))
    assert unaware.factor == found.factor
    assert unaware.clock_ppm == pytest.approx(1e6 * (1 / found.factor - 1), abs=0.1)


@pytest.mark.sacbus(nodes={10: {"ppm": 50_000}})
async def test_what_no_setting_repairs_is_told_as_such(bus: VirtualBus, mother: Mother) -> None:
    found = await calibrate(mother, 10, rpm=5, seconds=2)
    assert found.clock_ppm == pytest.approx(50_000, abs=1)
    assert (found.ihd, found.xclk, found.left_ppm) == (None, None, None)


async def test_queue_and_session_stay_and_soft_ops_are_off_again(
    bus: VirtualBus, mother: Mother
) -> None:
    node = bus.node(10)
    await mother.send(10, "g")  # the session shows who spoke last
    before = node.type("q\r"), node.type("cf\r")
    await calibrate(mother, 10, rpm=60, seconds=1)
    assert (node.type("q\r"), node.type("cf\r")) == before
    assert mother.caller.soft_op_listeners == []
    await calibrate(mother, 10, rpm=60, seconds=1, soft_ops_after=True)
    assert "soft_ops       1" in node.type("cf\r")


async def test_other_nodes_that_tell_of_their_motion_do_not_disturb(
    bus: VirtualBus, mother: Mother
) -> None:
    await mother.send(11, "$O1")
    await mother.send(11, "m40v300a999d999t200000")
    found = await calibrate(mother, 10, rpm=60, seconds=1)
    assert found.factor == 1


async def test_who_looks_on_is_told_how_far_it_is(bus: VirtualBus, mother: Mother) -> None:
    parts: list[float] = []
    await calibrate(mother, 10, rpm=60, seconds=10, progress=parts.append)
    assert len(parts) > 30
    assert parts == sorted(parts)
    assert parts[0] < 0.05
    assert parts[-1] == 1


async def test_cancelled_it_stops_the_node_and_switches_soft_ops_off(
    bus: VirtualBus, mother: Mother
) -> None:
    call = asyncio.create_task(calibrate(mother, 10, rpm=60))
    await asyncio.sleep(20)
    assert bus.node(10).state == "CRUISE"
    call.cancel()
    with pytest.raises(asyncio.CancelledError):
        await call
    assert bus.node(10).state == "STANDBY"
    assert bus.node(10).position < 5_000
    assert "soft_ops       0" in bus.node(10).type("cf\r")
    assert mother.caller.soft_op_listeners == []


async def test_a_node_that_is_stopped_meanwhile_is_not_taken_for_a_quick_one(
    bus: VirtualBus, mother: Mother
) -> None:
    call = asyncio.create_task(calibrate(mother, 10, rpm=60))
    await asyncio.sleep(20)
    await mother.send(10, "S")
    with pytest.raises(Unlikely, match=r"60\.601 s of motion took 19\.\d+ s, expected an osc"):
        await call
    assert "soft_ops       0" in bus.node(10).type("cf\r")


@pytest.mark.sacbus(nodes={10: {"ppm": 100_000}})
async def test_an_oscillator_may_be_off_by_a_tenth(bus: VirtualBus, mother: Mother) -> None:
    found = await calibrate(mother, 10, rpm=60, seconds=2)
    assert found.clock_ppm == pytest.approx(100_000, abs=10)


async def test_a_node_that_goes_silent_is_waited_for_no_longer_than_its_time(
    bus: VirtualBus, mother: Mother
) -> None:
    call = asyncio.create_task(calibrate(mother, 10, rpm=60, seconds=10))
    await asyncio.sleep(5)
    bus.node(10).power(on=False)
    with pytest.raises(NoSoftOp, match="node 10: expected it to tell of the end of its motion"):
        await call
    assert bus.now < 16 * SECOND


async def test_a_start_that_never_comes_is_told(bus: VirtualBus, mother: Mother) -> None:
    bus.node(10).drive("estop", 0)
    with pytest.raises(NoSoftOp, match=r"the start of its motion, got nothing within 2\.0 s"):
        await calibrate(mother, 10)


async def test_nobody_there_is_told_as_of_any_transaction(bus: VirtualBus, mother: Mother) -> None:
    with pytest.raises(NoAnswer, match="node 99"):
        await calibrate(mother, 99)


async def test_a_line_that_goes_meanwhile_is_told(bus: VirtualBus, mother: Mother) -> None:
    call = asyncio.create_task(calibrate(mother, 10))
    await asyncio.sleep(20)
    mother.lose("unplugged")
    with pytest.raises(LineLost):
        await call


@pytest.mark.parametrize(("rpm", "seconds"), [(0, 60), (-5, 60), (60, 0), (60, 0.001)])
async def test_nothing_to_time_is_refused(mother: Mother, rpm: int, seconds: float) -> None:
    with pytest.raises(BadRequest, match="expected 1 RPM and one step at least"):
        await calibrate(mother, 10, rpm=rpm, seconds=seconds)


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (float("nan"), "expected a time that ends"),
        (float("inf"), "expected a time that ends"),
        (1e9, "expected at most 4294967295 steps, got 200000000000; take fewer seconds"),
    ],
)
async def test_what_no_command_can_say_is_refused_and_nothing_is_sent(
    mother: Mother, seconds: float, told: str
) -> None:
    with pytest.raises(BadRequest, match=told):
        await calibrate(mother, 10, seconds=seconds)
    assert not mother.statistics


async def test_an_emergency_stop_in_the_instant_of_the_ack_is_told_as_such(
    bus: VirtualBus, mother: Mother
) -> None:
    await calibrate(mother, 10, seconds=1)
    soft_ops, command, _ = mother.statistics[10].round_trips
    await asyncio.sleep(1)
    acknowledged = bus.now + soft_ops + MOTHER_GAP + command
    bus.hosted.bus.kernel.at(acknowledged, mother.caller.estop, lambda _outcome: None)
    with pytest.raises(Stopped, match="an emergency stop came first"):
        await calibrate(mother, 10, seconds=1)
    assert bus.node(10).state == "STANDBY"


async def test_an_emergency_stop_ends_it(bus: VirtualBus, mother: Mother) -> None:
    call = asyncio.create_task(calibrate(mother, 10))
    await asyncio.sleep(20)
    await mother.estop()
    with pytest.raises(Stopped, match="an emergency stop came first: the motion is not over"):
        await call
