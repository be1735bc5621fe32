"""Random machines and lines, the same for tests and for `python -m benchmarks lines`."""

from __future__ import annotations

from random import Random
from typing import NamedTuple

from sacbus.motion import Drive
from sacbus.toolpath import Axis, Machine

__all__ = ["Line", "random_line"]


class Line(NamedTuple):
    """A machine, signed full steps of its axes, and a feed in mm/min."""

    machine: Machine
    steps: tuple[int, int, int]
    feed: float


def random_line(rng: Random) -> Line:
    """Three axes of any resolution; one to 20 000 steps of each or none, in any proportion."""
    axes = tuple(
        Axis(
            name,
            10 + place,
            rng.choice([50.0, 80.0, 100.0, 200.0, 400.0]),
            inverted=rng.random() < 0.2,
            max_rpm=rng.choice([200, 300]),
            drive=Drive(ustep=rng.choice([0, 0, 1, 3, 4])),
        )
        for place, name in enumerate("XYZ")
    )
    machine = Machine(axes, acceleration=rng.choice([5.0, 10.47, 20.0, 50.0, 100.0]))
    steps = (0, 0, 0)
    while not any(steps):
        steps = (_steps(rng), _steps(rng), _steps(rng))
    return Line(machine, steps, 10 ** rng.uniform(1.3, 4))


def _steps(rng: Random) -> int:
    if rng.random() < 0.15:
        return 0
    return rng.choice([-1, 1]) * round(10 ** rng.uniform(0, 4.3))
