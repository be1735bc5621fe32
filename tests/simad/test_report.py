"""The figures: exact, however many there are and however large they are."""

from __future__ import annotations

import numpy as np
import pytest

from sacbus.simad import encode, merge
from sacbus.simad.report import Tally


@pytest.mark.parametrize("late", [3, 1 << 20, 1 << 31, (1 << 40) + 1])
def test_sums_of_squares_are_exact_beyond_63_bits(late: int) -> None:
    tally = Tally()
    delays = np.full(10_000, late, dtype=np.int64)
    for _ in range(3):
        tally.add(delays, np.ones(10_000, dtype=np.bool_))
    assert (tally.sum, tally.sum_of_squares) == (30_000 * late, 30_000 * late * late)
    assert (tally.steps, tally.moved, tally.position, tally.worst) == (30_000, 30_000, 30_000, late)
    assert tally.report("X").delay_rms == late


def test_all_of_it_is_in_its_json() -> None:
    told = encode(merge([[0, 100_000], [0]], [1, -1]), 2, names=("X", "Y")).report.as_json()
    assert told == {
        "steps": 3,
        "moved": 1,
        "dir_changes": 2,
        "lines": 3,
        "lines_without": 4,
        "axes": [
            {
                "axis": "X",
                "steps": 2,
                "position": 2,
                "moved": 0,
                "delay_max_ns": 0,
                "delay_mean_ns": 0.0,
                "delay_rms_ns": 0.0,
            },
            {
                "axis": "Y",
                "steps": 1,
                "position": -1,
                "moved": 1,
                "delay_max_ns": 4_500,
                "delay_mean_ns": 4_500.0,
                "delay_rms_ns": 4_500.0,
            },
        ],
        "highest_rate": {"one_direction": 1e9 / 4_500, "both_directions": 1e9 / 9_000},
        "timing_ns": {"low": 500, "high": 4_000, "setup": 4_000, "hold": 500},
    }
