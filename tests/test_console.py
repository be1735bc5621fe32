"""A node's terminal for who hosts its bus: in virtual time, without a pty."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

import pytest

from sacbus import open_bus
from sacbus.console import KEPT, WAITING
from sacbus.daemon import Configuration
from sacbus.host import run_virtual
from sacbus.kernel import SECOND, Kernel, LineRate
from sacbus.language.queue_screen import QueueScreen
from sacbus.links import LinkError, MemoryLink

_T = TypeVar("_T")

#: What keys take on the way from a link to the port.
span = LineRate(38_400).span


def virtually(scene: Coroutine[Any, Any, _T]) -> _T:
    return run_virtual(Kernel(), scene)


def test_what_a_command_shows_can_be_read_at_once() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            console = bus.terminal(10)
            assert console.command("m400v120") == "m400v120\r\nSAC>"
            screen = QueueScreen.read(console.command("q"))
            assert screen is not None
            assert (screen.next_free, screen.rows[0].motion.steps) == (2, 400)
            assert console.read() == ""

    virtually(scene())


def test_a_command_that_is_typed_moves_the_motor_in_bus_time() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            bus.terminal(10).type("m400v120\r")
            await asyncio.sleep(10)
            assert bus.snapshot(10).position_steps == 400
            assert bus.snapshot(10).state == "STANDBY"
            assert bus.snapshot(11).position_steps == 0

    virtually(scene())


def test_what_another_node_says_is_waited_for_in_bus_time() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            there = bus.terminal(11)
            bus.terminal(10).type("11 hello\r")
            assert (await there.until("10:11> ")).endswith("10:11> ")
            assert bus.now() > span(len("xxx hello"))  # it took its time on the line
            await asyncio.sleep(0.01)  # a SAC is deaf while it handles a packet
            bus.terminal(10).type("11 again\r")
            assert await there.until("10:11> again") == "hello\r\nSAC>\r\n10:11> again"
            assert there.read() == "\r\nSAC>"

    virtually(scene())


def test_every_call_gives_the_same_console_and_nothing_before_the_first_is_kept() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            await bus.mother().send(11, " early")
            console = bus.terminal(11)
            assert console.read() == ""
            console.type("vd\r")
            assert bus.terminal(11) is console
            assert console.read().startswith("vd\r\n100 RPM")

    virtually(scene())


def test_what_nobody_reads_is_kept_only_in_part() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            console = bus.terminal(10)
            console.type("q\r" * 100)
            console.type("vd\r")
            shown = console.read()
            assert len(shown) == KEPT
            assert shown.endswith("vd\r\n100 RPM  cycle 3000\r\nSAC>")

    virtually(scene())


def test_a_node_that_is_not_there_has_no_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            with pytest.raises(
                KeyError, match=r"^no node 99 on bus, expected one of its own: 10, 11"
            ):
                bus.terminal(99)
            with pytest.raises(
                KeyError, match=r"^no node 99 on bus, expected one of its own: 10, 11"
            ):
                bus.attach_terminal(99, MemoryLink())
            monkeypatch.setattr("nodes.sac.node.SacNode.terminal", None)
            with pytest.raises(KeyError, match=r"^node 10 has no terminal port$"):
                bus.terminal(10)

    virtually(scene())


def test_keys_may_be_pressed_from_within_an_event_of_the_bus() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            console = bus.terminal(10)
            bus.host.arrive(console.type, "m3\r")
            assert await console.until("SAC>") == "m3\r\nSAC>"

    asyncio.run(scene())


# --------------------------------------------------------------------------- links


def test_a_program_on_a_link_is_echoed_each_key_when_a_line_would_have_brought_it() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            link = MemoryLink()
            bus.attach_terminal(10, link)
            shown: list[tuple[int, bytes]] = []
            program = link.client(lambda data: shown.append((bus.host.kernel.now, data)))
            program.write(b"m2\rm-3\r+")
            await asyncio.sleep(1)
            assert shown == [
                (span(3), b"m2\r\nSAC>"),
                (span(3) + span(2), b"m-"),
                (span(3) + 2 * span(2), b"3\r\nSAC>"),
                (span(3) + 2 * span(2) + span(1), b"+"),
            ]

    virtually(scene())


def test_program_and_console_are_shown_the_same() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            link = MemoryLink()
            bus.attach_terminal(10, link)
            program, console = link.client(), bus.terminal(10)
            program.write(b"m2\r")
            assert await console.until("SAC>") == "m2\r\nSAC>"
            console.type("vd\r")
            assert program.read() == b"m2\r\nSAC>" + console.read().encode()
            assert bus.terminals == {10: link}

    virtually(scene())


@pytest.mark.slow
def test_a_program_that_writes_without_end_is_held_and_nothing_is_lost() -> None:
    async def scene() -> None:
        async with open_bus() as bus:
            link = MemoryLink()
            bus.attach_terminal(10, link)
            shown = bytearray()
            program = link.client(shown.extend)
            written = 0
            for _ in range(200):
                written += program.write(b"m1v500\r" * 100) // 7
                assert bus.now() >= span(max(7 * written - 2 * WAITING, 0))
                await bus.mother().send(11, "v100")  # others have their turn meanwhile
            await asyncio.sleep(2)
            assert shown.count(b"m1v500\r\nSAC>") == written
            assert 200 < written < 20_000

    virtually(scene())


def test_a_program_is_held_while_too_many_of_its_keys_wait_and_let_go_at_half() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            link = MemoryLink()
            bus.attach_terminal(10, link)
            program = link.client(lambda _: None)
            assert program.write(b"\r") == 1  # on its way; all others wait behind it
            assert program.write(b"\r" * WAITING) == WAITING
            assert program.write(b"\r") == 1  # as many as may wait are no reason yet
            assert program.write(b"\r") == 0
            left = WAITING // 2 + 1  # to arrive until no more than half of them wait
            await asyncio.sleep(left * span(1) / SECOND - 1e-6)
            assert program.write(b"\r") == 0
            await asyncio.sleep(2e-6)
            assert program.write(b"\r") == 1

    virtually(scene())


def test_terminals_are_closed_with_their_bus() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            link = MemoryLink()
            bus.attach_terminal(10, link)
            program = link.client()
        with pytest.raises(LinkError, match="the line is closed"):
            program.write(b"m2\r")

    virtually(scene())
