"""What encoding did to the steps: how many there were, and how much later than due they fell.

Owns the figures, exact however the steps came: whole numbers are added up, and divided once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sacbus.simad.timing import GECKO, Timing, highest_rate

if TYPE_CHECKING:
    from sacbus.simad.order import Flags
    from sacbus.simad.steps import Times

__all__ = ["AxisReport", "Report", "Tally"]

#: Sums of squares below this are worked out by numpy.
SMALL: Final = 1 << 63


@dataclass(frozen=True, slots=True)
class AxisReport:
    """One axis: its steps, those that fell later than due, and by how much over all, in ns.

    position: clockwise steps less the others.
    """

    axis: str
    steps: int
    position: int
    moved: int
    delay_max: int
    delay_mean: float
    delay_rms: float


@dataclass(frozen=True, slots=True)
class Report:
    """All axes. dir_changes: how often DIR turned."""

    axes: tuple[AxisReport, ...]
    dir_changes: int
    timing: Timing = GECKO

    @property
    def steps(self) -> int:
        """Of all axes."""
        return sum(one.steps for one in self.axes)

    @property
    def moved(self) -> int:
        """Steps that fell later than they were due."""
        return sum(one.moved for one in self.axes)

    @property
    def lines(self) -> int:
        """Lines used: one an axis, and DIR."""
        return len(self.axes) + 1

    @property
    def lines_without(self) -> int:
        """Lines that step and direction would take: two an axis."""
        return 2 * len(self.axes)

    def as_json(self) -> dict[str, Any]:
        """All of it. ``Any``: the shapes of JSON."""
        timing = self.timing
        return {
            "steps": self.steps,
            "moved": self.moved,
            "dir_changes": self.dir_changes,
            "lines": self.lines,
            "lines_without": self.lines_without,
            "axes": [
                {
                    "axis": one.axis,
                    "steps": one.steps,
                    "position": one.position,
                    "moved": one.moved,
                    "delay_max_ns": one.delay_max,
                    "delay_mean_ns": one.delay_mean,
                    "delay_rms_ns": one.delay_rms,
                }
                for one in self.axes
            ],
            "highest_rate": {
                "one_direction": highest_rate(timing),
                "both_directions": highest_rate(timing, 2),
            },
            "timing_ns": {
                "low": timing.low,
                "high": timing.high,
                "setup": timing.setup,
                "hold": timing.hold,
            },
        }


class Tally:
    """The figures of one axis while they are added up."""

    __slots__ = ("moved", "position", "steps", "sum", "sum_of_squares", "worst")

    def __init__(self) -> None:
        self.steps = 0
        self.position = 0
        self.moved = 0
        self.worst = 0
        self.sum = 0
        self.sum_of_squares = 0

    def add(self, delays: Times, clockwise: Flags) -> None:
        """Some steps, at least one."""
        self.steps += delays.size
        self.position += 2 * int(np.count_nonzero(clockwise)) - delays.size
        worst = int(delays.max())
        if not worst:
            return
        self.worst = max(self.worst, worst)
        self.moved += int(np.count_nonzero(delays))
        self.sum += int(delays.sum())
        if worst * worst * delays.size < SMALL:
            self.sum_of_squares += int(np.dot(delays, delays))
        else:
            self.sum_of_squares += sum(one * one for one in delays.tolist())

    def report(self, axis: str) -> AxisReport:
        """What has been added up."""
        steps = max(self.steps, 1)
        return AxisReport(
            axis,
            self.steps,
            self.position,
            self.moved,
            self.worst,
            self.sum / steps,
            sqrt(self.sum_of_squares / steps),
        )


def report(
    tallies: Sequence[Tally], names: Sequence[str], dir_changes: int, timing: Timing
) -> Report:
    """The report of all axes."""
    axes = tuple(tally.report(name) for tally, name in zip(tallies, names, strict=True))
    return Report(axes, dir_changes, timing)
