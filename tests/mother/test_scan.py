"""Scanning a line in virtual time: good lines, bad ones, slow links, and who else calls."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

import pytest

from sacbus import Mother, open_bus
from sacbus.bus import BitErrors, Latency
from sacbus.daemon import Configuration, HostedBus
from sacbus.host import run_virtual
from sacbus.kernel import MS, SECOND, Kernel
from sacbus.mother import Acknowledged, BadRequest, LineLost, ScanProgress
from sacbus.mother.mother import LINK_SLACK

#: The empty packet, the shortest turnaround, and an answer (spec, wire).
ROUND_TRIP = 1_562_500 + 385_000 + 1_041_666


def virtually(
    nodes: Sequence[int],
    play: Callable[[HostedBus, Mother], Coroutine[Any, Any, None]],
    *,
    seed: int = 0,
) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=tuple(nodes), seed=seed)) as bus:
            await play(bus, bus.mother())

    run_virtual(Kernel(), scene())


def test_who_is_there_is_found_in_the_order_of_addresses_and_nobody_else() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        found = await mother.scan()
        assert found == [Acknowledged(node, 1, ROUND_TRIP) for node in (4, 85, 200, 255)]
        assert mother.statistics[85].as_dict() == {
            "sent": 1,
            "acks": 1,
            "naks": 0,
            "timeouts": 0,
            "retries": 0,
            "round_trip_us": {"min": 2989.166, "median": 2989.166, "p99": 2989.166},
        }
        assert mother.statistics[86].sent == mother.statistics[86].timeouts == 3
        assert all(node.state == "STANDBY" for node in bus.snapshots())

    virtually((255, 85, 4, 200), play)


def test_252_absent_nodes_take_some_seconds_and_as_many_that_answer_one() -> None:
    async def nobody(bus: HostedBus, mother: Mother) -> None:
        assert await mother.scan() == []
        assert 5 * SECOND < bus.now() < 6 * SECOND

    async def everybody(bus: HostedBus, mother: Mother) -> None:
        assert [one.node for one in await mother.scan()] == list(range(4, 256))
        assert bus.now() < 1.1 * SECOND

    virtually((), nobody)
    virtually(range(4, 256), everybody)


def test_only_the_addresses_that_were_given_are_asked_each_once() -> None:
    async def play(_bus: HostedBus, mother: Mother) -> None:
        found = await mother.scan([12, 10, 12, 99])
        assert [one.node for one in found] == [12, 10]
        assert set(mother.statistics) == {12, 10, 99}
        assert mother.statistics[12].sent == 1
        assert await mother.scan([]) == []

    virtually((10, 11, 12), play)


def test_an_address_that_no_node_has_is_refused_before_any_is_asked() -> None:
    async def play(_bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(BadRequest, match="node 3: expected an address from 4 to 255"):
            await mother.scan([10, 3])
        assert not mother.statistics

    virtually((10,), play)


@pytest.mark.parametrize("seed", range(5))
def test_bit_errors_at_a_thousandth_hide_nobody(seed: int) -> None:
    nodes = range(10, 250, 4)

    async def play(bus: HostedBus, mother: Mother) -> None:
        errors = bus.fault(BitErrors(1e-3))
        found = await mother.scan()
        assert errors.count > 10
        assert [one.node for one in found] == list(nodes)

    virtually(nodes, play, seed=seed)


@pytest.mark.slow
def test_even_at_a_hundredth_where_one_question_in_two_is_lost_nearly_all_are_found() -> None:
    nodes = range(10, 250, 4)

    async def play(bus: HostedBus, mother: Mother) -> None:
        bus.fault(BitErrors(1e-2))
        found = {one.node for one in await mother.scan()}
        assert len(found & set(nodes)) >= 0.9 * len(nodes)

    virtually(nodes, play)


@pytest.mark.parametrize("seed", [4, 16, 28])
def test_a_node_that_says_nak_and_then_nothing_does_not_end_a_scan(seed: int) -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        bus.fault(BitErrors(4e-2))
        found = {one.node for one in await mother.scan(range(10, 60))}
        naks = {node for node, one in mother.statistics.items() if one.naks and one.timeouts > 2}
        assert naks
        assert len(found) > 10

    virtually(range(10, 60), play, seed=seed)


def test_nodes_are_found_on_a_link_that_is_slower_than_a_sweep_is_patient() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10, 85))) as bus:
            # A mother that knows of the link's slowness, as one on an adapter does.
            mother = bus.mother()
            mother.caller._slack = LINK_SLACK
            bus.fault(Latency(16 * MS))
            found = await mother.scan()
            assert [one.node for one in found] == [10, 85]
            assert all(one.round_trip == ROUND_TRIP + 16 * MS for one in found)
            # Heard as strays first, then asked with more patience.
            assert mother.caller.strays == 2
            assert [one.attempts for one in found] == [2, 2]
            assert bus.now() < 6 * SECOND

    run_virtual(Kernel(), scene())


def test_a_late_answer_to_a_probe_is_never_taken_for_that_to_a_command() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            mother = bus.mother()
            mother.caller._slack = LINK_SLACK
            bus.fault(Latency(16 * MS))
            scan = asyncio.create_task(mother.scan([10, 11]))
            await asyncio.sleep(0)
            answer = await mother.send(10, "m400")
            assert answer.round_trip > 16 * MS
            assert mother.caller.strays == 1
            assert [one.node for one in await scan] == [10]

    run_virtual(Kernel(), scene())


def test_other_calls_have_their_turns_between_the_addresses() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        scan = asyncio.create_task(mother.scan())
        await asyncio.sleep(0.1)
        before = bus.now()
        assert isinstance(await mother.send(10, "m400"), Acknowledged)
        assert bus.now() - before < 20 * MS
        assert [one.node for one in await scan] == [10]

    virtually((10,), play)


def test_progress_is_told_after_every_address() -> None:
    told: list[ScanProgress] = []

    async def play(_bus: HostedBus, mother: Mother) -> None:
        found = await mother.scan(range(10, 14), progress=told.append)
        assert [(one.sweep, one.asked, one.of) for one in told] == [
            (1, 1, 4),
            (1, 2, 4),
            (1, 3, 4),
            (1, 4, 4),
            (2, 1, 2),
            (2, 2, 2),
            (3, 1, 2),
            (3, 2, 2),
        ]
        assert told[-1].found == tuple(found)
        assert [len(one.found) for one in told] == [1, 1, 2, 2, 2, 2, 2, 2]

    virtually((10, 12), play)


def test_a_scan_that_is_cancelled_leaves_the_line_in_order() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await mother.scan()
        assert not mother.caller.stray_watchers
        sent = sum(one.sent for one in mother.statistics.values())
        assert isinstance(await mother.send(10, "m400"), Acknowledged)
        assert sum(one.sent for one in mother.statistics.values()) == sent + 1

    virtually((10,), play)


def test_a_line_that_is_lost_ends_a_scan() -> None:
    async def play(_bus: HostedBus, mother: Mother) -> None:
        scan = asyncio.create_task(mother.scan())
        await asyncio.sleep(0.5)
        mother.lose("unplugged")
        with pytest.raises(LineLost):
            await scan

    virtually((10,), play)
