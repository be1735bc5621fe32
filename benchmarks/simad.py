"""How fast steps become lines, and lines steps: ten million steps of 4, 6 and 8 axes in one call.

Axes move at random as machines do (``tests/simad/random_steps.py``), some going one way and some
the other. The baseline is what any method must do at least: to put the edges' times in order with
``numpy.sort``. Every result is decoded, and has to be exactly what was encoded; every edge has to
keep the rules.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks.figure import Figure, alternate
from sacbus.simad import Edges, Encoding, Steps, decode, encode
from tests.simad.random_steps import random_steps

STEPS = 10_000_000


def check(steps: Steps, coded: Encoding, decoded: Steps, axes: int) -> None:
    """Every step is there again, the way it went, when it was told to fall, and late as told."""
    assert decoded.count == steps.count
    for axis in range(axes):
        mine = steps.axes == axis
        times, ways = decoded.of_axis(axis)
        assert np.array_equal(ways, steps.directions[mine])
        assert np.array_equal(times, coded.falls[mine])
        told = coded.report.axes[axis]
        late = times - steps.times[mine]
        assert late.min() >= 0
        assert (told.delay_max, told.moved) == (int(late.max()), int(np.count_nonzero(late)))


def check_rules(edges: Edges, axes: int) -> None:
    """Every edge of a line keeps Gecko's rules, in ns, as written here."""
    turns = edges.times[edges.lines == 0]
    falls = []
    for line in range(1, axes + 1):
        times = edges.times[edges.lines == line]
        assert np.all(times[1::2] - times[::2] == 500)
        assert np.all(times[2::2] - times[1:-1:2] >= 4_000)
        falls.append(times[::2])
    fell = np.sort(np.concatenate(falls))
    following = np.searchsorted(fell, turns)
    before, behind = following > 0, following < fell.size
    assert np.all(turns[before] - fell[following[before] - 1] >= 500)
    assert np.all(fell[following[behind]] - turns[behind] >= 4_000)


def figures(rounds: int) -> list[Figure]:
    """Steps per second, both ways."""
    found = []
    for axes in (4, 6, 8):
        steps = random_steps(axes, axes, STEPS)
        coded = encode(steps, axes)
        check(steps, coded, decode(coded.edges), axes)
        check_rules(coded.edges, axes)
        told = coded.report
        edges = np.concatenate((coded.falls, coded.falls + 500))
        few = min(rounds, 3)
        took, least = alternate(partial(encode, steps, axes), partial(np.sort, edges), few)
        found.append(
            Figure(
                f"SiMAD, {axes} axes on {told.lines} lines for {told.lines_without}, encoded",
                STEPS / took / 1e6,
                "M steps/s",
                least / took,
                "numpy.sort of the edges",
                5.0,
                "value, at least",
            )
        )
        took, least = alternate(partial(decode, coded.edges), partial(np.sort, edges), few)
        found.append(
            Figure(
                "the same decoded",
                STEPS / took / 1e6,
                "M steps/s",
                least / took,
                "numpy.sort of the edges",
            )
        )
    return found
