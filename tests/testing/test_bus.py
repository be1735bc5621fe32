"""A bus in the hands of a test: looking, doing, and how time passes."""

from __future__ import annotations

import asyncio
import unittest
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.bus import BitErrors, FaultError
from sacbus.config import ConfigError
from sacbus.configuration import Configuration
from sacbus.kernel import MS, SECOND
from sacbus.mother import BadRequest, Mother, NoAnswer, Refused
from sacbus.node import PinError
from sacbus.scenario import Bounds, NodeIs
from sacbus.testing import BusMaker, VirtualBus, virtual_bus

# ---- time ----


def test_time_passes_exactly_as_long_as_is_said(bus: VirtualBus) -> None:
    bus.run_for("250 ms")
    bus.run_for("3 ns")
    assert bus.now == 250 * MS + 3
    bus.sleep(0.5)
    assert bus.now == 750 * MS + 3
    assert bus.time() == pytest.approx(0.750_000_003)


def test_until_stops_at_the_event_that_makes_it_true(bus: VirtualBus) -> None:
    bus.send(10, "m400v120")
    bus.until(lambda: bus.node(10).state == "STANDBY", within="5 s")
    # The end of a command is an event of the bus: it is seen in the very nanosecond.
    track = bus.node(10).track
    assert list(track.states())[-1] == (bus.now, "STANDBY")


def test_until_looks_once_more_when_the_time_is_over(bus: VirtualBus) -> None:
    bus.until(lambda: bus.now >= SECOND, within="1 s")
    assert bus.now == SECOND
    with pytest.raises(AssertionError, match="what is waited for did not come within 10 ms"):
        bus.until(lambda: False, within="10 ms")
    assert bus.now == SECOND + 10 * MS


def test_until_names_the_condition_that_did_not_come(bus: VirtualBus) -> None:
    def homed() -> bool:
        return False

    with pytest.raises(AssertionError, match="homed did not come"):
        bus.until(homed, within="1 ms")


@pytest.mark.sacbus(boot="cold")
def test_nodes_that_boot_are_waited_for(bus: VirtualBus) -> None:
    assert bus.now >= SECOND
    assert bus.node(10).state == "STANDBY"


def test_a_coroutine_can_be_run_in_a_test_that_is_none(bus: VirtualBus) -> None:
    async def controller(mother: Mother) -> int:
        await mother.send(10, "m400v120")
        await asyncio.sleep(60)
        return (await mother.send(10, "m1")).attempts

    assert bus.run(controller(bus.mother)) == 1
    assert bus.now > 60 * SECOND


@pytest.mark.asyncio
async def test_what_would_move_time_behind_the_loop_is_refused(bus: VirtualBus) -> None:
    refused: list[Callable[[], object]] = [
        lambda: bus.run_for("1 s"),
        lambda: bus.sleep(1),
        lambda: bus.until(lambda: True, within="1 s"),
        lambda: bus.expect(node=10, position=0),
        lambda: bus.send(10, "m1"),
        lambda: bus.broadcast("y"),
        lambda: bus.run(bus.reached(lambda: True, within="1 s")),
    ]
    for deed in refused:
        with pytest.raises(RuntimeError, match=r"in an async test .*await"):
            deed()
    assert bus.now == 0


def test_a_loop_of_another_time_is_refused_at_once(bus: VirtualBus) -> None:
    for coroutine in (
        bus.mother.send(10, "m1"),
        bus.reached(lambda: True, within="1 s"),
        bus.expected(node=10, position=0),
    ):
        with pytest.raises(RuntimeError, match="this loop is not in the bus's time"):
            asyncio.run(coroutine)


@pytest.mark.asyncio
async def test_an_async_test_waits_as_exactly(bus: VirtualBus, mother: Mother) -> None:
    await mother.send(10, "m400v120")
    await bus.reached(lambda: bus.node(10).state == "STANDBY", within="5 s")
    assert list(bus.node(10).track.states())[-1] == (bus.now, "STANDBY")
    before = bus.now
    with pytest.raises(AssertionError, match="within 10 ms"):
        await bus.reached(lambda: False, within="10 ms")
    assert bus.now == before + 10 * MS
    with pytest.raises(AssertionError, match="expected node 10: position 401, got position 400"):
        await bus.expected(node=10, position=401)


