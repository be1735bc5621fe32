from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from sacbus.mother import NodeStatistics


def test_there_is_no_round_trip_before_the_first() -> None:
    assert NodeStatistics().round_trip_us() is None


def test_round_trips_are_told_in_microseconds() -> None:
    statistics = NodeStatistics()
    statistics.round_trips.extend([4_030_832, 4_030_000, 9_000_000])
    assert statistics.round_trip_us() == {"min": 4030.0, "median": 4030.832, "p99": 9000.0}


def test_p99_is_the_smallest_that_99_of_a_hundred_do_not_exceed() -> None:
    statistics = NodeStatistics()
    statistics.round_trips.extend(number * 1_000 for number in range(100, 0, -1))
    assert statistics.round_trip_us() == {"min": 1.0, "median": 50.5, "p99": 99.0}


def test_only_the_last_thousand_round_trips_are_kept() -> None:
    statistics = NodeStatistics()
    statistics.round_trips.extend(range(5_000))
    assert len(statistics.round_trips) == 1_000
    assert statistics.round_trip_us() == {"min": 4.0, "median": 4.4995, "p99": 4.989}


@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=1_000))
def test_min_median_and_p99_never_cross(round_trips: list[int]) -> None:
    statistics = NodeStatistics()
    statistics.round_trips.extend(round_trips)
    told = statistics.round_trip_us()
    assert told is not None
    assert told["min"] <= told["median"] <= told["p99"] <= max(round_trips) / 1_000
    exceeding = sum(one / 1_000 > told["p99"] for one in round_trips)
    assert exceeding <= len(round_trips) / 100


def test_all_of_it_is_a_dictionary_that_json_takes() -> None:
    statistics = NodeStatistics(sent=5, acks=2, naks=1, timeouts=2, retries=3)
    counts = {"sent": 5, "acks": 2, "naks": 1, "timeouts": 2, "retries": 3}
    assert statistics.as_dict() == {**counts, "round_trip_us": None}
    statistics.round_trips.extend([4_000_000, 5_000_000])
    told = statistics.as_dict()
    assert told["round_trip_us"] == {"min": 4000.0, "median": 4500.0, "p99": 5000.0}
    assert json.loads(json.dumps(told)) == told
