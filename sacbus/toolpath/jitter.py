"""How evenly the minor axis's pulses come: on a clock of its own, and by Bresenham's algorithm.

Owns the algorithm as other controllers use it, and the measure of both: at constant velocity, where
all periods should be the same.
Source: manual, "SAC in a multi-axis environment", Figures 1 and 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sacbus.toolpath.block import Block
from sacbus.toolpath.machine import Machine
from sacbus.toolpath.pulses import Pulses

__all__ = ["Jitter", "SideBySide", "bresenham", "side_by_side"]

#: Part of a line about its middle that is looked at: `plan_line` runs it at constant velocity.
_MIDDLE: Final = 0.2

#: Pulses of the minor axis in it without which nothing can be said.
_FEWEST: Final = 4


class Jitter(NamedTuple):
    """How uneven periods are, as parts of their mean: standard deviation, and the largest."""

    std: float
    most: float

    @classmethod
    def of(cls, times: Sequence[int] | NDArray[np.int64]) -> Jitter:
        """That of pulses at some times, three at least."""
        periods = np.diff(np.asarray(times, dtype=np.float64))
        parts = periods / periods.mean() - 1
        return cls(float(parts.std()), float(np.abs(parts).max()))


class SideBySide(NamedTuple):
    """The minor axis of a line on its own clock, and tethered to that of the lead axis."""

    minor: str
    lead: str
    own: Jitter
    tethered: Jitter


def bresenham(steps: int, lead: int) -> list[int]:
    """At which steps of the lead axis the minor one steps too, when it has ``steps`` of ``lead``.

    The error grows by the minor axis' share at each step of the lead axis; where it comes to a
    whole step, one is made. The minor axis is tethered to the clock of the lead axis.
    """
    stepped, error = [], lead // 2
    for at in range(lead):
        error += steps
        if error >= lead:
            error -= lead
            stepped.append(at)
    return stepped


def side_by_side(machine: Machine, line: Block) -> SideBySide | None:
    """The jitter of a line's slowest axis in the middle of it, both ways.

    None for a line with a single axis, or with too few pulses of the minor one to tell.
    """
    pulses = sorted(
        ((Pulses(machine.axes[run.axis], run), run) for run in line.runs),
        key=lambda pair: pair[0].count,
    )
    (minor, minor_run), (lead, lead_run) = pulses[0], pulses[-1]
    first = round(minor.count * (0.5 - _MIDDLE / 2))
    last = round(minor.count * (0.5 + _MIDDLE / 2))
    if minor is lead or last - first < _FEWEST:
        return None
    own = minor.times(0, minor_run.end)[first:last]
    at = bresenham(minor.count, lead.count)[first:last]
    tethered = lead.times(0, lead_run.end)[at]
    names = machine.axes[minor_run.axis].name, machine.axes[lead_run.axis].name
    return SideBySide(*names, Jitter.of(own), Jitter.of(tethered))
