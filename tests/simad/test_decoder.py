"""Decoding: what drivers make of any edges."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.simad import Decoder, Edges, SimadError, decode, encode
from sacbus.simad import decoder as decoder_file
from sacbus.simad.edges import HIGH, LOW, UNKNOWN
from sacbus.simad.steps import joined
from tests.simad.random_steps import random_steps


def edges(*all_of_them: tuple[int, int, int], direction: int = HIGH) -> Edges:
    times, lines, levels = zip(*all_of_them, strict=True)
    return Edges(
        np.array(times, dtype=np.int64),
        np.array(lines, dtype=np.uint8),
        np.array(levels, dtype=np.uint8),
        direction,
    )


def steps_of(some: Edges) -> list[tuple[int, int, int]]:
    found = decode(some)
    return list(
        zip(found.times.tolist(), found.axes.tolist(), found.directions.tolist(), strict=True)
    )


def test_a_motor_steps_on_the_fall_the_way_that_dir_is() -> None:
    some = edges((10, 1, 0), (20, 1, 1), (30, 0, 0), (40, 2, 0), (50, 2, 1), (60, 1, 0))
    assert steps_of(some) == [(10, 0, 1), (40, 1, -1), (60, 0, -1)]


def test_a_level_that_does_not_change_is_no_edge() -> None:
    some = edges((10, 1, 1), (20, 1, 0), (30, 1, 0), (40, 0, 1), (50, 1, 1), (60, 1, 1))
    assert steps_of(some) == [(20, 0, 1)]


def test_falls_from_and_to_what_is_not_known_are_no_steps() -> None:
    some = edges((10, 1, UNKNOWN), (20, 1, LOW), (30, 1, HIGH), (40, 1, UNKNOWN), (50, 1, LOW))
    assert steps_of(some) == []


def test_of_a_dir_that_changes_at_the_very_fall_the_level_before_counts() -> None:
    assert steps_of(edges((10, 0, 0), (10, 1, 0))) == [(10, 0, 1)]
    assert steps_of(edges((10, 1, 0), (10, 0, 0))) == [(10, 0, 1)]


def test_a_step_while_dir_is_not_known_is_refused() -> None:
    some = edges((5, 1, 1), (10, 1, 0), direction=UNKNOWN)
    with pytest.raises(SimadError, match="line 1 falls at 10 ns, and the level of DIR is not"):
        decode(some)
    assert steps_of(edges((5, 0, 1), (10, 1, 0), direction=UNKNOWN)) == [(10, 0, 1)]


def test_steps_of_one_instant_are_in_the_order_of_the_axes() -> None:
    assert [axis for _, axis, _ in steps_of(edges((10, 3, 0), (10, 1, 0), (10, 2, 0)))] == [0, 1, 2]


def test_no_edges_are_no_steps() -> None:
    assert decode(encode(random_steps(1, 1, 0), 1).edges).count == 0


@settings(max_examples=50)
@given(st.integers(0, 1 << 32), st.integers(1, 8), st.lists(st.integers(0, 500), max_size=5))
def test_pieces_make_no_difference(seed: int, axes: int, places: list[int]) -> None:
    coded = encode(random_steps(seed, axes, 200), axes)
    whole = decode(coded.edges)
    decoder = Decoder(coded.edges.direction)
    every = coded.edges
    cuts = [0, *sorted(min(place, every.count) for place in places), every.count]
    parts = [
        decoder.take(Edges(every.times[a:b], every.lines[a:b], every.levels[a:b]))
        for a, b in pairwise(cuts)
    ]
    again = joined(parts)
    order = np.lexsort((again.axes, again.times))
    assert np.array_equal(again.times[order], whole.times)
    assert np.array_equal(again.axes[order], whole.axes)
    assert np.array_equal(again.directions[order], whole.directions)


def test_neither_do_the_pieces_that_it_works_in(monkeypatch: pytest.MonkeyPatch) -> None:
    coded = encode(random_steps(3, 5, 2_000), 5)
    whole = decode(coded.edges)
    monkeypatch.setattr(decoder_file, "PIECE", 7)
    again = decode(coded.edges)
    assert np.array_equal(again.times, whole.times)
    assert np.array_equal(again.axes, whole.axes)
    assert np.array_equal(again.directions, whole.directions)
