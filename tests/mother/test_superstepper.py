"""The master of a Super Stepper Bus for coroutines, on a bus of ours and through links."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Coroutine
from pathlib import Path
from typing import Any, TypeVar

import pytest

from sacbus.configuration import Configuration
from sacbus.daemon import open_bus
from sacbus.host import VirtualLoop
from sacbus.hosted import HostedBus
from sacbus.kernel import Kernel
from sacbus.links import LinkError
from sacbus.links.places import PtyAt, Rfc2217At, TcpAt
from sacbus.mother import BadRequest, LineLost
from sacbus.mother.superstepper import NoReply, SuperStepper
from sacbus.wire.superstepper import (
    Answer,
    Decay,
    Expanded,
    Rate,
    Status,
)

_T = TypeVar("_T")


def virtually(main: Coroutine[Any, Any, _T]) -> _T:
    loop = VirtualLoop(Kernel())
    try:
        return loop.run_until_complete(main)
    finally:
        loop.close()


def hosted(**more: Any) -> Any:  # noqa: ANN401 (a configuration's keys, and what open_bus gives)
    return open_bus(Configuration(nodes=(3, 4), kind="ss-mst67", **more))


async def everything(master: SuperStepper, bus: HostedBus) -> None:
    await master.microsteps(3, 4, Decay.SLOW)
    await master.move_at_speed(3, 4_000, clockwise=False, accelerate=False)
    assert bus.snapshot(3).rpm == -37.5
    assert await master.status(3) == Status(busy=True)
    await master.change_speed(3, 8_000)
    await master.stop(3, decelerate=False, enabled=False)
    assert await master.status(3) == Status()
    await master.move_steps(3, 5, speed=100, rate=Rate.MEDIUM)
    await asyncio.sleep(2)
    assert await master.steps_run(3) == 5
    await master.home(3, speed=10_000, most=3)
    await master.write(3, 0x10, 0x42)
    assert await master.read(3, 0x10) == 0x42
    await master.write(3, 2, 1, eeprom=True)
    assert await master.read(3, 2, eeprom=True) == 1
    assert await master.read_word(3, 3) == 32_000
    with pytest.raises(NoReply) as silent:
        await master.stop(9)
    assert isinstance(silent.value, TimeoutError)
    with pytest.raises(BadRequest, match="1, 2, 4 or 8"):
        await master.microsteps(3, 3)


@pytest.mark.parametrize("jmp2", ["open", "closed"])
def test_every_opcode_has_a_method(jmp2: str) -> None:
    async def session() -> None:
        async with hosted(settings={"jmp2": jmp2}) as bus:
            master = SuperStepper.on(bus)
            await everything(master, bus)
            master.lose("the bus is closed")
            with pytest.raises(LineLost):
                await master.stop(3)

    virtually(session())


def test_a_bus_of_another_protocol_is_refused() -> None:
    async def session() -> None:
        async with open_bus(Configuration(nodes=(10,), name="arm")) as bus:
            with pytest.raises(BadRequest) as refused:
                SuperStepper.on(bus)
        assert str(refused.value) == (
            "bus arm: this master speaks superstepper or superstepper-9, expected a bus that does, "
            "got sac, take a master of that protocol"
        )

    virtually(session())


WRONG: list[tuple[str, dict[str, Any], str]] = [
    (
        "move_steps",
        {"steps": 99_999, "speed": 1},
        "steps: expected a whole number from 0 to 65535, got 99999",
    ),
    (
        "move_steps",
        {"steps": -1, "speed": 1},
        "steps: expected a whole number from 0 to 65535, got -1",
    ),
    (
        "move_steps",
        {"steps": 1, "speed": 1.5},
        "speed: expected a whole number from 0 to 65535, got 1.5",
    ),
    (
        "move_at_speed",
        {"speed": 9, "rate": "quick"},
        "rate: expected a Rate (FAST, MEDIUM, SLOW, NONE), got 'quick'",
    ),
    ("home", {"speed": 9, "rate": 4}, "rate: expected a Rate (FAST, MEDIUM, SLOW, NONE), got 4"),
    (
        "microsteps",
        {"per_step": 8, "decay": "slow"},
        "decay: expected a Decay (FAST, MIXED, MIXED_TOO, SLOW), got 'slow'",
    ),
    ("stop", {"enabled": "no"}, "enabled: expected True or False, got 'no'"),
    ("read", {"place": 256}, "place: expected a whole number from 0 to 255, got 256"),
    ("write", {"place": 1, "byte": None}, "byte: expected a whole number from 0 to 255, got None"),
    ("status", {"address": 32}, "address: expected a whole number from 0 to 31, got 32"),
]


@pytest.mark.parametrize(("method", "arguments", "told"), WRONG)
def test_an_argument_that_cannot_be_sent_is_named(
    method: str, arguments: dict[str, Any], told: str
) -> None:
    async def session() -> None:
        async with hosted() as bus:
            given = {"address": 3, **arguments}
            with pytest.raises(BadRequest) as wrong:
                await getattr(SuperStepper.on(bus), method)(**given)
            assert str(wrong.value) == f"module {given['address']}: {told}"
            assert not bus.snapshot(3).counters["messages"]

    virtually(session())


def test_a_call_that_is_cancelled_leaves_the_line_to_others() -> None:
    async def session() -> None:
        async with hosted() as bus:
            master = SuperStepper.on(bus)
            waits = asyncio.ensure_future(master.stop(9))
            await asyncio.sleep(0.001)
            waits.cancel()
            assert await master.read(3, 2) == 10

    virtually(session())


@pytest.mark.slow
@pytest.mark.asyncio
async def test_it_works_through_a_pty_and_tcp() -> None:
    async with hosted(links=(PtyAt(None), TcpAt("127.0.0.1", 0))) as bus:
        for link in bus.links:
            async with SuperStepper.connect(link.where) as master:
                await master.move_at_speed(3, 4_000)
                assert (await master.status(3)).busy
                await master.stop(3, decelerate=False)
            with pytest.raises(LineLost, match="connect again"):
                await master.stop(3)
            with pytest.raises(LinkError, match="no ninth bits there"):
                async with SuperStepper.connect(link.where, nine=True):
                    pass


@pytest.mark.slow
@pytest.mark.asyncio
async def test_9_bit_mode_works_behind_rfc_2217() -> None:
    nine = {"jmp2": "closed"}
    async with hosted(settings=nine, links=(Rfc2217At("127.0.0.1", 0),)) as bus:
        async with SuperStepper.connect(bus.links[0].where, nine=True) as master:
            await master.move_steps(3, 5, speed=1_000)
            assert await master.read_word(3, 3) == 32_000
            assert await master.read(4, 2) == 10
        assert bus.snapshot(3).counters["ack"] == 2


@pytest.mark.asyncio
async def test_bytes_without_ninth_bits_are_headers_on_a_9_bit_bus() -> None:
    async with hosted(settings={"jmp2": "closed"}, links=(PtyAt(None),)) as bus:
        (link,) = bus.links
        async with SuperStepper.connect(link.where) as master:
            assert await master.send(3, Expanded()) == Answer(3)  # a header and no more
            with pytest.raises(NoReply):
                await master.status(3)
        assert bus.snapshot(3).counters["messages"] == 1


def test_the_eeprom_outlives_the_bus(tmp_path: Path) -> None:
    async def session() -> int:
        async with hosted(state=tmp_path) as bus:
            master = SuperStepper.on(bus)
            before = await master.read(3, 0x80, eeprom=True)
            await master.write(3, 0x80, 0x42, eeprom=True)
            return before

    assert virtually(session()) == 0xFF
    assert virtually(session()) == 0x42
    stored = json.loads((tmp_path / "bus" / "3").read_text())
    assert stored["kind"] == "ss-mst67"
