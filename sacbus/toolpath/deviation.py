"""How far the tool is from its path at the worst instant of a block.

Owns the measure, and the words for what is behind it. It is worked out from every pulse of every
axis, for it is between the pulses that a tool made of steps is off. Spans of time are looked at one
after the other, so a block may have any number of pulses.
Source: spec, mother ("Straight lines": the largest deviation, in steps and mm).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sacbus.toolpath.block import AxisRun, Deviation
from sacbus.toolpath.law import Law
from sacbus.toolpath.machine import Machine
from sacbus.toolpath.pulses import Pulses
from sacbus.toolpath.share import TICKS_PER_SECOND, sweeps

__all__ = ["deviation", "deviation_from"]

Point = Sequence[float]
Reals = NDArray[np.float64]

#: Pulses, more or less, that are looked at together: some 10 MB.
_TOGETHER: Final = 1 << 16


#: The path is looked for as far as so many steps from where the tool should be, but no more lines
#: than these before and behind.
_NEARBY: Final = 3
_ASIDE_MAX: Final = 8

#: Instants of a ramp between which its places are read off a straight line.
_KNOTS: Final = 16


class _Worst(NamedTuple):
    mm: float
    ticks: int


def deviation(
    machine: Machine, way: Sequence[Sequence[int]], law: Law, runs: Sequence[AxisRun]
) -> Deviation:
    """As :func:`deviation_from`, from a path that was asked for in whole steps.

    way: signed full steps of every axis, for each segment of the block.
    """
    ends = np.cumsum(np.array(way, dtype=np.int64), axis=0)
    return deviation_from(machine, [[end] for end in ends.tolist()], law, runs)


def deviation_from(
    machine: Machine,
    ways: Sequence[Sequence[Point]],
    law: Law,
    runs: Sequence[AxisRun],
    begin: Point | None = None,
) -> Deviation:
    """The largest distance of the tool from the path, with oscillators that are exact.

    ways: for each segment of the block the points that the path comes by, its end the last of them;
    full steps of every axis from where the block begins, which need not be whole. begin: where the
    path is then; None: exactly there. The distance is that to the line on which the tool should be,
    or to one nearby. A reason is given for more than a step of the coarsest axis that moves.
    """
    if not runs:
        return Deviation(0.0, 0.0)
    path = _Path(machine, ways, law, [0.0] * len(machine.axes) if begin is None else begin)
    pulses = [Pulses(machine.axes[run.axis], run) for run in runs]
    worst = _worst(path, machine, runs, pulses)
    coarsest = max(1 / machine.axes[run.axis].steps_per_mm for run in runs)
    steps = worst.mm / coarsest
    if steps <= 1:
        return Deviation(worst.mm, steps)
    reason, places = _reason(machine, ways, law, runs, pulses, worst.ticks)
    rounded = float(path.distances(np.array([worst.ticks]), places[:, None])[0]) / coarsest
    if rounded >= 0.01:
        reason += f"; {rounded:.2f} by rounding its corners to steps"
    return Deviation(worst.mm, steps, reason)


class _Path:
    """The lines that a path is made of, in mm, and when each is due to be over."""

    def __init__(
        self, machine: Machine, ways: Sequence[Sequence[Point]], law: Law, begin: Point
    ) -> None:
        scale = np.array([1 / axis.steps_per_mm for axis in machine.axes])
        points = np.array([begin, *(point for way in ways for point in way)]) * scale
        self._corners: Final = points[:-1]
        self._sides: Final = np.diff(points, axis=0)
        self._squares: Final = (self._sides**2).sum(axis=1)
        self._ends: Final = np.interp(self._along([len(way) for way in ways]), *_times(law))
        typical = float(np.median(np.sqrt(self._squares))) or 1.0
        self._aside: Final = min(max(1, ceil(_NEARBY * float(scale.max()) / typical)), _ASIDE_MAX)

    def _along(self, lines: Sequence[int]) -> Reals:
        """How far each line leads: whole segments, and the part of the last."""
        lengths = np.sqrt(self._squares)
        found, done = [], 0
        for segment, count in enumerate(lines):
            upto = np.cumsum(lengths[done : done + count])
            found.append(segment + (upto / upto[-1] if upto[-1] else np.ones(count)))
            done += count
        return np.concatenate(found)

    def distances(self, ticks: NDArray[np.int64], places: Reals) -> Reals:
        """Mm from some places, a column each, at some times to the path nearby."""
        last = len(self._sides) - 1
        here = np.minimum(np.searchsorted(self._ends, ticks), last)
        nearest = self._squared(here, places)
        for aside in range(1, min(self._aside, last) + 1):
            for way in (-aside, aside):
                beside = np.clip(here + way, 0, last)
                nearest = np.minimum(nearest, self._squared(beside, places))
        return np.sqrt(nearest)

    def _squared(self, segment: NDArray[np.intp], places: Reals) -> Reals:
        from_corner = places - self._corners[segment].T
        sides, squares = self._sides[segment].T, self._squares[segment]
        along = (from_corner * sides).sum(axis=0)
        along = np.clip(
            np.divide(along, squares, where=squares > 0, out=np.zeros_like(along)), 0, 1
        )
        squared: Reals = ((from_corner - along * sides) ** 2).sum(axis=0)
        return squared


def _times(law: Law) -> tuple[Reals, Reals]:
    """Places along a block, as `_Path` has them, and the ticks at which they are due."""
    places, ticks = [0.0], [0.0]
    now = 0.0
    for phase in law:
        for part in range(1, _KNOTS + 1) if phase.v0 != phase.v1 else (_KNOTS,):
            gone = part / _KNOTS
            mean = (phase.v0 + phase.v1) / 2
            way = gone * (phase.v0 + gone * (phase.v1 - phase.v0) / 2) / mean
            places.append(phase.segment + phase.begin + way * (phase.end - phase.begin))
            ticks.append((now + gone * phase.seconds) * TICKS_PER_SECOND)
        now += phase.seconds
    return np.array(places), np.array(ticks)


def _worst(
    path: _Path, machine: Machine, runs: Sequence[AxisRun], pulses: Sequence[Pulses]
) -> _Worst:
    duration = max(run.end for run in runs)
    spans = ceil(sum(one.count for one in pulses) / _TOGETHER)
    worst = _Worst(0.0, 0)
    at = np.zeros(len(machine.axes))
    for span in range(spans):
        since, until = duration * span // spans, duration * (span + 1) // spans
        times = [one.times(since, until) for one in pulses]
        # The instants at which something is issued, each once: what comes together is one.
        instants = np.unique(np.concatenate(times))
        if not instants.size:
            continue
        places = np.repeat(at[:, None], instants.size, axis=1)
        for run, one, own in zip(runs, pulses, times, strict=True):
            behind = np.searchsorted(own, instants, "right")
            steps_per_mm = machine.axes[run.axis].steps_per_mm
            reached = one.places(since, until) / steps_per_mm
            places[run.axis] = np.append(at[run.axis], reached)[behind]
        at = places[:, -1].copy()
        distances = path.distances(instants, places)
        which = int(distances.argmax())
        if distances[which] > worst.mm:
            worst = _Worst(float(distances[which]), int(instants[which]))
    return worst


def _reason(
    machine: Machine,
    ways: Sequence[Sequence[Point]],
    law: Law,
    runs: Sequence[AxisRun],
    pulses: Sequence[Pulses],
    ticks: int,
) -> tuple[str, Reals]:
    """What each axis was off by at an instant, and why; and where all should be, in mm."""
    told: list[str] = []
    places = np.zeros(len(machine.axes))
    for run, one in zip(runs, pulses, strict=True):
        axis = machine.axes[run.axis]
        ideal = 0.0
        for sweep in sweeps(_steps(ways, run.axis), law):
            gone = min(max(sweep.at(ticks), 0.0), float(sweep.steps))
            ideal += gone if sweep.forward else -gone
        places[run.axis] = ideal / axis.steps_per_mm
        told.append(f"{axis.name} {one.place_at(ticks) - ideal:+.2f}")
    seconds = ticks / TICKS_PER_SECOND
    off_by = ", ".join(told)
    return (
        f"{_about(law, seconds)} at {seconds:.3f} s: {off_by} steps from where each should be, "
        "of which half a step is the step's own"
    ), places


def _steps(ways: Sequence[Sequence[Point]], axis: int) -> list[int]:
    """Full steps of an axis in each segment: a path is rounded at the ends of its segments."""
    places = [0, *(round(way[-1][axis]) for way in ways)]
    return [after - before for before, after in pairwise(places)]


def _about(law: Law, seconds: float) -> str:
    """What limits how well an axis follows at a time."""
    for phase in law:
        if seconds <= phase.seconds:
            break
        seconds -= phase.seconds
    if phase.v0 == phase.v1:
        return "a cruise of whole us"
    doing = "up" if phase.v1 > phase.v0 else "down"
    return f"a ramp {doing} of whole steps and RPM and hundredths of a rad/s2"