@pytest.mark.asyncio
async def test_other_tasks_go_on_while_one_waits(bus: VirtualBus, mother: Mother) -> None:
    ticks = []

    async def tick() -> None:
        while True:
            await asyncio.sleep(0.1)
            ticks.append(bus.now)

    ticking = asyncio.create_task(tick())
    await mother.send(10, "m400v120")
    await bus.expected(node=10, state="STANDBY", within="5 s")
    ticking.cancel()
    assert len(ticks) == bus.now // (100 * MS)


@pytest.mark.asyncio
async def test_what_another_task_does_is_seen_at_once(bus: VirtualBus) -> None:
    async def press() -> None:
        await asyncio.sleep(0.123_456_7)
        bus.node(10).power(on=False)

    pressing = asyncio.create_task(press())
    await bus.expected(node=10, state="OFF", within="10 s")
    assert abs(bus.now - 123_456_700) <= 1
    await pressing


# ---- looking and doing ----


@pytest.mark.sacbus(kind="ss-mst67", nodes="3")
def test_mother_sends_nothing_to_a_bus_of_another_protocol(bus: VirtualBus) -> None:
    for send in (lambda: bus.send(3, "S"), lambda: bus.broadcast("S")):
        with pytest.raises(BadRequest, match="mother speaks sac, expected a bus that does"):
            send()
    assert bus.told()[2] == "  nothing"


def test_mother_sends_and_her_errors_are_those_of_her_coroutines(bus: VirtualBus) -> None:
    assert bus.send(10, "m40").attempts == 1
    assert bus.node(11).send("m-40").node == 11
    with pytest.raises(NoAnswer):
        bus.send(99, "")
    with pytest.raises(BadRequest):
        bus.send(10, "m\x03")
    with bus.fault(bit_errors=0.2), pytest.raises((NoAnswer, Refused)):
        bus.send(10, "q1m5")
    assert bus.counts["retries"] >= 2


def test_a_broadcast_ends_when_the_next_packet_may_follow(bus: VirtualBus) -> None:
    bus.broadcast("m40")
    bus.send(10, "")
    bus.expect(node="all", position=40, within="2 s")
    assert bus.counts["timeouts"] == 0


def test_raw_bytes_are_put_on_the_line_as_they_are(bus: VirtualBus) -> None:
    bus.raw("02 0a 01 6d 34 30 30 03 de 00")
    bus.run_for("10 ms")
    bus.raw(bytes.fromhex("02 0b 01 6d 34 30 30 03 de 00"))
    bus.run_for("5 s")
    assert [node.position for node in bus.nodes.values()] == [400, 400, 0]


def test_a_node_is_seen_as_it_is_now(bus: VirtualBus) -> None:
    node = bus.node(10)
    node.send("m400v120")
    bus.run_for("1 s")
    assert node.state == "CRUISE"
    assert node.velocity == pytest.approx(120, abs=0.5)
    assert 100 < node.position == node.pulses < 300
    assert repr(node).startswith(f"<node 10: CRUISE at {node.position:g}, 120")
    assert repr(node).endswith(f"m400v120a1d1, at {bus.time():.6f} s>")
    assert repr(bus) == f"<bus 'bus' at {bus.time():.6f} s>"


def test_a_node_that_is_not_there_is_told_with_those_that_are(bus: VirtualBus) -> None:
    with pytest.raises(LookupError, match="no node 99 on this bus; its nodes: 10, 11, 12"):
        bus.node(99)


def test_a_node_keeps_the_name_of_its_configuration(bus: VirtualBus) -> None:
    node = bus.node(10)
    node.send("$CM77")
    node.send("$R")
    bus.run_for("3 s")
    bus.send(77, "m40")
    bus.expect(node=10, position=40, within="2 s")
    assert repr(node).startswith("<node 10 (now 77): ")


