"""A straight line from rest to rest, all axes together.

Owns the law of a single line: how fast its axes allow it to be run, and a velocity and an
acceleration close below that at which what they are given, whole us and hundredths of a rad/s2,
fits as well as may be. The rest of the work is `follow`'s.
Source: manual, "SAC in a multi-axis environment"; spec, mother ("Straight lines").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, pi, sqrt
from typing import Final, NamedTuple

from sacbus.toolpath.block import Block
from sacbus.toolpath.climb import leaning
from sacbus.toolpath.deviation import deviation
from sacbus.toolpath.follow import COMMANDS_MAX, follow
from sacbus.toolpath.law import Law, Phase
from sacbus.toolpath.machine import MOST_STEPS, Axis, Machine
from sacbus.toolpath.share import TICKS_PER_SECOND

__all__ = ["CRUISE", "LINEAR_PERIOD", "line_law", "plan_line", "top_speed"]

LINEAR_PERIOD: Final = 104
"""Ticks of the shortest pulse of a ramp: 52 us to compute it (manual, "Discussion"), which is more
than the 40 us in which the next command must be loaded to keep the velocity."""

#: Part of a line that is run at constant velocity, at least. A triangle would be 0.6 % quicker, but
#: ramps that are not exact need a stretch in which to meet.
CRUISE: Final = 0.2

#: Parts by which velocity and acceleration may be lowered to fit better.
_SLOWER: Final = 0.03
_GENTLER: Final = 0.1

#: Parts of the acceleration at which a line is planned anew if it is more than a step off.
_GENTLER_STILL: Final = (0.93, 0.86, 0.8)

#: What a line that takes 1 % longer is worth, in commands; what one at 1 % less acceleration is, in
#: full steps by which a ramp is off.
_COMMANDS_A_PERCENT: Final = 2.0
_STEPS_A_PERCENT: Final = 0.02

#: Full steps of a cruise that a command more takes care of (see cruise.py).
_STEPS_A_COMMAND: Final = 0.12


class _Mover(NamedTuple):
    """An axis that moves: its full steps on the line, and how many they are a mm of the line.

    place: of the axis in its machine. limit: rad/s2 that it is never asked to exceed.
    """

    place: int
    axis: Axis
    steps: int
    per_mm: float
    limit: float

    @property
    def per_rad(self) -> float:
        """Full steps a radian."""
        return self.axis.drive.steps_per_rev / (2 * pi)

    def step_ticks(self, speed: float) -> float:
        """Ticks of a full step at a velocity along the line, in mm/s."""
        return TICKS_PER_SECOND / (speed * self.per_mm)


def top_speed(axis: Axis) -> float:
    """Full steps a second that an axis makes at most: by its RPM, and by the pulses of a ramp."""
    drive = axis.drive
    by_pulses = TICKS_PER_SECOND / (LINEAR_PERIOD * drive.m)
    return min(axis.max_rpm * drive.steps_per_rev / 60, by_pulses)


def plan_line(
    machine: Machine,
    steps: Sequence[int],
    feed: float | None,
    line: int = 0,
    *,
    commands_max: int = COMMANDS_MAX,
) -> Block:
    """The block of a straight line from rest to rest.

    steps: signed full steps of every axis of the machine, not all 0. feed: mm/min along the line;
    None: at the rapid rate. line: of its source. commands_max: of an axis, 3 at least. ValueError
    where nothing moves, and for what is no such line. The work is in proportion to the steps: every
    pulse is looked at, some two million a second.
    """
    _check(machine, steps, feed)
    movers, length = _movers(machine, steps)
    asked = (machine.rapid if feed is None else feed) / 60
    acceleration = _acceleration(movers, length, asked)
    best = _plan(machine, steps, movers, length, asked, acceleration, commands_max)
    for gentler in _GENTLER_STILL:
        if best.deviation.steps <= 1:
            break
        # What does not fit at one acceleration may fit at another.
        gently = acceleration * gentler
        again = _plan(machine, steps, movers, length, asked, gently, commands_max)
        best = min(best, again, key=lambda block: block.deviation.steps)
    return replace(best, lines=(line, line))


def _check(machine: Machine, steps: Sequence[object], feed: float | None) -> None:
    """Refuse what is no line of this machine."""
    if len(steps) != len(machine.axes):
        raise ValueError(
            f"steps of a line: expected {len(machine.axes)}, one for each axis, got {len(steps)}"
        )
    for axis, one in zip(machine.axes, steps, strict=True):
        if not isinstance(one, int) or abs(one) > MOST_STEPS:
            raise ValueError(
                f"steps of {axis.name}: expected a whole number up to {MOST_STEPS}, got {one!r}"
            )
    if feed is not None and not feed > 0:
        raise ValueError(f"feed of a line: expected mm/min above 0, got {feed}")


def _plan(
    machine: Machine,
    steps: Sequence[int],
    movers: list[_Mover],
    length: float,
    asked: float,
    acceleration: float,
    commands_max: int,
) -> Block:
    speed, why = _speed(movers, length, asked, acceleration)
    speed = _fitting_speed(movers, length, speed, acceleration)
    acceleration = _fitting_acceleration(movers, length, speed, acceleration)
    law = line_law(length, speed, acceleration)
    found = (
        follow(
            one.axis,
            one.place,
            [steps[one.place]],
            law,
            acceleration=one.limit,
            commands_max=commands_max,
        )
        for one in movers
    )
    runs = tuple(run for run in found if run is not None)
    lowered = max(0.0, 1 - speed / asked)
    return Block(
        runs,
        max(run.end for run in runs),
        deviation(machine, [steps], law, runs),
        length,
        length / asked,
        lowered=lowered,
        lowered_by=(why or "a cycle is a whole number of us") if lowered else "",
    )


def line_law(length: float, speed: float, acceleration: float) -> Law:
    """From rest to a speed in mm/s and back to rest, at an acceleration in mm/s2; mm."""
    ramp = speed / acceleration
    part = speed * ramp / 2 / length
    return (
        Phase(0, 0.0, part, ramp, 0.0, speed),
        Phase(0, part, 1 - part, (1 - 2 * part) * length / speed, speed, speed),
        Phase(0, 1 - part, 1.0, ramp, speed, 0.0),
    )


def _movers(machine: Machine, steps: Sequence[int]) -> tuple[list[_Mover], float]:
    """The axes that move, and the length of the line in mm."""
    if not any(steps):
        raise ValueError("a line needs an axis that moves, got no steps for any")
    pairs = list(zip(machine.axes, steps, strict=True))
    length = sqrt(sum((count / axis.steps_per_mm) ** 2 for axis, count in pairs))
    # The operator gives the major axis's acceleration; the others' follow from it.
    most = max(map(abs, steps))
    movers = []
    for place, (axis, count) in enumerate(pairs):
        if count:
            limit = axis.max_acceleration or machine.acceleration
            if abs(count) == most:
                limit = min(limit, machine.acceleration)
            movers.append(_Mover(place, axis, abs(count), abs(count) / length, limit))
    return movers, length


def _acceleration(movers: list[_Mover], length: float, asked: float) -> float:
    """mm/s2 along the line that every axis bears, and its ramp, which leans a little."""
    acceleration = min(mover.limit * mover.per_rad / mover.per_mm for mover in movers)
    speed, _ = _speed(movers, length, asked, acceleration)
    leans = [max(0.0, _leaning(mover, speed, acceleration)) for mover in movers]
    return min(
        mover.limit * mover.per_rad / mover.per_mm / (1 + lean)
        for mover, lean in zip(movers, leans, strict=True)
    )


def _leaning(mover: _Mover, speed: float, acceleration: float, *, down: bool = False) -> float:
    """By which part an axis's own acceleration is better than its share (see climb.py)."""
    drive = mover.axis.drive
    pulses = speed**2 / acceleration / 2 * mover.per_mm * drive.m
    return leaning(drive, pulses, mover.step_ticks(speed) / drive.m, down=down)


