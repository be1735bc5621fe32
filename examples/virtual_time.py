"""Ten minutes of motion in some milliseconds: a bus and its master in virtual time.

    python examples/virtual_time.py

Virtual time does not pass, it jumps from one event to the next. Coroutines see it move with the
bus: ``asyncio.sleep(60)`` is a minute of motion and costs nothing. Every run gives the same figures
to the last pulse, which is what a test wants.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Sequence

from sacbus import open_bus
from sacbus.daemon import Configuration
from sacbus.host import run_virtual
from sacbus.kernel import Kernel


async def ten_minutes() -> bool:
    """Have two motors turn for ten minutes; whether both stopped where they were sent."""
    async with open_bus(Configuration(nodes=(10, 11))) as bus:
        mother = bus.mother()
        begun = time.perf_counter()

        # 240 000 steps at 120 RPM, 400 steps a second: ten minutes. Node 11 turns the other way.
        answer = await mother.send(10, "m240000v120")
        print(f"node 10 acknowledged after {answer.round_trip / 1_000_000:.3f} ms of bus time")
        await mother.send(11, "m-240000v120")

        for minute in range(1, 11):
            await asyncio.sleep(60)
            positions = ", ".join(
                f"node {node.address} {node.position_steps:+.0f}" for node in bus.snapshots()
            )
            print(f"{minute:2} min: {positions}")

        # The ramps have made it a little longer than ten minutes.
        await asyncio.sleep(1)
        ended = bus.snapshots()
        for node in ended:
            print(f"node {node.address} {node.state} at {node.position_steps:+.0f}")
        took = time.perf_counter() - begun
        print(f"{asyncio.get_running_loop().time():.1f} s of bus time in {took * 1_000:.0f} ms")
        return [node.position_steps for node in ended] == [240_000, -240_000]


def main(_argv: Sequence[str]) -> int:
    """Run it; status 0 when the motors stopped where they were sent."""
    return 0 if run_virtual(Kernel(), ten_minutes()) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
