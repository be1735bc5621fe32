"""A node's panel: what is done to a node from outside happens at once, and the bus takes it up."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import SECOND, Kernel, Ns
from sacbus.node import PinError
from sacbus.selector import real_loop


def virtually(play: Callable[[HostedBus], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        async with open_bus(Configuration(nodes=(10, 11))) as bus:
            await play(bus)

    run_virtual(Kernel(), main())


def test_a_pin_that_is_driven_starts_what_is_held() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        await bus.mother().send(10, "m5v10s")
        await asyncio.sleep(1)
        assert panel.snapshot().state == "SYNC"
        panel.drive("sync", 0)
        assert panel.level("sync") == 0
        assert panel.snapshot().position_pulses == 1
        await asyncio.sleep(1)
        assert (panel.snapshot().position_pulses, panel.snapshot().state) == (5, "STANDBY")

    virtually(play)


def test_the_encoder_turns_either_way() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        panel.turn(7)
        panel.turn(-2)
        panel.turn(0)
        assert panel.snapshot().position_pulses == 5

    virtually(play)


def test_edges_are_told_to_everyone_who_watches_until_they_do_not() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        mine: list[tuple[str, int, Ns]] = []
        others: list[str] = []
        end = panel.watch(lambda *edge: mine.append(edge))
        panel.watch(lambda pin, _level, _when: others.append(pin))
        mother = bus.mother()
        await mother.send(10, "m2v10")
        await asyncio.sleep(1)
        assert [edge[:2] for edge in mine] == [
            ("op_sa", 1),
            ("op_sb", 0),
            ("op_sa", 0),
            ("op_sb", 1),
        ]
        assert mine[2][2] - mine[0][2] == 60_000_000
        assert others == [pin for pin, _, _ in mine]
        end()
        end()
        await mother.send(10, "m2v10")
        await asyncio.sleep(1)
        assert (len(mine), len(others)) == (4, 8)

    virtually(play)


def test_power_goes_and_comes_back_with_the_memory() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        mother = bus.mother()
        await mother.send(10, "$CA1")
        await mother.send(10, "qs")
        panel.power(on=False)
        assert panel.snapshot().state == "OFF"
        await asyncio.sleep(1)
        panel.power(on=True)
        await bus.booted()
        # Autorun: a loop over position 1 alone.
        await asyncio.sleep(1)
        assert panel.snapshot().current == "m200v100a1d1"

    virtually(play)


def test_a_panel_is_one_whoever_asks_for_it_and_has_the_terminal() -> None:
    async def play(bus: HostedBus) -> None:
        assert bus.panel(10) is bus.panel(10)
        assert bus.panel(10).console is bus.terminal(10)
        with pytest.raises(KeyError, match="no node 99 on bus"):
            bus.panel(99)
        with pytest.raises(PinError, match="pin 'pwm': expected one of the inputs"):
            bus.panel(11).drive("pwm", 1)

    virtually(play)


def test_in_real_time_a_pin_acts_at_the_time_that_it_is() -> None:
    async def main() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            panel = bus.panel(10)
            edges: list[tuple[str, int, Ns]] = []
            done = asyncio.Event()

            def seen(pin: str, level: int, when: Ns) -> None:
                edges.append((pin, level, when))
                if (pin, level) == ("op_sa", 0):
                    done.set()

            panel.watch(seen)
            await bus.mother().send(10, "m1vc20000a999d999s")
            before = bus.now()
            panel.drive("sync", 0)
            after = bus.now()
            async with asyncio.timeout(20):
                await done.wait()
            started, ended = (when for pin, _, when in edges if pin == "op_sa")
            assert before <= started <= after
            assert ended - started == SECOND // 50

    with asyncio.Runner(loop_factory=real_loop) as runner:
        runner.run(main())


def test_who_acts_on_what_is_told_acts_after_it() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        told: list[tuple[str, int]] = []

        def stop(pin: str, level: int, _when: Ns) -> None:
            told.append((pin, level))
            if (pin, level) == ("op_sa", 1):
                panel.drive("estop", 0)

        panel.watch(stop)
        await bus.mother().send(10, "m50v100")
        await asyncio.sleep(1)
        assert told == [("op_sa", 1), ("op_sb", 0), ("op_sa", 0), ("op_sb", 1)]
        assert panel.level("op_sb") == 1
        assert panel.snapshot().position_pulses == 1

    virtually(play)


def test_a_pin_that_is_not_there_is_refused_to_who_asks_also_while_edges_are_told() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        refused: list[str] = []

        def wrong(_pin: str, _level: int, _when: Ns) -> None:
            try:
                panel.drive("pwm", 1)
            except PinError as fault:
                refused.append(str(fault))

        panel.watch(wrong)
        await bus.mother().send(10, "m2v10")
        await asyncio.sleep(1)
        assert len(refused) == 4

    virtually(play)


def test_who_watches_twice_is_told_twice_and_ends_each_by_itself() -> None:
    async def play(bus: HostedBus) -> None:
        panel = bus.panel(10)
        told: list[str] = []

        def watcher(pin: str, _level: int, _when: Ns) -> None:
            told.append(pin)

        end = panel.watch(watcher)
        panel.watch(watcher)
        end()
        end()
        await bus.mother().send(10, "m2v10")
        await asyncio.sleep(1)
        assert told == ["op_sa", "op_sb"] * 2

    virtually(play)
