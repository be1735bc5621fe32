"""A block made of stretches: how many of them, how fast, and by which commands.

Owns the fitting of a block: into the queues of its nodes, and into the time in which the line
carries its commands. Whatever does not fit is made shorter or slower and tried again with the
commands themselves, so nothing is believed about a block that was not seen in it.
Source: spec, mother ("G-code": "mother lowers the feed to what the line carries and reports it").
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final, NamedTuple

from sacbus.toolpath import lowered
from sacbus.toolpath.block import AxisRun, Block
from sacbus.toolpath.corner import Corner
from sacbus.toolpath.deviation import deviation_from
from sacbus.toolpath.follow import follow
from sacbus.toolpath.law import Law
from sacbus.toolpath.line import plan_line
from sacbus.toolpath.lookahead import has_room, law_of, worth_a_rest
from sacbus.toolpath.machine import Machine
from sacbus.toolpath.share import TICKS_PER_SECOND
from sacbus.toolpath.stretch import Stretch

__all__ = ["Origin", "block_of"]

PACKETS_MORE: Final = 2
"""Packets of a block besides its commands: the barrier behind it, and ``y``."""

SLOWER: Final = 0.98
"""A block that is still too fast for the line comes down by 2 % at least: it gets there."""

_ANY: Final = 1 << 30
"""More commands than any axis has."""


class Origin(NamedTuple):
    """Where a block begins: on the path, in mm, and rounded, in full steps of each axis."""

    point: tuple[float, ...]
    position: tuple[int, ...]

    def after(self, stretches: Sequence[Stretch]) -> Origin:
        """Where some stretches lead to."""
        position = tuple(
            sum(steps)
            for steps in zip(self.position, *(one.steps for one in stretches), strict=True)
        )
        return Origin(stretches[-1].way[-1], position)


def block_of(
    machine: Machine,
    origin: Origin,
    stretches: Sequence[Stretch],
    corners: Sequence[Corner],
    *,
    command_seconds: float,
    commands_max: int,
) -> tuple[int, Block]:
    """How many of the stretches, from the first on, make a block, and that block.

    corners: those between the stretches, one fewer.
    """
    count = _likely(stretches, commands_max)
    while True:
        part, bends = stretches[:count], corners[: count - 1]
        free = law_of(machine.axes, part, bends)
        fitting = _fitting(part, free, commands_max)
        if fitting < count:
            count = fitting
            continue
        held = worth_a_rest(part, free)
        if held is not None and count > 1:
            # It begins the next block, with a ramp of its own; or is one, if it is the first.
            count = held or 1
            continue
        if count == 1 and len(part[0].way) == 1 and has_room(part[0]):
            return 1, _line(machine, origin, part[0], free, command_seconds, commands_max)
        law, runs = _carried(machine, part, bends, free, command_seconds, commands_max)
        if count == 1 or max(len(run.motions) for run in runs) <= commands_max:
            why = lowered.largest(
                lowered.by_axes(machine, part),
                lowered.by_line(lowered.against(free, law), command_seconds),
            )
            return count, _block(machine, origin, part, law, runs, why)
        count = min(count - 1, _begun(law, runs, commands_max))


def _likely(stretches: Sequence[Stretch], commands_max: int) -> int:
    """How many stretches make no axis exceed its commands if it has one for each; 1 at least."""
    counts = [0] * len(stretches[0].steps)
    for i, stretch in enumerate(stretches):
        for axis, steps in enumerate(stretch.steps):
            if steps:
                counts[axis] += 1
                if counts[axis] > commands_max:
                    return i
    return len(stretches)


def _fitting(stretches: Sequence[Stretch], law: Law, commands_max: int) -> int:
    """How many stretches make no axis exceed its commands if each phase is one; 1 at least."""
    counts = [0] * len(stretches[0].steps)
    for phase in law:
        for axis, steps in enumerate(stretches[phase.segment].steps):
            if steps:
                counts[axis] += 1
                if counts[axis] > commands_max:
                    return max(1, phase.segment)
    return len(stretches)


def _begun(law: Law, runs: Sequence[AxisRun], commands_max: int) -> int:
    """How many stretches are over before an axis comes to a command too many; 1 at least."""
    late = min(run.starts[commands_max] for run in runs if len(run.motions) > commands_max)
    now = 0.0
    for phase in law:
        now += phase.seconds
        if now * TICKS_PER_SECOND > late:
            return max(1, phase.segment)
    return max(1, law[-1].segment)


def _carried(
    machine: Machine,
    stretches: Sequence[Stretch],
    corners: Sequence[Corner],
    law: Law,
    command_seconds: float,
    commands_max: int,
) -> tuple[Law, tuple[AxisRun, ...]]:
    """The law slowed down until the line carries its commands, and these.

    As soon as an axis has more commands than it may, the search ends with what there is.
    """
    commands = sum(1 for phase in law for steps in stretches[phase.segment].steps if steps)
    asked = (commands + PACKETS_MORE) * command_seconds
    cap = inf
    while True:
        if _seconds(law) < asked:
            cap = min(SLOWER * cap, _cap(stretches, law, asked))
            law = law_of(machine.axes, stretches, corners, cap)
            continue
        runs = _runs(machine, stretches, law, commands_max)
        needed, lasts = _carrying(runs, command_seconds), _duration(runs)
        if lasts >= needed or max(len(run.motions) for run in runs) > commands_max:
            return law, runs
        asked = max(asked / SLOWER, _seconds(law) * needed / lasts)


def _cap(stretches: Sequence[Stretch], law: Law, seconds: float) -> float:
    """The velocity that none of a law's phases may exceed for it to last so many s.

    What is slower stays as it is; a ramp counts with its mean.
    """
    parts = sorted(
        (
            ((phase.end - phase.begin) * stretches[phase.segment].length, phase.seconds)
            for phase in law
        ),
        key=lambda part: part[1] / part[0],
    )
    length, left = 0.0, seconds - _seconds(law)
    for i, (way, lasts) in enumerate(parts):
        length += way
        left += lasts
        if i + 1 == len(parts) or length / left >= parts[i + 1][0] / parts[i + 1][1]:
            break
    return length / left


def _seconds(law: Law) -> float:
    return sum(phase.seconds for phase in law)


def _runs(
    machine: Machine, stretches: Sequence[Stretch], law: Law, commands_max: int
) -> tuple[AxisRun, ...]:
    """The commands of the axes that move, as close to the law as may be.

    A block can be made shorter, so that they need not be less close for being too many; a single
    stretch cannot.
    """
    allowed = commands_max if len(stretches) == 1 else _ANY
    runs = []
    for index, axis in enumerate(machine.axes):
        steps = [stretch.steps[index] for stretch in stretches]
        run = follow(axis, index, steps, law, commands_max=allowed)
        if run is not None:
            runs.append(run)
    return tuple(runs)


def _carrying(runs: Sequence[AxisRun], command_seconds: float) -> float:
    """Ticks that the line takes to carry the commands of a block."""
    packets = sum(len(run.motions) for run in runs) + PACKETS_MORE
    return packets * command_seconds * TICKS_PER_SECOND


def _duration(runs: Sequence[AxisRun]) -> int:
    return max(run.end for run in runs)


def _line(
    machine: Machine,
    origin: Origin,
    stretch: Stretch,
    law: Law,
    command_seconds: float,
    commands_max: int,
) -> Block:
    """The block of one straight line with room for ramps.

    `plan_line` chooses velocity and acceleration so that they fit all axes, which no law can that
    is made for many stretches.
    """
    feed = min(stretch.feed, stretch.limit) * 60
    planned = free = plan_line(machine, stretch.steps, feed, commands_max=commands_max)
    while planned.duration < (needed := _carrying(planned.runs, command_seconds)):
        # What is too short for its feed takes twice as long on average as at its peak.
        peak = 2 * stretch.length / (planned.duration / TICKS_PER_SECOND)
        feed = min(feed, peak * 60) * min(SLOWER, planned.duration / needed)
        planned = plan_line(machine, stretch.steps, feed, commands_max=commands_max)
    why = lowered.largest(
        lowered.by_axes(machine, [stretch]),
        lowered.by_line(1 - free.duration / planned.duration, command_seconds),
    )
    return _block(machine, origin, [stretch], law, planned.runs, why)


def _block(
    machine: Machine,
    origin: Origin,
    stretches: Sequence[Stretch],
    law: Law,
    runs: tuple[AxisRun, ...],
    why: tuple[float, str],
) -> Block:
    """The block, with what is to be said about it."""

    def off(point: Sequence[float]) -> list[float]:
        """A point of the path in full steps from where the block begins."""
        return [
            mm * axis.steps_per_mm - steps
            for mm, axis, steps in zip(point, machine.axes, origin.position, strict=True)
        ]

    ways = [[off(point) for point in stretch.way] for stretch in stretches]
    return Block(
        runs,
        _duration(runs),
        deviation_from(machine, ways, law, runs, off(origin.point)),
        length=sum(stretch.length for stretch in stretches),
        asked=sum(stretch.length / stretch.feed for stretch in stretches),
        lines=(stretches[0].lines[0], stretches[-1].lines[1]),
        lowered=why[0],
        lowered_by=why[1],
    )