def _speed(
    movers: list[_Mover], length: float, asked: float, acceleration: float
) -> tuple[float, str]:
    """mm/s along the line, and what keeps it from being as fast as was asked."""
    slowest = min(movers, key=lambda mover: top_speed(mover.axis) / mover.per_mm)
    bounds = [
        (asked, ""),
        (
            top_speed(slowest.axis) / slowest.per_mm,
            f"{slowest.axis.name} makes {top_speed(slowest.axis):.0f} steps/s at most",
        ),
        (
            sqrt((1 - CRUISE) * acceleration * length),
            "the line is too short for its acceleration",
        ),
    ]
    return min(bounds, key=lambda bound: bound[0])


def _fitting_speed(movers: list[_Mover], length: float, speed: float, acceleration: float) -> float:
    """A velocity a little below at which the axes' periods are nearly whole."""
    cruise = 1 - speed**2 / acceleration / length

    def commands(tried: float) -> float:
        """Commands that all cruises take, and what going slower counts as."""
        taken = 0.0
        for mover in movers:
            drive = mover.axis.drive
            ticks, unit = mover.step_ticks(tried), _unit(mover)
            part = (ticks / unit - drive.offset * drive.m / unit) % 1
            off = mover.steps * cruise * part * (1 - part) * unit / ticks
            taken += off / _STEPS_A_COMMAND
        return taken + (1 - tried / speed) * 100 * _COMMANDS_A_PERCENT

    worth = [speed]
    for mover in movers:
        ticks, unit = mover.step_ticks(speed), _unit(mover)
        added = mover.axis.drive.offset * mover.axis.drive.m
        whole = ceil((ticks - added) / unit - 1e-9) * unit + added
        while whole <= ticks * (1 + _SLOWER) and len(worth) < 40:
            worth.append(TICKS_PER_SECOND / (whole * mover.per_mm))
            whole += unit
    return min(worth, key=commands)


