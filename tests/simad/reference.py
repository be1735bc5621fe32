"""SiMAD step by step, as slow and as obvious as can be; and the rules, looked for on every edge.

Shares nothing with the room under test but the numbers of a Timing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from sacbus.simad import Edges, Timing

#: When it is due, axis, +1 or -1.
Due = tuple[int, int, int]
#: When, which line, level: line 0 is DIR, line 1 + axis a step line.
Edge = tuple[int, int, int]


@dataclass
class Slow:
    """What comes of steps: when each falls, in the order given, and the edges."""

    falls: list[int]
    edges: list[Edge]
    direction: int
    turns: int = 0


@dataclass
class Line:
    """One DIR line while it is worked out."""

    direction: int
    stable_since: int | None = None
    falls_in_it: list[int] = field(default_factory=list)


def slow_encode(steps: Sequence[Due], timing: Timing) -> Slow:
    """Take one step after the other, each at the earliest instant that breaks no rule."""
    if not steps:
        return Slow([], [], 1)
    waiting = list(enumerate(steps))
    falls: dict[int, int] = {}
    last_fall: dict[int, int] = {}
    edges: list[Edge] = []
    first = min((axis for due, axis, _ in steps if due == steps[0][0]))
    line = Line(next(way for _, axis, way in steps if axis == first))
    begin = line.direction
    turns = 0
    while waiting:
        number, (due, axis, way) = next_of(waiting, line.direction)
        waiting.remove((number, (due, axis, way)))
        if way != line.direction:
            turn = max(fall + max(timing.low, timing.hold) for fall in line.falls_in_it)
            edges.append((turn, 0, 1 if way > 0 else 0))
            line = Line(way, turn)
            turns += 1
        fall = due
        if line.stable_since is not None:
            fall = max(fall, line.stable_since + timing.setup)
        if axis in last_fall:
            fall = max(fall, last_fall[axis] + timing.low + timing.high)
        falls[number] = last_fall[axis] = fall
        line.falls_in_it.append(fall)
        edges += [(fall, 1 + axis, 0), (fall + timing.low, 1 + axis, 1)]
    edges.sort(key=lambda edge: (edge[0], edge[1] or 999))
    return Slow([falls[number] for number in range(len(steps))], edges, max(begin, 0), turns)


def next_of(waiting: list[tuple[int, Due]], direction: int) -> tuple[int, Due]:
    """Of the steps due first, of each axis its first: one that DIR fits, then the first axis."""
    instant = waiting[0][1][0]
    heads: dict[int, tuple[int, Due]] = {}
    for number, step in waiting:
        if step[0] != instant:
            break
        heads.setdefault(step[1], (number, step))
    return min(heads.values(), key=lambda one: (one[1][2] != direction, one[1][1]))


def as_tuples(edges: Edges) -> list[Edge]:
    """The arrays as edges, one after the other."""
    return list(zip(edges.times.tolist(), edges.lines.tolist(), edges.levels.tolist(), strict=True))


def broken_rules(edges: Iterable[Edge], timing: Timing) -> list[str]:
    """Every rule of the lines that edges break, in words; all lines start high, DIR anyhow."""
    broken: list[str] = []
    level: dict[int, int] = {}
    since: dict[int, int] = {}
    last_fall: int | None = None
    low: set[int] = set()
    now = 0
    for when, line, to in edges:
        if when < now:
            broken.append(f"{when}: time runs backwards")
        now = when
        if to == level.get(line, 1 if line else None):
            broken.append(f"{when}: line {line} is {to} already")
        spent = when - since[line] if line in since else None
        if line == 0:
            if low:
                broken.append(f"{when}: DIR changes while {low} are low")
            if last_fall is not None and when - last_fall < timing.hold:
                broken.append(f"{when}: DIR held for {when - last_fall} ns")
        elif to == 0:
            if spent is not None and spent < timing.high:
                broken.append(f"{when}: line {line} was high for {spent} ns")
            if 0 in since and when - since[0] < timing.setup:
                broken.append(f"{when}: DIR was set for {when - since[0]} ns")
            last_fall = when
            low.add(line)
        else:
            if spent != timing.low:
                broken.append(f"{when}: line {line} was low for {spent} ns")
            low.discard(line)
        level[line], since[line] = to, when
    if low:
        broken.append(f"{low} stay low")
    return broken


def driven(edges: Iterable[Edge], direction: int) -> list[Due]:
    """What drivers make of edges: when, which axis, which way."""
    made = []
    for when, line, to in edges:
        if line == 0:
            direction = to
        elif to == 0:
            made.append((when, line - 1, 1 if direction else -1))
    return made
