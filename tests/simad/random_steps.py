"""Axes that move as machines do, at random: motions of some steps, each with its rate and way."""

from __future__ import annotations

import numpy as np

from sacbus.simad import Steps, merge

#: us between two steps of an axis, times the number of axes: as fast as the lines always allow.
FASTEST = 5
SLOWEST = 50


def random_steps(seed: int, axes: int, count: int) -> Steps:
    """So many steps, all axes at once; every rate is of a motion, every time a random ns."""
    draw = np.random.default_rng(seed)
    times, ways = [], []
    for axis in range(axes):
        steps = count // axes + (axis < count % axes)
        lengths = draw.integers(1, 2_000, steps // 500 + 2)
        lengths = np.append(lengths, max(steps - int(lengths.sum()), 0))
        periods = draw.integers(FASTEST * axes * 1_000, SLOWEST * axes * 1_000, lengths.size)
        due = np.repeat(periods, lengths)[:steps]
        due += draw.integers(0, 1_000, steps)
        times.append(np.cumsum(due))
        ways.append(np.repeat(draw.choice((-1, 1), lengths.size), lengths)[:steps])
    return merge(times, ways)
