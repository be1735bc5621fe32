"""Running scenarios: in virtual time, in real time over a pty, or on a line behind a link.

Owns what moves the clock of a play, and the order of opening and closing. The first is the same in
every run; the other two are as punctual as the machine.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AsyncExitStack, contextmanager, suppress
from io import BytesIO
from typing import Any, BinaryIO, Final

from sacbus.configuration import Configuration, check
from sacbus.daemon import open_bus
from sacbus.host import Standstill, run_virtual
from sacbus.hosted import HostedBus
from sacbus.kernel import SECOND, Kernel, LineRate, Ns
from sacbus.links import PtyLink, open_line
from sacbus.mother.loop import LoopClock
from sacbus.mother.mother import LINK_SLACK
from sacbus.scenario.bench import Bench, far_bench, hosted_bench, piped_bench
from sacbus.scenario.expectations import Straight, Together
from sacbus.scenario.play import Play
from sacbus.scenario.result import Result
from sacbus.scenario.rules import refuse
from sacbus.scenario.tape import Tape
from sacbus.scenario.values import Poll, Raw, Scenario, Send
from sacbus.trace import RecordingCutOff

__all__ = ["run", "run_on_link", "run_real"]

#: Bus time between two looks at whether somebody wants to end it: some ms of wall time at most.
SLICE: Final[Ns] = SECOND

#: Told of the bus time that a scenario has come to, now and then.
Progress = Callable[[Ns], None]


def run(
    scenario: Scenario, *, record: BinaryIO | None = None, progress: Progress | None = None
) -> Result:
    """Play a scenario in virtual time; ConfigError for one that cannot be played.

    ``record``: an empty file, open for reading and writing, that the recording goes to; it must
    stay open for as long as that is read. Without one, what expectations need is kept in memory.
    RecordingCutOff, at once, when it cannot be written on: the play is not gone on with.
    ``progress`` is called every :data:`SLICE` of bus time.
    """
    refuse(scenario)
    kernel = Kernel()
    return run_virtual(kernel, _virtually(scenario, kernel, record, progress))


async def _virtually(
    scenario: Scenario, kernel: Kernel, record: BinaryIO | None, progress: Progress | None
) -> Result:
    async with AsyncExitStack() as stack:
        hosted = await _host(stack, [_alone(bus) for bus in scenario.buses])
        benches = {one.configuration.name: hosted_bench(one) for one in hosted}
        play = Play(scenario, benches)
        stack.enter_context(_recorded(play, hosted, benches, record, _cut_off))
        play.when_over = _end
        with suppress(_Over):
            play.begin()
            # The kernel is run here, not by the loop's selector, which costs more than an event.
            while (when := kernel.next_at()) is not None:
                kernel.run_due(when + SLICE)
                if progress is not None:
                    progress(kernel.now)
                await asyncio.sleep(0)  # for Ctrl-C
            raise Standstill("nothing is due, and the scenario is not over")
        return play.result


class _Over(Exception):
    """Leaves the kernel at the very event with which a play is over."""


def _end() -> None:
    raise _Over


def _cut_off(fault: RecordingCutOff) -> None:
    """Leaves the kernel where the recording could not be written on."""
    raise fault


def run_real(
    scenario: Scenario,
    *,
    speed: float = 1.0,
    record: BinaryIO | None = None,
    progress: Progress | None = None,
) -> Result:
    """Play a scenario in real time, times ``speed``; mother is a program at a pty of each bus."""
    refuse(scenario)
    return asyncio.run(_really(scenario, speed, record, progress))


async def _really(
    scenario: Scenario, speed: float, record: BinaryIO | None, progress: Progress | None
) -> Result:
    async with AsyncExitStack() as stack:
        # Of several, one whose line is in use must not run ahead of another.
        paced = len(scenario.buses) > 1
        buses = [
            dataclasses.replace(bus, speed=speed, pace=bus.pace or paced) for bus in scenario.buses
        ]
        hosted = await _host(stack, buses)
        benches: dict[str, Bench] = {}
        for bus in hosted:
            pty = PtyLink(None, baud=bus.bus.rate.baud)
            bus.attach(pty)
            line = await stack.enter_async_context(open_line(pty.where, bus.bus.rate.baud))
            bench = piped_bench(bus, line, round(LINK_SLACK * speed))
            bench.look = round(bench.look * max(speed, 1.0))
            benches[bus.configuration.name] = bench
        play = Play(scenario, benches)
        over = _over(play)

        def cut_off(fault: RecordingCutOff) -> None:
            if not over.done():
                over.set_exception(fault)

        stack.enter_context(_recorded(play, hosted, benches, record, cut_off))
        first = hosted[0]
        first.host.arrive(play.begin)
        await _until(over, progress, first.now)
        return play.result


def run_on_link(scenario: Scenario, link: str, *, progress: Progress | None = None) -> Result:
    """Play a scenario with the nodes at the far end of a link: a serial port, a pty, a server.

    ConfigError, with nothing sent, for steps that take more than a line.
    """
    refuse(scenario, line_only=True)
    return asyncio.run(_far(scenario, link, progress))


async def _far(scenario: Scenario, link: str, progress: Progress | None) -> Result:
    (bus,) = scenario.buses
    protocol = check(bus)
    rate = LineRate(bus.baud or protocol.rate.baud, protocol.rate.bits)
    loop = asyncio.get_running_loop()
    async with open_line(link, rate.baud) as line:
        if rate.nine and any(isinstance(one.does, Send | Poll | Raw) for one in scenario.steps):
            line.check_marking()
        clock = LoopClock(loop)
        bench = far_bench(bus.name, clock, protocol, line, rate, LINK_SLACK)
        play = Play(scenario, {bus.name: bench})
        over = _over(play)
        play.begin()
        await _until(over, progress, lambda: clock.now)
        return play.result


@contextmanager
def _recorded(
    play: Play,
    hosted: Sequence[HostedBus],
    benches: Mapping[str, Bench],
    record: BinaryIO | None,
    cut_off: Callable[[RecordingCutOff], object],
) -> Iterator[None]:
    """Record for as long as it is played, if anybody asks for it."""
    if record is None:
        steps = play.result.scenario.steps
        if not any(isinstance(step.does, Together | Straight) for step in steps):
            yield
            return
        record = BytesIO()
    tape = Tape(hosted, record, cut_off)
    for bench in benches.values():
        bench.tape = tape
    try:
        yield
    finally:
        play.result.recording = tape.close()


def _over(play: Play) -> asyncio.Future[None]:
    """Done when the play is over; what goes wrong in an event of its clock comes out of it."""
    loop = asyncio.get_running_loop()
    over: asyncio.Future[None] = loop.create_future()

    def broken(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        fault = context.get("exception")
        if isinstance(fault, Exception) and not over.done():
            over.set_exception(fault)
        else:
            loop.default_exception_handler(context)

    loop.set_exception_handler(broken)

    def end() -> None:
        if not over.done():
            over.set_result(None)

    play.when_over = end
    return over


async def _until(
    over: asyncio.Future[None], progress: Progress | None, now: Callable[[], Ns]
) -> None:
    while progress is not None and not over.done():
        progress(now())
        await asyncio.wait([over], timeout=0.2)
    await over


async def _host(stack: AsyncExitStack, buses: list[Configuration]) -> list[HostedBus]:
    hosted: list[HostedBus] = []
    for one in buses:
        # One clock for all: a step on one of them may follow from what happens on another.
        beside = hosted[0] if hosted else None
        hosted.append(await stack.enter_async_context(open_bus(one, beside=beside)))
    for bus in hosted:
        await bus.booted()
    return hosted


def _alone(bus: Configuration) -> Configuration:
    """A bus in virtual time: nobody outside can keep up with it, so nobody is let in."""
    return dataclasses.replace(bus, links=(), terminals=False, speed=1.0)
