"""Streams of steps: what they are made of, and what is none."""

from __future__ import annotations

import numpy as np
import pytest

from sacbus.simad import SimadError, Steps, merge


def test_the_steps_of_axes_are_merged_in_the_order_of_time() -> None:
    steps = merge([[10, 30, 30], [20, 30]], [1, [-1, 1]])
    assert steps.times.tolist() == [10, 20, 30, 30, 30]
    assert steps.axes.tolist() == [0, 1, 0, 0, 1]
    assert steps.directions.tolist() == [1, -1, 1, 1, 1]
    types = [str(one.dtype) for one in (steps.times, steps.axes, steps.directions)]
    assert types == ["int64", "uint8", "int8"]
    assert steps.of_axis(1)[0].tolist() == [20, 30]


def test_no_axes_and_no_steps_are_a_stream_too() -> None:
    assert merge([], []).count == 0
    assert merge([[], np.empty(0)], [1, []]).count == 0


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (([1], [0, 1], [1]), "expected as many times as axes and directions, got 1, 2 and 1"),
        (([1], [255], [1]), "axes: expected 0 to 254, got 255"),
        (([1], [-1], [1]), "axes: expected 0 to 254, got -1"),
        (([1, 2], [0, 0], [1, 0]), "directions[1]: expected 1 or -1, got 0"),
        (
            ([2, 1], [0, 0], [1, 1]),
            "times[1]: expected no earlier than 2 ns, got 1 ns, sort the steps",
        ),
        (([-1], [0], [1]), "times: expected 0 ns to 52 days, got -1 ns"),
        (([1 << 52], [0], [1]), f"times: expected 0 ns to 52 days, got {1 << 52} ns"),
        (([0.5], [0], [1]), "times: expected whole numbers, got float64"),
        (([[1]], [0], [1]), "times: expected one dimension, got 2"),
        (
            (np.array([1 << 63], dtype=np.uint64), [0], [1]),
            f"times: expected 63 bits, got {1 << 63}",
        ),
    ],
)
def test_what_is_no_stream_is_refused(given: tuple[list[int], ...], told: str) -> None:
    with pytest.raises(SimadError) as refused:
        Steps.of(*given)
    assert str(refused.value) == told


@pytest.mark.parametrize(
    ("times", "ways", "told"),
    [
        ([[1]], [1, 1], "expected directions of 1 axes, as there are times, got 2"),
        ([[1]], [[1, 1]], "directions of axis 0: expected 1, as there are times, got 2"),
        ([[]] * 256, [1] * 256, "expected 255 axes at most, got 256"),
    ],
)
def test_what_cannot_be_merged_is_refused(
    times: list[list[int]], ways: list[int], told: str
) -> None:
    with pytest.raises(SimadError) as refused:
        merge(times, ways)
    assert str(refused.value) == told
