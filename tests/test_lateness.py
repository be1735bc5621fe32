"""The histogram of lateness against a sorted list of the same values."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.kernel import MS, SECOND, US
from sacbus.lateness import Lateness


def noted(*values: int) -> Lateness:
    lateness = Lateness()
    for value in values:
        lateness.note(value)
    return lateness


def test_before_the_first_event_everything_is_zero() -> None:
    lateness = Lateness()
    assert (lateness.count, lateness.p50, lateness.p99, lateness.worst) == (0, 0, 0, 0)


def test_quantiles_are_those_of_the_events() -> None:
    lateness = noted(*[60 * US] * 97, *[2 * MS] * 2, 11 * MS)
    assert lateness.count == 100
    assert lateness.p50 == pytest.approx(60 * US, rel=0.04)
    assert lateness.p99 == pytest.approx(2 * MS, rel=0.04)
    assert lateness.worst == 11 * MS


@pytest.mark.parametrize("value", [0, 1, 31, 63, 64, 65, 127, 128, 2**37 - 1, 2**37, 2**60])
def test_of_equal_values_every_quantile_is_exact(value: int) -> None:
    lateness = noted(value, value, value)
    assert (lateness.p50, lateness.p99, lateness.worst) == (value, value, value)


def test_what_is_early_counts_as_on_time() -> None:
    lateness = noted(SECOND, -1, -SECOND)
    assert (lateness.count, lateness.p50, lateness.worst) == (3, 0, SECOND)


def test_what_is_later_than_two_minutes_is_still_counted_and_the_worst_is_exact() -> None:
    lateness = noted(1, SECOND, SECOND, 200 * SECOND, 300 * SECOND)
    assert lateness.p50 == pytest.approx(SECOND, rel=0.04)
    assert lateness.p99 == lateness.worst == 300 * SECOND


@given(st.lists(st.integers(0, 2**37 - 1) | st.integers(0, 300), min_size=1))
def test_quantiles_are_never_too_low_and_at_most_a_32nd_too_high(values: list[int]) -> None:
    lateness = noted(*values)
    values.sort()
    for percent, found in ((50, lateness.p50), (99, lateness.p99)):
        exact = values[-(-len(values) * percent // 100) - 1]
        assert exact <= found <= exact + exact // 32
    assert lateness.worst == values[-1]
    assert lateness.count == len(values)
