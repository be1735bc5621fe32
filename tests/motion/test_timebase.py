"""How long ticks last: an oscillator's error, and the external clock."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.motion import FACTORY_XFREQ, Timebase

SECOND = 1_000_000_000
clocks = st.one_of(
    st.builds(Timebase.internal, st.integers(-100_000, 100_000)),
    st.builds(Timebase.external, st.integers(1, 2**32 - 1), st.integers(1, 20_000_000)),
)


def test_a_tick_is_half_a_microsecond() -> None:
    # manual, "Slow speed": a 2 MHz clock
    clock = Timebase()
    assert clock == Timebase.internal()
    assert (clock.span(1), clock.span(2_000_000), clock.ticks_in(SECOND)) == (
        500,
        SECOND,
        2 * 10**6,
    )


@pytest.mark.parametrize(
    ("ppm", "minute"), [(10, 59_999_400_006), (-10, 60_000_600_007), (100_000, 54_545_454_546)]
)
def test_an_oscillator_that_runs_fast_makes_a_minute_of_ticks_shorter(
    ppm: int, minute: int
) -> None:
    # manual, "clock": 10 ppm of a resonator
    assert Timebase.internal(ppm).span(120_000_000) == minute


def test_a_cycle_lasts_its_edges_of_the_external_clock() -> None:
    # spec, "Units and clock": cycle x xfreq / 1e6 edges; 3000 us are 6000 ticks
    for xfreq, hz, cycle_ns in (
        (1_000_000, 1_000_000, 3_000_000),
        (1_000_000, 999_000, 3_003_004),
        (2_000_000, 1_000_000, 6_000_000),
        (0, FACTORY_XFREQ, 3_000_000),
    ):
        assert Timebase.external(xfreq, hz).span(6_000) == cycle_ns


def test_a_clock_without_edges_stands_still() -> None:
    clock = Timebase.external(1_000_000, 0)
    assert not clock.runs
    assert clock.ticks_in(10**18) == 0
    assert Timebase.external(1_000_000, 1).runs


@given(clock=clocks, ticks=st.integers(0, 2**70))
def test_a_tick_begins_at_the_first_nanosecond_that_is_not_before_it(
    clock: Timebase, ticks: int
) -> None:
    exact = Fraction(clock.ns, clock.ticks) * ticks
    assert 0 <= clock.span(ticks) - exact < 1
    if clock.ns >= clock.ticks:
        assert clock.ticks_in(clock.span(ticks)) == ticks
        assert not ticks or clock.ticks_in(clock.span(ticks) - 1) == ticks - 1


def test_clocks_of_the_same_pace_are_the_same() -> None:
    assert Timebase.external(2_000_000, 2_000_000) == Timebase()


@pytest.mark.parametrize(("ns", "ticks"), [(0, 1), (-500, 1), (500, -1)])
def test_what_is_no_clock_is_refused(ns: int, ticks: int) -> None:
    with pytest.raises(ValueError, match="no clock"):
        Timebase(ns, ticks)
