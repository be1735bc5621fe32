"""A stretch: a straight piece of a path in full steps, with what its axes can bear along it.

Owns the rounding of positions and the limits of one stretch. Every position is rounded from the
origin, never from the one before, so no error adds up. A piece that moves no axis by a step is
taken into the next.
Source: spec, mother ("Straight lines": velocities and accelerations shared out by the ways of the
axes; "G-code": the operator gives the major axis's acceleration, each axis has its limits).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf, pi

from sacbus.toolpath.line import top_speed
from sacbus.toolpath.machine import Axis, Machine
from sacbus.toolpath.path import Dwell, Halt
from sacbus.toolpath.piece import Piece

__all__ = ["Stretch", "jump_of", "stretches", "top_rpm"]


@dataclass(frozen=True, slots=True)
class Stretch:
    """A straight piece from one rounded position to another; at least one axis moves.

    steps: signed full steps of each axis. way: mm, where the path comes by, without rounding: the
    end, and before it the ends of the pieces that were taken in. length: mm of the way. feed: mm/s
    asked for; rapid: nobody asked for one. rates: RPM of each axis, signed, for each mm/s along the
    path. limit: mm/s at which the first axis comes to its highest speed. start: mm/s to which all
    axes may jump from rest. acceleration: mm/s2. lines: first and last of the source.
    """

    steps: tuple[int, ...]
    way: tuple[tuple[float, ...], ...]
    length: float
    feed: float
    rapid: bool
    rates: tuple[float, ...]
    limit: float
    start: float
    acceleration: float
    lines: tuple[int, int]

    @property
    def most_steps(self) -> int:
        """Steps of the axis that takes most of them."""
        return max(map(abs, self.steps))


def stretches(
    pieces: Iterable[Piece | Dwell | Halt], machine: Machine
) -> Iterator[Stretch | Dwell | Halt]:
    """The pieces of a path as stretches; a path begins at nought on every axis."""
    position = (0,) * len(machine.axes)
    before: Piece | None = None
    for piece in pieces:
        if not isinstance(piece, Piece):
            yield piece
            continue
        way, length, lines = piece.way, piece.length, piece.lines
        if before is not None:
            # Of what moved nothing, where it led to is all that is kept.
            way = (before.way[-1], *way)
            length += before.length
            lines = (before.lines[0], lines[1])
        there = tuple(
            round(mm * axis.steps_per_mm) for mm, axis in zip(way[-1], machine.axes, strict=True)
        )
        if there == position:
            before = Piece(way[-1:], length, piece.feed, lines)
            continue
        steps = tuple(new - old for new, old in zip(there, position, strict=True))
        yield _stretch(machine, steps, Piece(way, length, piece.feed, lines))
        position, before = there, None


def _stretch(
    machine: Machine,
    steps: tuple[int, ...],
    piece: Piece,
) -> Stretch:
    """A stretch and its limits; its length is that of the way, not of the rounded one.

    So the tool keeps to the feed however short the pieces of a path are.
    """
    length = piece.length
    rates: list[float] = []
    limit = start = inf
    most = max(map(abs, steps))
    acceleration = inf
    for axis, count in zip(machine.axes, steps, strict=True):
        turns = count / (axis.drive.steps_per_rev * length)
        rates.append(60 * turns)
        if not count:
            continue
        rate = 60 * abs(turns)
        limit = min(limit, top_rpm(axis) / rate)
        start = min(start, jump_of(axis) / rate)
        allowed = axis.max_acceleration
        if allowed is None or abs(count) == most:
            allowed = min(machine.acceleration, allowed or inf)
        acceleration = min(acceleration, allowed / (2 * pi * abs(turns)))
    asked = machine.rapid if piece.feed is None else piece.feed
    return Stretch(
        steps,
        piece.way,
        length,
        asked / 60,
        piece.feed is None,
        tuple(rates),
        limit,
        start,
        acceleration,
        piece.lines,
    )


def jump_of(axis: Axis) -> float:
    """RPM that an axis may change by at once; 1 where it is said to bear none, to get it going."""
    return max(axis.jump, 1)


def top_rpm(axis: Axis) -> float:
    """RPM that an axis is run at most: its own limit, or that of its pulses."""
    return top_speed(axis) * 60 / axis.drive.steps_per_rev
