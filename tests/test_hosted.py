"""A bus that runs: faults in the hands of who hosts it, in virtual time and in real time."""

from __future__ import annotations

import asyncio

import pytest

from sacbus.bus import Babble, Dead, Drop, FaultError
from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import MS, Kernel
from sacbus.mother import BadRequest, MotherError
from sacbus.selector import real_loop


async def _lose_and_find(bus: HostedBus) -> int:
    """Nobody answers while a fault is on, and everybody does before and after; what it counted."""
    mother = bus.mother()
    await mother.send(10, "v100")
    on = bus.fault(Dead(10))
    with pytest.raises(MotherError):
        await mother.send(10, "v100")
    on.off()
    count = on.count
    await mother.send(10, "v100")
    assert on.count == count
    return count


async def _scene() -> int:
    async with open_bus(Configuration(nodes=(10,))) as bus:
        return await _lose_and_find(bus)


def test_a_fault_is_put_on_and_taken_off_in_virtual_time() -> None:
    assert run_virtual(Kernel(), _scene()) == 3  # an attempt and two retries


def test_a_fault_is_put_on_and_taken_off_in_real_time() -> None:
    with asyncio.Runner(loop_factory=real_loop) as runner:
        # A machine that is late has mother try again the first line as well.
        assert runner.run(_scene()) >= 3


@pytest.mark.asyncio
async def test_mother_speaks_to_no_bus_of_another_protocol() -> None:
    async with open_bus(Configuration(nodes=(3,), kind="ss-mst67", name="table")) as bus:
        with pytest.raises(BadRequest) as refused:
            bus.mother()
    assert str(refused.value) == (
        "bus table: mother speaks sac, expected a bus that does, got superstepper, take a master "
        "of that protocol"
    )


@pytest.mark.slow
def test_what_a_fault_wants_to_say_by_itself_is_said_in_real_time() -> None:
    async def main() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            thrice = asyncio.Event()

            def seen(_sent: object) -> None:
                if on.count == 3:
                    thrice.set()

            bus.bus.medium.watchers.append(seen)
            on = bus.fault(Babble(b"A", 5 * MS))
            async with asyncio.timeout(20):
                await thrice.wait()
            on.off()

    with asyncio.Runner(loop_factory=real_loop) as runner:
        runner.run(main())


def test_a_fault_that_the_bus_cannot_have_is_refused() -> None:
    async def main() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            with pytest.raises(FaultError, match="the address of a node on this bus, got 11"):
                bus.fault(Babble(b"A", MS, node=11))
            assert bus.fault(Drop(1)).since == bus.now()

    run_virtual(Kernel(), main())
