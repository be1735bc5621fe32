"""Tables of ramps: head and tail give the sums of the periods, one by one."""

from __future__ import annotations

import gc
import sys
from itertools import accumulate, islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sacbus.motion.harmonic import HarmonicLaw, harmonic
from sacbus.motion.linear import LinearLaw, linear
from sacbus.motion.ramp import BLOCK, HEAD, PAGE, Ramp

RATE = 60_000_000
"""drive.rate at 200 steps a revolution."""


def slow_sums(ramp: Ramp, count: int, offset: int) -> list[int]:
    periods = islice(ramp.law.periods(count), count)
    return list(accumulate((max(1, p + offset) for p in periods), initial=0))


def times(ramp: Ramp, first: int, last: int) -> NDArray[np.int64]:
    pieces = list(ramp.pieces(first, last))
    assert all(piece.size for piece in pieces)
    return np.concatenate(pieces)


def assert_sums(ramp: Ramp, count: int, offset: int) -> None:
    expected = slow_sums(ramp, count, offset)
    assert np.array_equal(times(ramp, 0, len(expected)), expected)
    step = max(1, count // 97)
    for index in {*range(0, count, step), HEAD - 1, HEAD, HEAD + 1, count} & set(range(count + 1)):
        assert ramp.time(index) == expected[index]
    for index in range(0, count, step):
        assert ramp.index(expected[index], count) == index
        assert ramp.index(expected[index + 1] - 1, count) == index
        assert ramp.period(index) == expected[index + 1] - expected[index]
    assert times(ramp, count // 2, count).tolist() == expected[count // 2 : count]


@pytest.mark.slow
@settings(max_examples=60)
@given(
    start=st.integers(100, 30_000),
    slope=st.sampled_from([1, 3, 50, 100, 999, 9_999]),
    offset=st.sampled_from([0, 0, -12, -247, 255]),
    count=st.integers(1, 3 * HEAD),
    rate=st.sampled_from([RATE, RATE // 2, 12_000_000_000]),
)
def test_a_harmonic_ramp_up_is_the_sum_of_its_periods(
    start: int, slope: int, offset: int, count: int, rate: int
) -> None:
    assert_sums(Ramp(HarmonicLaw(rate, start, slope), offset), count, offset)


@pytest.mark.slow
@settings(max_examples=60)
@given(
    end=st.integers(100, 30_000),
    slope=st.sampled_from([1, 3, 50, 100, 999, 9_999]),
    offset=st.sampled_from([0, 0, -12, 255]),
    count=st.integers(1, 3 * HEAD),
)
def test_a_harmonic_ramp_down_is_the_sum_of_its_periods(
    end: int, slope: int, offset: int, count: int
) -> None:
    assert_sums(Ramp(HarmonicLaw(RATE, end + slope * count, -slope), offset), count, offset)


def test_a_ramp_down_from_beyond_one_tick_comes_back_to_longer_periods() -> None:
    law = HarmonicLaw(RATE, 3 * RATE, -14_600)
    assert_sums(Ramp(law, 0), 3 * HEAD, 0)


@pytest.mark.parametrize("acc100", [1, 37, 1047, 5000, 9999, 90_000])
@pytest.mark.parametrize("pulses_per_rev", [200, 3200, 25_600, 1])
@pytest.mark.parametrize("offset", [0, -40])
def test_a_linear_ramp_is_the_recurrence_pulse_by_pulse(
    acc100: int, pulses_per_rev: int, offset: int
) -> None:
    count = 60_000
    ramp = Ramp(LinearLaw(pulses_per_rev, acc100, RATE), offset)
    assert np.array_equal(times(ramp, 0, count + 1), slow_sums(ramp, count, offset))


@pytest.mark.slow
@pytest.mark.parametrize(("acc100", "pulses_per_rev"), [(1, 25_600), (100, 200), (1047, 400)])
def test_a_linear_ramp_of_a_million_pulses_is_still_the_recurrence(
    acc100: int, pulses_per_rev: int
) -> None:
    count = 1_000_000
    ramp = Ramp(LinearLaw(pulses_per_rev, acc100, RATE), 0)
    assert np.array_equal(times(ramp, 0, count + 1), slow_sums(ramp, count, 0))


def test_a_crossing_too_close_to_call_is_walked_to() -> None:
    """Moved to either side of a whole tick by the last bits, the recurrence decides."""
    probe = LinearLaw(200, 100, RATE)
    c = probe._walk(5_000)
    for ulps in range(-120, 121, 8):
        law = LinearLaw(200, 100, RATE)
        law._first *= int(c) / c * (1 + ulps * 2.0**-52)
        law._reached = (0, law._first)
        ramp = Ramp(law, 0)
        assert np.array_equal(times(ramp, 4_900, 5_101), slow_sums(ramp, 5_100, 0)[4_900:])


def test_a_walk_starts_over_for_an_earlier_pulse() -> None:
    law = LinearLaw(200, 100, RATE)
    late, early = law._walk(5_000), law._walk(4_500)
    fresh = LinearLaw(200, 100, RATE)
    assert (fresh._walk(4_500), fresh._walk(5_000)) == (early, late)


def test_a_ramp_of_millions_of_pulses_keeps_kilobytes() -> None:
    ramp = harmonic(RATE, 128_000, 1, 0)
    ramp.time(7_500_000)
    marks = ramp._mark_index
    assert len(marks) <= 60_000 // PAGE + 2
    assert sys.getsizeof(ramp.sums) <= 10 * HEAD
    long = linear(25_600, 1, RATE, 0)
    assert long.time(800_000_000) > 0
    assert len(long._mark_index) < 20


def test_a_time_far_up_a_fresh_ramp_is_found() -> None:
    walked, fresh = Ramp(HarmonicLaw(RATE, 1000, 1), 0), Ramp(HarmonicLaw(RATE, 1000, 1), 0)
    for index in (59_000, 30_000):
        assert fresh.index(walked.time(index), 59_001) == index


def test_growing_a_table_leaves_the_pieces_handed_out_as_they_were() -> None:
    ramp = Ramp(HarmonicLaw(RATE, 1000, 100), 0)
    (early,) = ramp.pieces(0, 10)
    before = early.tolist()
    ramp.time(HEAD)
    gc.collect()
    assert early.tolist() == before == times(ramp, 0, 10).tolist()


def test_of_no_pulses_there_are_no_pieces() -> None:
    ramp = Ramp(HarmonicLaw(RATE, 1000, 100), 0)
    for first in (0, HEAD, HEAD + 5):
        assert list(ramp.pieces(first, first)) == []


@pytest.mark.parametrize("first", [HEAD - 2, HEAD - 1, HEAD, HEAD + BLOCK - 1, HEAD + BLOCK])
def test_pieces_follow_each_other_over_the_seams(first: int) -> None:
    ramp = Ramp(HarmonicLaw(RATE, 10_000, 1), 0)
    for count in (1, 2, 3, BLOCK + 2):
        expected = [ramp.time(index) for index in range(first, first + count)]
        assert times(ramp, first, first + count).tolist() == expected


def test_the_same_parameters_share_a_table() -> None:
    assert harmonic(RATE, 1000, 100, 0) is harmonic(RATE, 1000, 100, 0)
    assert linear(200, 100, RATE, 0) is linear(200, 100, RATE, 0)
