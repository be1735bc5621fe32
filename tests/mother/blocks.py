"""Blocks made by hand: axes at constant velocities, whose times anyone can work out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sacbus.language import NO_RAMP, Defaults, Motion
from sacbus.toolpath import Axis, AxisRun, Block, Deviation, Machine

NO_DEVIATION = Deviation(0.0, 0.0)

#: (signed steps, cycle in us) of each command.
Commands = Sequence[tuple[int, int]]


def machine(*nodes: int) -> Machine:
    return Machine(
        tuple(Axis(name, node, 100.0) for name, node in zip("XYZABC", nodes, strict=False))
    )


def run(axis: int, commands: Commands) -> AxisRun:
    of = Defaults()
    motions, starts, at = [], [], 0
    for number, (steps, cycle_us) in enumerate(commands):
        motions.append(
            Motion(
                abs(steps),
                steps > 0,
                of.rpm_of(cycle_us),
                cycle_us,
                NO_RAMP,
                NO_RAMP,
                linear=True,
                sync=number == 0,
            )
        )
        starts.append(at)
        at += abs(steps) * cycle_us * 2
    loaded = (0, *starts[1:])
    total = sum(steps for steps, _ in commands)
    return AxisRun(axis, tuple(motions), tuple(starts), loaded, at, total)


def block(commands: dict[int, Commands], **fields: object) -> Block:
    runs = tuple(run(axis, of_axis) for axis, of_axis in sorted(commands.items()))
    duration = max((one.end for one in runs), default=0)
    return Block(runs, duration, NO_DEVIATION, 1.0, 1.0, **fields)  # type: ignore[arg-type]


def totals(blocks: Iterable[Block], axes: int) -> list[int]:
    sums = [0] * axes
    for one in blocks:
        for of_axis in one.runs:
            sums[of_axis.axis] += of_axis.steps
    return sums
