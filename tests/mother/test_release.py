"""Nodes are loaded, held and released together, or none of them starts."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from sacbus import Mother, open_bus
from sacbus.daemon import Configuration, HostedBus
from sacbus.host import run_virtual
from sacbus.kernel import MS, Kernel
from sacbus.mother import LineLost, NoAnswer, NotStarted, Share, start_together

THREE = (10, 11, 12)


def virtually(play: Callable[[HostedBus, Mother], Coroutine[Any, Any, None]]) -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=THREE)) as bus:
            await play(bus, bus.mother())

    run_virtual(Kernel(), scene())


def share(node: int, steps: int = 400) -> Share:
    return Share(node, (f"q5m{steps}v100a999d999s",), ("x5",))


def states(bus: HostedBus) -> list[str]:
    return [one.state for one in bus.snapshots()]


def steps(bus: HostedBus) -> list[float]:
    return [one.position_steps for one in bus.snapshots()]


def test_all_start_in_the_same_instant_and_its_time_is_told() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        release = await start_together(mother, [share(node) for node in THREE])
        assert release.earliest < release.latest <= release.earliest + 4 * MS
        assert states(bus) == ["CRUISE"] * 3
        for _ in range(100):
            await asyncio.sleep(0.01)
            here = steps(bus)
            assert here == here[:1] * 3
        await asyncio.sleep(60)
        assert steps(bus) == [400.0] * 3

    virtually(play)


def test_nobody_starts_when_one_cannot_be_loaded() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(NotStarted, match="nothing was started: node 99") as failed:
            await start_together(mother, [share(10), share(99), share(11)])
        assert (failed.value.node, failed.value.still_held) == (99, ())
        assert isinstance(failed.value.cause, NoAnswer)
        assert states(bus) == ["STANDBY"] * 3
        assert mother.statistics[11].sent == 0

    virtually(play)


def test_those_that_are_held_already_are_let_go_when_the_last_one_fails() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        broken = Share(99, (), ("x5",))
        with pytest.raises(NotStarted) as failed:
            await start_together(mother, [share(10), share(11), broken])
        # Nobody knows whether 99 is held; it does not answer.
        assert failed.value.still_held == (99,)
        assert "99 may still be held" in str(failed.value)
        await mother.broadcast("y")
        await asyncio.sleep(60)
        assert (states(bus), steps(bus)) == (["STANDBY"] * 3, [0.0] * 3)

    virtually(play)


def test_another_way_to_release_takes_the_place_of_the_broadcast() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        async def pull() -> None:
            for node in THREE:
                bus.panel(node).drive("sync", 0)

        await start_together(mother, [share(node) for node in THREE], release=pull)
        assert mother.statistics[0].sent == 0
        await asyncio.sleep(60)
        assert steps(bus) == [400.0] * 3

    virtually(play)


def test_a_release_that_fails_lets_nobody_go_on() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        async def stuck() -> None:
            raise LineLost("the sync line is not there")

        with pytest.raises(LineLost, match="sync line"):
            await start_together(mother, [share(node) for node in THREE], release=stuck)
        assert states(bus) == ["STANDBY"] * 3

    virtually(play)


def test_a_start_that_is_cancelled_leaves_nobody_held() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        start = asyncio.create_task(start_together(mother, [share(node) for node in THREE]))
        await asyncio.sleep(0.037)  # of bus time: the third is being told to hold
        assert mother.statistics[12].sent == 2
        assert states(bus)[:2] == ["SYNC"] * 2
        start.cancel()
        with pytest.raises(asyncio.CancelledError):
            await start
        await asyncio.sleep(1)
        assert states(bus) == ["STANDBY"] * 3

    virtually(play)
