"""An arc, and the chords that stand for it.

Owns the geometry: from a radius to a centre, from two ends to an angle, and how many chords it
takes so that none parts from the arc by more than the tolerance. All in mm; angles in radians,
positive counterclockwise. Every chord's end is worked out from the arc itself, so nothing adds up.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Arc at Feed Rate"; manual, "SAC and G-code"
(arcs are a series of short, connected segments).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from sacbus.toolpath import Straight

__all__ = ["Arc", "Point", "angle_between", "centre_from_radius"]

Point = tuple[float, float]
"""In the plane of an arc, mm."""

QUARTER: Final = math.pi / 2
"""The most that a chord spans, however wide the tolerance: a circle never becomes a line."""

SAME: Final = 1e-9
"""mm by which two points may differ that were meant to be one: what is left of arithmetic."""


@dataclass(frozen=True, slots=True)
class Arc:
    """From ``start`` to ``to`` round ``centre``, in the plane of two axes; others go along evenly.

    plane: indices of the two axes. angle: how far it turns, up to a full circle, signed. tolerance:
    mm between a chord and the arc. feed, line: as of ``Straight``. Where the two ends are not at
    the same distance from the centre, as rounded figures are not, the distance changes evenly.
    """

    start: tuple[float, ...]
    to: tuple[float, ...]
    plane: tuple[int, int]
    centre: Point
    angle: float
    tolerance: float
    feed: float | None
    line: int

    @property
    def radii(self) -> Point:
        """How far it is from the centre, in mm, at the beginning and at the end."""
        first, second = self.plane
        begin, end = self.start, self.to
        return (
            math.dist((begin[first], begin[second]), self.centre),
            math.dist((end[first], end[second]), self.centre),
        )

    @property
    def length(self) -> float:
        """How long the arc is, in mm, the other axes included."""
        along = (sum(self.radii) / 2) * self.angle
        others = (
            end - begin
            for index, (begin, end) in enumerate(zip(self.start, self.to, strict=True))
            if index not in self.plane
        )
        return math.hypot(along, *others)

    @property
    def chords(self) -> int:
        """How many chords it takes, at least 1."""
        # The sagitta of a chord over an angle is 2 r sin²(angle / 4).
        share = min(1.0, self.tolerance / (2 * max(self.radii)))
        widest = min(QUARTER, 4 * math.asin(math.sqrt(share)))
        return max(1, math.ceil(abs(self.angle) / widest))

    def straights(self) -> Iterator[Straight]:
        """The chords, one after the other; the last one ends exactly at ``to``."""
        count, angle, centre = self.chords, self.angle, self.centre
        first, second = self.plane
        radius, last_radius = self.radii
        begin = math.atan2(self.start[second] - centre[1], self.start[first] - centre[0])
        change = last_radius - radius
        for chord in range(1, count):
            share = chord / count
            turned, reach = begin + angle * share, radius + change * share
            to = [
                start + (end - start) * share
                for start, end in zip(self.start, self.to, strict=True)
            ]
            to[first] = centre[0] + reach * math.cos(turned)
            to[second] = centre[1] + reach * math.sin(turned)
            yield Straight(tuple(to), self.feed, self.line)
        yield Straight(self.to, self.feed, self.line)


def angle_between(start: Point, end: Point, centre: Point, *, clockwise: bool) -> float:
    """How far it is from one point to another round a centre.

    A full circle if they are one, or lie in the same direction from the centre.
    """
    begin = math.atan2(start[1] - centre[1], start[0] - centre[0])
    turned = (math.atan2(end[1] - centre[1], end[0] - centre[0]) - begin) % math.tau
    # Either side of nothing is what arithmetic makes of it.
    if min(turned, math.tau - turned) * math.dist(start, centre) < SAME:
        return -math.tau if clockwise else math.tau
    return turned - math.tau if clockwise else turned


def centre_from_radius(
    start: Point, end: Point, radius: float, slack: float, *, clockwise: bool
) -> Point | None:
    """The centre of an arc whose radius is given; None if the ends are too far apart for it.

    A negative radius asks for the arc of more than half a circle. slack: mm by which the ends may
    be too far apart, as rounded figures are; the centre is halfway between them then.
    """
    apart = math.dist(start, end)
    if apart / 2 > abs(radius) + slack:
        return None
    height = math.sqrt(max(0.0, radius**2 - (apart / 2) ** 2))
    # The centre of what turns counterclockwise by less than half a circle is to the left.
    left = height if clockwise == (radius < 0) else -height
    along = ((end[0] - start[0]) / apart, (end[1] - start[1]) / apart)
    return (
        (start[0] + end[0]) / 2 - along[1] * left,
        (start[1] + end[1]) / 2 + along[0] * left,
    )
