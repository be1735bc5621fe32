"""A trail keeps what was passed, thinner and thinner, and never more than so much."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sacbus.machining import Trail


@given(st.integers(0, 500), st.sampled_from([2, 4, 16]))
def test_it_is_bounded_and_ends_where_it_ended(count: int, most: int) -> None:
    trail: Trail[int] = Trail(most=most)
    for point in range(count):
        trail.add(point)
    points = trail.points
    assert len(points) <= most
    assert points == sorted(set(points))
    assert points[-1:] == ([count - 1] if count else [])
    if count < most:
        assert points == list(range(count))


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=300))
def test_what_is_merged_loses_no_extreme(values: list[int]) -> None:
    trail: Trail[int] = Trail(max, most=8)
    for value in values:
        trail.add(value)
    assert max(trail.points) == max(values)
