"""Whole paths: how soon they are planned, and what becomes of them.

A helix of fine points, as programs for milling write curves, and one of points so far apart that
each is a corner of its own. The line carries what 38 400 baud do.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, sin

from benchmarks.figure import Figure, seconds
from sacbus.toolpath import Axis, Machine, Straight, Survey, plan_path

POINTS = 20_000
COMMAND_SECONDS = 0.0105

MACHINE = Machine(tuple(Axis(name, node, 400) for node, name in enumerate("XYZ", 10)))


def helix(points: int, a_turn: int) -> Iterator[Straight]:
    """Points of a helix of 20 mm across that rises by 0.2 mm a turn."""
    for k in range(1, points + 1):
        angle = 2 * pi * k / a_turn
        yield Straight((10 * cos(angle) - 10, 10 * sin(angle), 0.2 * k / a_turn), 100, k)


def planned(points: int, a_turn: int) -> tuple[Survey, float]:
    """The survey of a helix, and the processor time it took to plan."""
    survey = Survey()

    def plan() -> None:
        for block in plan_path(helix(points, a_turn), MACHINE, command_seconds=COMMAND_SECONDS):
            survey.add(block)

    return survey, seconds(plan)


def figures(rounds: int) -> list[Figure]:  # noqa: ARG001  the points are the rounds
    """Of :data:`POINTS` points, and a tenth of them."""
    fine, took_fine = planned(POINTS, 2_000)
    coarse, took_coarse = planned(POINTS // 10, 72)
    return [
        Figure(
            "points of a fine helix planned",
            POINTS / took_fine,
            "/s",
            fine.planned / took_fine,
            "the time it takes to run",
            100_000 / 60,
            "value, at least",
        ),
        Figure(
            "corners of a coarse helix planned",
            POINTS // 10 / took_coarse,
            "/s",
            coarse.planned / took_coarse,
            "the time it takes to run",
        ),
        Figure(
            "worst deviation of the fine helix",
            fine.deviation.steps,
            "steps",
            fine.planned / fine.asked,
            "the time asked for",
        ),
    ]
