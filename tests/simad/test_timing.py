"""The rules as numbers, and the rates that follow."""

from __future__ import annotations

import pytest

from sacbus.simad import GECKO, SimadError, Steps, Timing, encode, highest_rate, merge


def test_the_defaults_are_those_of_the_announcement() -> None:
    assert (GECKO.low, GECKO.high, GECKO.setup, GECKO.hold) == (500, 4_000, 4_000, 500)
    assert Timing() == GECKO


def test_the_highest_rates_are_those_of_the_rules() -> None:
    assert int(highest_rate()) == 222_222
    assert int(highest_rate(directions=2)) == 111_111
    assert int(highest_rate(directions=4)) == 55_555
    assert highest_rate(Timing(high=19_500, setup=100, hold=0), 2) == 50_000
    with pytest.raises(SimadError, match="expected 1 direction or more, got 0"):
        highest_rate(directions=0)


def at_rate(ways: list[int], period: int) -> Steps:
    """Axes that each step a hundred times, all at the same instants."""
    return merge([[period * number for number in range(100)]] * len(ways), ways)


@pytest.mark.parametrize(
    ("ways", "period"), [([1, 1, 1], 4_500), ([1, -1], 9_000), ([1, -1, 1, -1, 1], 9_000)]
)
def test_at_the_highest_rate_delays_do_not_grow_and_above_it_they_do(
    ways: list[int], period: int
) -> None:
    wait = 0 if len(set(ways)) == 1 else 4_500
    fits = encode(at_rate(ways, period), len(ways)).report
    assert max(one.delay_max for one in fits.axes) == wait
    above = encode(at_rate(ways, period - 1), len(ways)).report
    assert max(one.delay_max for one in above.axes) == wait + 99


@pytest.mark.parametrize("name", ["low", "high", "setup", "hold"])
@pytest.mark.parametrize("value", [-1, 1_000_000_001])
def test_what_no_driver_asks_for_is_refused(name: str, value: int) -> None:
    with pytest.raises(SimadError, match=f"{name}: expected [01] to 1000000000 ns, got {value}"):
        Timing(**{name: value})


def test_only_the_hold_time_may_be_nothing() -> None:
    assert Timing(hold=0).until_turn == 500
    with pytest.raises(SimadError, match="setup: expected 1 to 1000000000 ns, got 0"):
        Timing(setup=0)
