"""A piece: as much of a path as may be run in one straight line.

Owns the joining. Part programs come in far shorter pieces than a command is worth: where the points
between two of them lie within a fraction of a step of the line that leaves them out, they are left
out. Their nodes could not come any closer to them, and would stumble over the rounding of each.
Source: decision; spec, mother ("G-code": nearly collinear segments run seamlessly).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import dist, inf, isfinite
from typing import Final

from sacbus.toolpath.machine import Machine
from sacbus.toolpath.path import Dwell, Halt, PathItem, Straight

__all__ = ["Piece", "pieces"]

Point = tuple[float, ...]

JOINED_MAX: Final = 64
"""Straight items in a piece at most: what is held of a path, and looked at again, is bounded."""

_ON_THE_LINE: Final = 1e-3
"""Full steps by which a point may be off a line that it is said to be on."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A straight line from where the piece before ended.

    way: mm, the points that the path comes by, if that is not just along the line; the last is the
    end of it. length: mm along all of them. feed: mm/min; None: at the rapid rate. lines: first and
    last of the source.
    """

    way: tuple[Point, ...]
    length: float
    feed: float | None
    lines: tuple[int, int]


def pieces(
    items: Iterable[PathItem], machine: Machine, within_steps: float
) -> Iterator[Piece | Dwell | Halt]:
    """The items of a path, straight ones of one feed joined; a path begins at nought.

    within_steps: how far a point may be off the line that leaves it out, in full steps of each
    axis; below 0, none is left out. ValueError for a position without one finite figure for each
    axis, or a feed that is none.
    """
    scale = tuple(axis.steps_per_mm for axis in machine.axes)
    at: Point = (0.0,) * len(scale)
    draft = _Draft(at, scale, within_steps)
    for item in items:
        if not isinstance(item, Straight):
            yield from draft.pieces()
            draft = _Draft(at, scale, within_steps)
            yield item
            continue
        _check(item, len(scale))
        if not draft.takes(item):
            yield from draft.pieces()
            draft = _Draft(at, scale, within_steps)
            draft.takes(item)
        at = item.to
    yield from draft.pieces()


def _check(item: Straight, axes: int) -> None:
    if len(item.to) != axes or not all(map(isfinite, item.to)):
        raise ValueError(
            f"a position has one finite figure for each of {axes} axes, "
            f"line {item.line}, got {item.to}"
        )
    if item.feed is not None and not 0 < item.feed < inf:
        raise ValueError(f"a feed is some mm/min, line {item.line}, got {item.feed:g}")


class _Draft:
    """A piece that may become longer."""

    __slots__ = ("_begin", "_items", "_length", "_lines", "_off", "_scale", "_within")

    def __init__(self, begin: Point, scale: Point, within_steps: float) -> None:
        self._begin = begin
        self._scale = scale
        self._within = within_steps
        self._items: list[Straight] = []
        self._off: list[Point] = []  # the ends of the items in steps from the beginning
        self._length = 0.0

    def takes(self, item: Straight) -> bool:
        """Make it longer by an item if that leaves it straight; the first always does."""
        off = tuple(
            (to - begin) * scale
            for to, begin, scale in zip(item.to, self._begin, self._scale, strict=True)
        )
        items = self._items
        if items and not (
            items[-1].feed == item.feed
            and len(items) < JOINED_MAX
            and self._leaves_out(off, self._within)
        ):
            return False
        self._length += dist(items[-1].to if items else self._begin, item.to)
        items.append(item)
        self._off.append(off)
        return True

    def _leaves_out(self, end: Point, within: float) -> bool:
        """Whether all points so far lie, one behind the other, along the line to ``end``."""
        square = sum(one * one for one in end)
        if within < 0 or not square:
            return False
        last = 0.0
        for off in self._off:
            along = sum(one * other for one, other in zip(off, end, strict=True)) / square
            if not last <= along <= 1:
                return False
            for one, other in zip(off, end, strict=True):
                if abs(one - along * other) > within:
                    return False
            last = along
        return True

    def pieces(self) -> Iterator[Piece]:
        """The piece, if there is anything in it."""
        items = self._items
        if items:
            way = tuple(item.to for item in items)
            if len(way) > 1 and self._leaves_out(self._off.pop(), _ON_THE_LINE):
                way = way[-1:]
            yield Piece(way, self._length, items[0].feed, (items[0].line, items[-1].line))
