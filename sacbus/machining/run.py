"""A part program run: on virtual nodes in virtual time, on a line, or only planned.

Owns what is opened for it and closed again, and what is known afterwards. All three go the same
way; the first two through the same stream.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import BinaryIO, Final

from sacbus.configuration import Configuration, NodeAt
from sacbus.daemon import open_bus
from sacbus.host import run_virtual
from sacbus.hosted import HostedBus
from sacbus.kernel import MS, Kernel, LineRate, Ns
from sacbus.machining.course import Course, Point
from sacbus.machining.trail import Trail
from sacbus.mother import Mother, Stream, Streamed
from sacbus.mother.pace import command_seconds, measured_command_seconds
from sacbus.node import Report
from sacbus.toolpath import Axis, Machine
from sacbus.trace import Recorder, RecordingCutOff

__all__ = ["Machined", "Told", "plan_only", "rehearse", "run_on_link"]

#: Different things that nodes report of which are kept.
MOST_REPORTS: Final = 20

#: Bus time from one look at the axes to the next, as long as all that was seen is kept.
LOOK: Final[Ns] = 5 * MS


@dataclass(frozen=True, slots=True)
class Told:
    """Who is told what on the way.

    progress: the line of the source that it has come to. halt: awaited for what the program tells
    somebody, and whether that waits. stopped: how far it came, when it is cancelled.
    """

    progress: Callable[[int], object]
    halt: Callable[[str, bool], Awaitable[object]]
    stopped: Callable[[Streamed], object]


@dataclass(slots=True)
class Machined:
    """What came of a program.

    streamed: None when it was only planned. reached: full steps, clockwise up, by the axes' places,
    as the nodes have it; None where they cannot be asked. done: the path they went, mm by axis.
    reports: what nodes had to say, and how often. cut_off: why the recording that was asked for is
    not whole.
    """

    command_seconds: float
    streamed: Streamed | None = None
    reached: tuple[float, ...] | None = None
    done: Trail[Point] | None = None
    reports: Mapping[str, int] = field(default_factory=dict)
    cut_off: RecordingCutOff | None = None


def plan_only(course: Course, *, baud: int, progress: Callable[[int], object]) -> Machined:
    """Plan it to its end; ``progress`` is told the line of the source it has come to."""
    seconds = command_seconds(LineRate(baud))
    for block in course.blocks(seconds):
        progress(block.lines[1])
    return Machined(seconds)


def rehearse(
    course: Course,
    told: Told,
    *,
    baud: int = 38_400,
    watch: bool = False,
    record: BinaryIO | None = None,
) -> Machined:
    """Run it on virtual nodes with the machine's settings, in virtual time.

    ``watch``: keep the path that the nodes went. ``record``: where a recording of the bus goes.
    Raises as :meth:`~sacbus.mother.Stream.run` does.
    """
    return run_virtual(Kernel(), _rehearsed(course, told, baud, watch, record))


async def _rehearsed(
    course: Course, told: Told, baud: int, watch: bool, record: BinaryIO | None
) -> Machined:
    machine = course.machine
    machined = Machined(command_seconds(LineRate(baud)))
    configuration = Configuration(nodes=tuple(map(_node, machine.axes)), baud=baud)
    async with open_bus(configuration) as bus:
        with ExitStack() as stack:
            recorder = None if record is None else stack.enter_context(Recorder(bus, record))
            await _on_bus(bus, course, told, machined, watch=watch)
        if recorder is not None:
            machined.cut_off = recorder.fault
    return machined


async def _on_bus(
    bus: HostedBus, course: Course, told: Told, machined: Machined, *, watch: bool
) -> None:
    reports: Counter[str] = Counter()

    def report(one: Report) -> None:
        if one.address is None:
            return  # of the bus, which the programs on it do not have
        text = f"node {one.address}: {one.text}"
        if text in reports or len(reports) < MOST_REPORTS:
            reports[text] += 1

    bus.bus.report_watchers.append(report)
    look = _Look(bus, course.machine) if watch else None
    await _stream(bus.mother(), course, told, machined)
    machined.reached = tuple(bus.snapshot(axis.node).position_steps for axis in course.machine.axes)
    machined.reports = reports
    if look is not None:
        machined.done = look.end()


def run_on_link(course: Course, told: Told, link: str, *, baud: int) -> Machined:
    """Run it on a line, with the nodes at its far end; LinkError when that cannot be opened."""
    return asyncio.run(_on_link(course, told, link, baud))


async def _on_link(course: Course, told: Told, link: str, baud: int) -> Machined:
    async with Mother.connect(link, baud=baud) as mother:
        nodes = [axis.node for axis in course.machine.axes]
        machined = Machined(await measured_command_seconds(mother, nodes))
        await _stream(mother, course, told, machined)
    return machined


async def _stream(mother: Mother, course: Course, told: Told, machined: Machined) -> None:
    stream = Stream(
        mother,
        course.machine,
        halt=told.halt,
        progress=lambda come: told.progress(come.lines[1]),
    )
    try:
        machined.streamed = await stream.run(course.blocks(machined.command_seconds))
    except asyncio.CancelledError:
        told.stopped(stream.streamed)
        raise


def _node(axis: Axis) -> NodeAt:
    drive = axis.drive
    settings = {
        "sprf": drive.sprf,
        "slow": drive.slow_rpm,
        "ustep": drive.ustep,
        "ihd": drive.ihd,
        "xclk": drive.xclk,
    }
    return NodeAt(axis.node, "sac", settings)


class _Look:
    """Looks where the axes are, often at first; half as often whenever what was seen is thinned."""

    def __init__(self, bus: HostedBus, machine: Machine) -> None:
        self._bus = bus
        self._nodes = [bus.bus.node(axis.node) for axis in machine.axes]
        self._mm = [(-1 if axis.inverted else 1) / axis.steps_per_mm for axis in machine.axes]
        self._trail: Trail[Point] = Trail()
        self._ended = False
        self._look()

    def end(self) -> Trail[Point]:
        """Look for the last time; what was seen."""
        self._see()
        self._ended = True
        return self._trail

    def _look(self) -> None:
        if not self._ended:
            self._see()
            kernel = self._bus.host.kernel
            kernel.at(kernel.now + LOOK * self._trail.stride, self._look)

    def _see(self) -> None:
        now = self._bus.host.kernel.now
        self._trail.add(
            tuple(
                node.snapshot(now).position_steps * mm
                for node, mm in zip(self._nodes, self._mm, strict=True)
            )
        )
