"""Straight lines: how near they are to straight, how even their pulses, and how soon planned.

Random lines of three axes of any resolution (``tests/toolpath/lines.py``). For each, all axes must
end within a pulse of each other; those that come more than a step off are listed with the reason.
``python -m benchmarks.lines [--lines N] [--seed N]`` plans as many as one likes.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Iterator
from random import Random
from typing import NamedTuple

from benchmarks.figure import Figure, seconds
from sacbus.toolpath import Block, Machine, Pulses, SideBySide, plan_line, side_by_side
from tests.toolpath.lines import random_line

LINES = 1_000


class Planned(NamedTuple):
    """What became of a line."""

    seed: int
    block: Block
    together: bool
    jitter: SideBySide | None


def planned(lines: int, seed: int) -> Iterator[Planned]:
    """So many random lines, from a seed on."""
    for one in range(seed, seed + lines):
        machine, steps, feed = random_line(Random(one))
        block = plan_line(machine, steps, feed)
        yield Planned(one, block, together(machine, block), side_by_side(machine, block))


def together(machine: Machine, block: Block) -> bool:
    """Whether all axes end within one period of the slowest last pulse."""
    ends = [run.end for run in block.runs]
    periods = [Pulses(machine.axes[run.axis], run).profiles[-1].last_period for run in block.runs]
    return max(ends) - min(ends) <= max(periods)


def figures(rounds: int) -> list[Figure]:  # noqa: ARG001  the lines are the rounds
    """Of :data:`LINES` lines."""
    found: list[Planned] = []
    took = seconds(lambda: found.extend(planned(LINES, 0)))
    for one in found:
        if one.block.deviation.steps > 1:
            print(told(one), file=sys.stderr)
    return [
        Figure(
            "lines that stay within a step",
            100 * sum(one.block.deviation.steps <= 1 for one in found) / LINES,
            "%",
            1.0,
            "all of them",
            99.0,
            "value, at least",
        ),
        Figure(
            "lines whose axes end within a pulse",
            100 * sum(one.together for one in found) / LINES,
            "%",
            1.0,
            "all of them",
            100.0,
            "value, at least",
        ),
        _jitter([one.jitter for one in found if one.jitter is not None]),
        Figure(
            "lines planned and measured, pulse by pulse",
            LINES / took,
            "lines/s",
            sum(one.block.duration for one in found) / 2e6 / took,
            "the time they take to run",
        ),
    ]


def _jitter(found: list[SideBySide]) -> Figure:
    own = statistics.fmean(one.own.std for one in found)
    tethered = statistics.fmean(one.tethered.std for one in found)
    return Figure(
        "jitter of the minor axis, mean of lines",
        100 * own,
        "% of a period",
        own / tethered,
        "Bresenham's",
        0.5,
        "ratio, at most",
    )


def told(one: Planned) -> str:
    """A line that came too far off, for people."""
    far = one.block.deviation
    return f"line {one.seed}: {far.steps:.2f} steps ({far.mm:.4f} mm): {far.reason}"


def main(argv: list[str] | None = None) -> int:
    """Plan lines and print what became of them; status 1 if more than 1 % are a step off."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--lines", type=int, default=LINES)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(argv)
    steps: list[float] = []
    apart = commands = axes = 0
    jitter: list[SideBySide] = []
    for one in planned(options.lines, options.seed):
        far = one.block.deviation.steps
        steps.append(far)
        commands += sum(len(run.motions) for run in one.block.runs)
        axes += len(one.block.runs)
        apart += not one.together
        if one.jitter is not None:
            jitter.append(one.jitter)
        if far > 1:
            print(told(one))
    steps.sort()
    count = len(steps)
    off = sum(far > 1 for far in steps)
    print(f"{count} lines, {100 * (count - off) / count:.2f} % within a step of the coarsest axis")
    quantiles = ((50, count // 2), (95, count * 95 // 100), (99, count * 99 // 100))
    row = ", ".join(f"{part} % {steps[min(at, count - 1)]:.2f}" for part, at in quantiles)
    print(f"largest deviation in steps: {row}, worst {steps[-1]:.2f}")
    print(f"lines whose axes end more than a pulse apart: {apart}")
    print(f"commands an axis and line: {commands / axes:.2f}")
    for name, of in (("own clock", "own"), ("Bresenham", "tethered")):
        std = statistics.fmean(getattr(one, of).std for one in jitter)
        most = max(getattr(one, of).most for one in jitter)
        print(
            f"jitter of the minor axis, {name}: {100 * std:.2f} % (worst period {100 * most:.0f} %)"
        )
    return int(off > count / 100)


if __name__ == "__main__":
    raise SystemExit(main())