def _unit(mover: _Mover) -> int:
    """Ticks by which a full step can be made longer: a us, or a tick a pulse."""
    m = mover.axis.drive.m
    return 2 if m == 1 else m


def _fitting_acceleration(
    movers: list[_Mover], length: float, speed: float, acceleration: float
) -> float:
    """An acceleration a little below at which those of all axes are nearly whole hundredths."""
    ramps: list[tuple[float, float]] = []
    gentlest = max(1 - _GENTLER, speed**2 / acceleration / length / (1 - CRUISE / 2))
    for mover in movers:
        drive = mover.axis.drive
        velocity = speed * mover.per_mm
        if velocity * 60 / drive.steps_per_rev < drive.slow + 1:
            continue
        steps = speed**2 / acceleration / 2 * mover.per_mm
        hundredths = acceleration * mover.per_mm / mover.per_rad * 100
        for down in (False, True):
            lean = _leaning(mover, speed, acceleration, down=down)
            ramps.append((hundredths * (1 + lean), steps))

    def off(tried: float) -> float:
        """Full steps by which the worst ramp is off, and what being gentler counts as."""
        found = (abs(a * tried - round(a * tried)) / (a * tried) * n / 4 for a, n in ramps)
        return max(found) + (1 - tried) * 100 * _STEPS_A_PERCENT

    worth = [1.0]
    for hundredths, _ in ramps:
        # The nearest ones below that the device can be told.
        whole = int(hundredths)
        while len(worth) < 60 and whole > 0 and whole / hundredths >= gentlest:
            worth.append(whole / hundredths)
            whole -= 1
    return acceleration * (min(worth, key=off) if ramps else 1.0)
