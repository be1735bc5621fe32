"""An axis's share of a law: where it would be at which time if it were not made of steps.

Owns the ideal motion of one axis, in full steps and ticks, and its inverse. The share falls into
sweeps: in each the axis goes one way and never stands still, so that a place has one time.
Source: spec, mother ("Straight lines"): each axis is given its part of the way and of the velocity.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import inf, sqrt
from typing import Final

from sacbus.motion import TICKS_PER_US
from sacbus.toolpath.law import Law

__all__ = ["TICKS_PER_SECOND", "Part", "Sweep", "sweeps"]

TICKS_PER_SECOND: Final = TICKS_PER_US * 1_000_000


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a sweep at constant acceleration.

    begin, ticks: from when on, and how long. place, way: where it begins, and how far it goes, in
    full steps from the sweep's beginning, both never negative. v0, v1: full steps a tick.
    """

    begin: float
    ticks: float
    place: float
    way: float
    v0: float
    v1: float

    @property
    def end(self) -> float:
        """When it is over."""
        return self.begin + self.ticks

    @property
    def acceleration(self) -> float:
        """Full steps a tick, a tick."""
        return (self.v1 - self.v0) / self.ticks

    def time(self, place: float) -> float:
        """When it is at a place; outside it as if its last or first velocity went on."""
        gone = place - self.place
        if gone <= 0:
            return self.begin + (gone / self.v0 if self.v0 else 0.0)
        if gone >= self.way:
            return self.end + ((gone - self.way) / self.v1 if self.v1 else 0.0)
        twice = self.v0 + sqrt(max(0.0, self.v0**2 + 2 * self.acceleration * gone))
        return self.begin + (2 * gone / twice if twice else 0.0)

    def at(self, time: float) -> float:
        """Its place at a time; outside it as :meth:`time`."""
        gone = time - self.begin
        if gone <= 0:
            return self.place + gone * self.v0
        if gone >= self.ticks:
            return self.place + self.way + (gone - self.ticks) * self.v1
        return self.place + gone * (self.v0 + gone * self.acceleration / 2)


@dataclass(frozen=True, slots=True)
class Sweep:
    """The parts that an axis runs one after the other, one way, without standing still.

    forward: the way. steps: whole full steps, at least one. parts: one after the other.
    """

    forward: bool
    steps: int
    parts: tuple[Part, ...]
    _places: list[float] = field(init=False, repr=False, compare=False)
    _begins: list[float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        derive = object.__setattr__
        derive(self, "_places", [part.place for part in self.parts])
        derive(self, "_begins", [part.begin for part in self.parts])

    @property
    def end(self) -> float:
        """When it is over, in ticks."""
        return self.parts[-1].end

    def part(self, place: float) -> Part:
        """The part in which a place lies."""
        return self.parts[max(0, bisect_right(self._places, place) - 1)]

    def time(self, place: float) -> float:
        """When the axis is at a place, in ticks."""
        return self.part(place).time(place)

    def at(self, time: float) -> float:
        """Where the axis is at a time, in full steps."""
        return self.parts[max(0, bisect_right(self._begins, time) - 1)].at(time)

    def spread(self, place: float, until: float) -> float:
        """By how much the constant velocities between two places differ, in full steps a tick."""
        first = max(0, bisect_right(self._places, place) - 1)
        slowest, fastest = inf, 0.0
        for part in self.parts[first:]:
            if part.place >= until:
                break
            if part.v0 == part.v1:
                slowest, fastest = min(slowest, part.v0), max(fastest, part.v0)
        return max(0.0, fastest - slowest)

    def pace(self, place: float, until: float) -> tuple[float, float]:
        """The lowest and the highest velocity between two places, in full steps a tick."""
        first = max(0, bisect_right(self._places, place) - 1)
        slowest, fastest = inf, 0.0
        for part in self.parts[first:]:
            if part.place >= until:
                break
            slowest = min(slowest, part.v0, part.v1)
            fastest = max(fastest, part.v0, part.v1)
        return slowest, fastest

    def between(self, place: float, until: float) -> Iterator[float]:
        """Places strictly between two at which the motion changes, or is half-way to that."""
        first = max(0, bisect_right(self._places, place) - 1)
        for part in self.parts[first:]:
            if part.place >= until:
                return
            low, high = max(part.place, place), min(part.place + part.way, until)
            if low > place:
                yield low
            if part.v0 != part.v1:
                yield (3 * low + high) / 4
                yield (low + high) / 2


def sweeps(steps: Sequence[int], law: Law) -> tuple[Sweep, ...]:
    """The share of an axis that goes ``steps`` (signed full steps) in each segment of a block."""
    found: list[Sweep] = []
    parts: list[Part] = []
    # Whole steps of the sweep's segments before the present one: fractions are not added up.
    done = 0
    begin, segment = 0.0, -1
    for phase in law:
        count = steps[phase.segment]
        ticks = phase.seconds * TICKS_PER_SECOND
        if phase.segment != segment:
            before = steps[segment] if segment >= 0 else 0
            done += abs(before)
            if parts and before * count <= 0:
                found.append(Sweep(before > 0, done, tuple(parts)))
                parts = []
            if not parts:
                done = 0
            segment = phase.segment
        if count:
            way = abs(count) * (phase.end - phase.begin)
            # mm/s to full steps a tick, so that the way comes out exactly.
            mean = (phase.v0 + phase.v1) / 2
            scale = way / (mean * ticks)
            place = done + abs(count) * phase.begin
            parts.append(Part(begin, ticks, place, way, phase.v0 * scale, phase.v1 * scale))
        begin += ticks
    if parts:
        found.append(Sweep(steps[segment] > 0, done + abs(steps[segment]), tuple(parts)))
    return tuple(found)
