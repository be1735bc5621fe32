"""Work beside the line: on a loop in virtual time every microsecond of it can be accounted for.

The wall clock is a kernel of its own, which only the work itself and the loop's sleep move.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from sacbus.host import RealHost, VirtualHost, run_virtual
from sacbus.kernel import MS, SECOND, US, Kernel, Ns
from sacbus.spare import CLEAR, PATIENCE, SLICE, Job, at_once, in_spare_time

PIECE = 20 * US
#: What is late by no more than this is late by nothing: a timer's rounding.
NOTHING = 2


def beside(wall: Kernel, main: Callable[[asyncio.AbstractEventLoop], Awaitable[None]]) -> None:
    async def run() -> None:
        await main(asyncio.get_running_loop())

    run_virtual(wall, run())


def work(wall: Kernel, pieces: int) -> Job[str]:
    """So many pieces of work, each of which takes its time."""
    for _ in range(pieces):
        wall.run_until(wall.now + PIECE)
        yield
    return "made"


def busy_line(kernel: Kernel, every: Ns) -> None:
    """An event every so often, for ever."""

    def event() -> None:
        kernel.at(kernel.now + every, event)

    kernel.at(every, event)


def test_a_job_gives_what_it_has_made() -> None:
    wall = Kernel()

    async def main(_loop: asyncio.AbstractEventLoop) -> None:
        assert await in_spare_time(work(wall, 100), [VirtualHost(wall)]) == "made"
        assert await in_spare_time(work(wall, 0), [VirtualHost(wall)]) == "made"
        assert wall.now == 100 * PIECE

    beside(wall, main)


def test_at_once_it_does_so_too() -> None:
    wall = Kernel()
    assert at_once(work(wall, 100)) == "made"
    assert at_once(work(wall, 0)) == "made"


def test_what_a_job_raises_comes_out() -> None:
    def fails() -> Job[None]:
        yield
        raise ZeroDivisionError

    async def main(_loop: asyncio.AbstractEventLoop) -> None:
        with pytest.raises(ZeroDivisionError):
            await in_spare_time(fails(), [VirtualHost(wall)])

    wall = Kernel()
    beside(wall, main)
    with pytest.raises(ZeroDivisionError):
        at_once(fails())


@pytest.mark.parametrize("every", [1 * MS, 1_300 * US, 700 * US])
def test_no_event_is_late_for_a_job(every: Ns) -> None:
    wall, kernel = Kernel(), Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        busy_line(kernel, every)
        host = RealHost(kernel, loop)
        assert await in_spare_time(work(wall, 500), [host]) == "made"
        host.close()
        assert host.lateness.count >= 500 * PIECE // every
        assert host.lateness.worst <= NOTHING

    beside(wall, main)


def test_a_job_gives_way_to_every_host() -> None:
    wall = Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        hosts = []
        for number in range(3):
            kernel = Kernel()
            busy_line(kernel, (4 + number) * MS)
            hosts.append(RealHost(kernel, loop))
        assert await in_spare_time(work(wall, 1_000), hosts) == "made"
        for host in hosts:
            host.close()
            assert host.lateness.count >= 3
            assert host.lateness.worst <= NOTHING

    beside(wall, main)


def test_whoever_waits_in_the_loop_waits_for_a_slice_at_most() -> None:
    wall = Kernel()
    late: list[float] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        def wait() -> None:
            due = loop.time() + 0.000_07
            waiting.append(loop.call_at(due, happen, due))

        def happen(due: float) -> None:
            late.append(loop.time() - due)
            wait()

        waiting: list[asyncio.TimerHandle] = []
        wait()
        await in_spare_time(work(wall, 500), [VirtualHost(wall)])
        waiting[-1].cancel()

    beside(wall, main)
    assert len(late) > 50
    assert max(late) <= SLICE + PIECE / SECOND


def test_on_a_line_that_is_never_idle_for_long_a_job_is_done_all_the_same() -> None:
    wall, kernel = Kernel(), Kernel()
    every = 200 * US
    assert every / SECOND < CLEAR

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        busy_line(kernel, every)
        host = RealHost(kernel, loop)
        assert await in_spare_time(work(wall, 50), [host]) == "made"
        host.close()
        assert PATIENCE <= wall.now / SECOND <= PATIENCE + 0.002
        # Even so it takes turns with the line.
        assert host.lateness.worst <= SLICE * SECOND + PIECE + NOTHING

    beside(wall, main)


def test_a_line_on_which_nothing_is_due_is_waited_for_by_nobody() -> None:
    wall, kernel = Kernel(), Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(kernel, loop)
        await in_spare_time(work(wall, 50), [host])
        assert wall.now == 50 * PIECE
        kernel.at(wall.now, lambda: None)
        host.close()  # what is due on a line that is closed never comes
        await in_spare_time(work(wall, 50), [host])
        assert wall.now == 100 * PIECE

    beside(wall, main)
