"""A stretch at one velocity, as one command or several that run seamlessly.

Owns how a stretch of some full steps is made to take a given time, although a cycle is a whole
number of us and a pulse a whole number of ticks: its steps are shared out between two neighbouring
cycles, in turns, so that the motor is never far from where an even motion would have it.
Source: spec, mother ("Straight lines": a cruise split at cycles c and c+1).
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

from sacbus.motion import TICKS_PER_US, Drive
from sacbus.motion.gears import cruise_weight

__all__ = ["Even", "cycle_least", "split", "step_ticks"]


class Even(NamedTuple):
    """So many full steps at a cycle, in us."""

    steps: int
    cycle_us: int


def step_ticks(drive: Drive, cycle_us: int) -> int:
    """Real ticks of a full step at a cycle."""
    weight = cruise_weight(drive, cycle_us) if drive.auto_micro else 1
    return drive.m // weight * drive.cruise_period(cycle_us, weight)


def cycle_least(drive: Drive, rpm: float) -> int:
    """The shortest cycle, in us, that is not faster than an RPM."""
    return ceil(60_000_000 / drive.steps_per_rev / rpm)


def split(drive: Drive, steps: int, ticks: float, least_us: int, apart: float) -> list[Even]:
    """So many full steps in so many ticks, at no cycle below ``least_us``.

    apart: full steps by which the motor may be off on the way, at most, if that can be had: of an
    even motion between the two ends. The end itself is off by half a unit of one step's time.
    """
    short, long = _neighbours(drive, ticks / steps, least_us)
    quick, slow = step_ticks(drive, short), step_ticks(drive, long)
    near = apart / 2 * ticks / steps
    if slow == quick or ticks - steps * quick <= near:
        return [Even(steps, short)]
    if steps * slow - ticks <= near:
        return [Even(steps, long)]
    longer = min(max(round((ticks - steps * quick) / (slow - quick)), 0), steps)
    shorter = steps - longer
    if not longer or not shorter:
        return [Even(steps, long if longer else short)]
    # How far off it would be where one cycle simply followed the other.
    off = shorter * longer / steps * (slow - quick) * steps / ticks
    if off <= apart:
        return [Even(shorter, short), Even(longer, long)]
    # In turns, beginning and ending with half a turn, the motor is off to both sides alike.
    turns = min(ceil(off / apart / 2), shorter, longer)
    even: list[Even] = []
    for turn in range(turns + 1):
        outer = _part(shorter, 2 * turn - 1, 2 * turn + 1, 2 * turns)
        if outer:
            even.append(Even(outer, short))
        inner = _part(longer, turn, turn + 1, turns)
        if inner:
            even.append(Even(inner, long))
    return even


def _part(whole: int, since: int, until: int, of: int) -> int:
    """What falls between two marks when a whole number is laid out along ``of`` of them."""
    low, high = max(0, since), min(of, until)
    return whole * high // of - whole * low // of if high > low else 0


def _neighbours(drive: Drive, per_step: float, least_us: int) -> tuple[int, int]:
    """The two cycles next to each other between which a step of so many ticks lies."""
    weight = 1
    if drive.auto_micro:
        weight = cruise_weight(drive, max(1, round(per_step / TICKS_PER_US)))
    pulse = per_step * weight / drive.m - drive.offset
    # Without microsteps a cycle of c us lasts 2 c ticks; with them every period can be had.
    unit = drive.m // weight
    if unit == 1:
        short = max(1, int(pulse // TICKS_PER_US))
        long = short + 1
    else:
        period = max(1, int(pulse // 1))
        short = ceil(period * unit / TICKS_PER_US)
        long = ceil((period + 1) * unit / TICKS_PER_US)
    return max(short, least_us), max(long, least_us)
