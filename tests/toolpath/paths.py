"""Machines and paths that the tests of several files plan, and a second opinion on their times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import cos, pi, sin

from hypothesis import strategies as st

from sacbus.plan import Plan
from sacbus.plan.entries import Entry
from sacbus.toolpath import (
    Axis,
    AxisRun,
    Block,
    Dwell,
    Halt,
    Machine,
    PathItem,
    Straight,
    plan_path,
)

COMMAND_SECONDS = 0.0105
"""A packet with its ACK and gap at 38 400 baud, roughly (spec, mother)."""


def machine(*scales: float, **figures: float) -> Machine:
    """Axes X, Y, Z, ... with so many steps a mm each."""
    axes = (Axis("XYZABC"[i], 10 + i, scale) for i, scale in enumerate(scales))
    return Machine(tuple(axes), **figures)


XYZ = machine(400, 400, 400, rapid=45, feed=30)


def planned(
    items: Iterable[PathItem],
    on: Machine = XYZ,
    *,
    command_seconds: float = 0.0,
    commands_max: int = 29,
    join_steps: float = 0.5,
) -> list[Block]:
    """All blocks of a path, on a line that carries whatever it is given unless told otherwise."""
    return list(
        plan_path(
            items,
            on,
            command_seconds=command_seconds,
            commands_max=commands_max,
            join_steps=join_steps,
        )
    )


def straights(points: Iterable[Sequence[float]], feed: float | None = 30.0) -> Iterator[Straight]:
    """A path through points, one a line of its source."""
    for line, point in enumerate(points, 1):
        yield Straight(tuple(point), feed, line)


def circle(radius: float, chords: int, turns: int = 1) -> Iterator[tuple[float, float, float]]:
    """Points of a circle in X and Y that begins at nought."""
    for i in range(1, chords * turns + 1):
        angle = 2 * pi * i / chords
        yield (radius * cos(angle) - radius, radius * sin(angle), 0.0)


def spiral(radius: float, chords: int, turns: int) -> Iterator[tuple[float, float, float]]:
    """Points of a spiral that comes up in Z as it goes out in X and Y."""
    for i in range(1, chords * turns + 1):
        angle, out = 2 * pi * i / chords, radius * i / (chords * turns)
        yield (out * cos(angle), out * sin(angle), out / 5)


def zigzag(count: int, width: float, step: float) -> Iterator[tuple[float, float, float]]:
    """Points of a line that turns round at each of them."""
    for i in range(1, count + 1):
        yield (width * (i % 2), step * i, 0.0)


_FIGURE = st.floats(-8, 8, allow_nan=False)
_POINT = st.tuples(_FIGURE, _FIGURE, _FIGURE)
_NEAR = st.tuples(*(st.floats(-0.05, 0.05) for _ in range(3)))
FEEDS = st.one_of(st.none(), st.floats(1, 400))


@st.composite
def wanderings(draw: st.DrawFn) -> list[PathItem]:
    """Paths of long and tiny straight items in any direction, with dwells and halts between."""
    items: list[PathItem] = []
    at = (0.0, 0.0, 0.0)
    for line in range(1, draw(st.integers(1, 12)) + 1):
        kind = draw(st.integers(0, 9))
        if kind == 0:
            items.append(Dwell(draw(st.integers(0, 192)) / 64, line))
        elif kind == 1:
            items.append(Halt("M1", line=line))
        else:
            if kind < 6:
                at = draw(_POINT)
            else:
                off = draw(_NEAR)
                at = (at[0] + off[0], at[1] + off[1], at[2] + off[2])
            items.append(Straight(at, draw(FEEDS), line))
    return items


def destination(items: Iterable[PathItem], on: Machine = XYZ) -> tuple[int, ...]:
    """Where a path ends, in full steps."""
    ends = [item.to for item in items if isinstance(item, Straight)]
    if not ends:
        return (0,) * len(on.axes)
    return tuple(round(mm * axis.steps_per_mm) for mm, axis in zip(ends[-1], on.axes, strict=True))


def moved(blocks: Iterable[Block], axes: int = 3) -> tuple[int, ...]:
    """What the commands of blocks add up to on each axis, in full steps of a positive way."""
    sums = [0] * axes
    for block in blocks:
        for run in block.runs:
            for motion in run.motions:
                assert motion.steps is not None
                sums[run.axis] += motion.steps if motion.cw else -motion.steps
    return tuple(sums)


def commanded(run: AxisRun, axis: Axis) -> tuple[list[int], int]:
    """When the commands of a run start and the last one ends, in ticks, by the calculator."""
    entries = [Entry("", "", motion) for motion in run.motions]
    found = list(Plan(entries, axis.drive))
    end = found[-1].end
    assert end is not None
    return [one.start for one in found], end