def test_pins_encoder_terminal_and_power_are_at_hand(bus: VirtualBus) -> None:
    node = bus.node(10)
    edges = node.edges("op_sa")
    node.send("m40s")
    node.drive("sync", 0)
    bus.expect(node=10, position=40, within="2 s")
    bus.run_for("1 s")
    assert [level for _, level in edges] == [1, 0]
    assert node.level("op_sa") == 0
    assert "Q is at 2" in node.type("q\r")
    node.turn(2)
    node.power(on=False)
    assert node.state == "OFF"
    with pytest.raises(PinError):
        node.drive("lever", 1)
    with pytest.raises(PinError):
        node.edges("lever")


def test_pulses_are_known_one_by_one(bus: VirtualBus) -> None:
    bus.send(10, "m400v120")
    bus.run_for("5 s")
    times = bus.node(10).track.pulses(0, bus.now)
    assert times.size == 400
    assert (times[1:] > times[:-1]).all()


def test_faults_are_words_or_values_counted_and_taken_off(bus: VirtualBus) -> None:
    fault = bus.fault(BitErrors(0.5))
    bus.raw(b"\x55" * 10)
    bus.run_for("1 s")
    count = fault.count
    assert count > 0
    fault.off()
    bus.raw(b"\x55" * 10)
    bus.run_for("1 s")
    assert fault.count == count
    with pytest.raises(FaultError, match="bit_mistakes"):
        bus.fault(bit_mistakes=1)


# ---- expectations ----


def test_an_expectation_is_a_value_or_its_keys(bus: VirtualBus) -> None:
    bus.send(10, "m40")
    bus.expect(NodeIs((10,), position=Bounds.exactly(40), within=2 * SECOND))
    bus.expect(node=[10], position=(39, 41))
    bus.expect(node=range(11, 13), position=0, for_="1 s")
    with pytest.raises(TypeError, match="or its keys, got both"):
        bus.expect(NodeIs((10,)), node=10)


def test_packets_and_silence_can_be_expected(bus: VirtualBus) -> None:
    bus.raw("02 0a 01 6d 34 30 30 03 de 00")
    bus.expect(answer="ack", from_=10, to=1, within="10 ms")
    bus.expect(silence="100 ms")


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"node": 99, "position": 1}, "expect: expected nodes of bus 'bus' (10-12), got 99"),
        ({"node": 10, "position": 1, "posture": 1}, "expect.posture: unknown key"),
        ({"node": 10, "position": 1, "within": 3}, "expect.within: expected a time such as"),
        ({"node": 10, "state": "RUNNING"}, "expect.state: expected a state of node 10 (STANDBY"),
        ({"node": 10}, "expected something to look at"),
        ({}, "expected something to look at"),
    ],
)
def test_what_cannot_be_expected_is_one_line(
    bus: VirtualBus, keys: dict[str, object], why: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        bus.expect(**keys)
    assert why in str(caught.value)
    assert "in this test" in str(caught.value)
    assert "\n" not in str(caught.value)


# ---- without fixtures ----


class WithUnittest(unittest.TestCase):
    def test_a_bus_needs_no_fixture(self) -> None:
        with virtual_bus(nodes="10-12", ustep=3) as bus:
            bus.send(10, "m2")
            bus.run_for("1 s")
            assert bus.node(10).pulses == 16


@settings(max_examples=10)
@given(steps=st.integers(-50, 50).filter(bool))
def test_a_bus_for_each_example_of_a_property(steps: int) -> None:
    with virtual_bus(Configuration(nodes=(10,))) as bus:
        bus.send(10, f"m{steps}")
        bus.expect(node=10, position=steps, state="STANDBY", within="2 s")


def test_what_was_seen_stays_when_the_bus_is_closed() -> None:
    with virtual_bus(nodes=10) as bus:
        bus.send(10, "m4")
        bus.run_for("1 s")
    assert bus.node(10).position == 4
    assert "  node 10: STANDBY at 4, 0 RPM" in bus.told()


def test_buses_of_one_test_share_their_clock(make_bus: BusMaker) -> None:
    left, right = make_bus(nodes=10, name="left"), make_bus(nodes=10, name="right")
    left.send(10, "m4")
    right.run_for("1 s")
    assert left.now == right.now
    assert (left.node(10).position, right.node(10).position) == (4, 0)
