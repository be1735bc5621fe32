"""RTS by hand, in virtual time: up before the first bit, down when the last has left."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.links.direction import PATIENCE, HandDirection

MS = 0.001


class Wire:
    """RTS as it moved, with times, and how many bytes the port says are unsent."""

    def __init__(self, byte_s: float = MS) -> None:
        loop = asyncio.get_running_loop()
        self.moves: list[tuple[int, float]] = []
        self.waiting: Callable[[], int] = lambda: 0
        self.direction = HandDirection(
            loop,
            byte_s,
            lambda level: self.moves.append((level, loop.time())),
            lambda: self.waiting(),  # noqa: PLW0108 (it is another one later on)
        )

    def say(self, count: int) -> None:
        self.direction.begin()
        self.direction.sent(count)


def after(moves: list[tuple[int, float]]) -> list[tuple[int, float]]:
    return [(level, round(time, 6)) for level, time in moves]


def test_rts_is_up_for_as_long_as_the_bytes_take() -> None:
    async def session() -> None:
        wire = Wire()
        wire.say(5)
        assert after(wire.moves) == [(1, 0)]
        await asyncio.sleep(1)
        assert after(wire.moves) == [(1, 0), (0, 0.005)]

    run_virtual(Kernel(), session())


def test_what_is_sent_meanwhile_follows_and_rts_stays_up() -> None:
    async def session() -> None:
        wire = Wire()
        wire.say(5)
        await asyncio.sleep(2 * MS)
        wire.say(5)
        await asyncio.sleep(1)
        assert after(wire.moves) == [(1, 0), (0, 0.010)]
        wire.say(3)
        await asyncio.sleep(1)
        assert after(wire.moves)[2:] == [(1, 1.002), (0, 1.005)]

    run_virtual(Kernel(), session())


def test_rts_waits_for_what_the_port_has_not_sent() -> None:
    async def session() -> None:
        wire = Wire()
        loop = asyncio.get_running_loop()
        wire.waiting = lambda: 2 if loop.time() < 0.008 else 0
        wire.say(5)
        await asyncio.sleep(1)
        assert after(wire.moves) == [(1, 0), (0, 0.009)]

    run_virtual(Kernel(), session())


def test_a_port_that_never_gets_rid_of_its_bytes_does_not_hold_the_line_for_ever() -> None:
    async def session() -> None:
        wire = Wire()
        wire.waiting = lambda: 1
        wire.say(5)
        await asyncio.sleep(10)
        assert [level for level, _ in wire.moves] == [1, 0]
        assert wire.moves[1][1] == pytest.approx(PATIENCE, abs=0.01)

    run_virtual(Kernel(), session())


def test_an_end_lets_rts_fall_at_once_and_only_once() -> None:
    async def session() -> None:
        wire = Wire()
        wire.direction.end()
        assert wire.moves == []
        wire.say(5)
        wire.direction.end()
        wire.direction.end()
        await asyncio.sleep(1)
        assert after(wire.moves) == [(1, 0), (0, 0)]

    run_virtual(Kernel(), session())
