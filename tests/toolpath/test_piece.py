"""Pieces: straight items that might as well be one."""

from __future__ import annotations

import math
import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.toolpath import Dwell, Halt, PathItem, Straight
from sacbus.toolpath.piece import JOINED_MAX, Piece, pieces
from sacbus.toolpath.stretch import stretches
from tests.toolpath.paths import XYZ, circle, straights, wanderings


def cut(items: list[PathItem], within: float = 0.5) -> list[Piece]:
    return [one for one in pieces(items, XYZ, within) if isinstance(one, Piece)]


def test_items_in_one_line_are_one_piece() -> None:
    points = [(1.0, 2.0, 0.0), (2.0, 4.0, 0.0), (3.0, 6.0, 0.0)]
    (piece,) = cut(list(straights(points)))
    assert piece.way == (points[-1],)
    assert piece.lines == (1, 3)
    assert piece.length == pytest.approx(math.dist((0, 0), (3, 6)))


def test_a_point_half_a_step_off_the_line_is_left_out_and_one_further_off_is_not() -> None:
    half = 0.5 / 400
    assert len(cut(list(straights([(1, half, 0), (2, 0, 0)])))) == 1
    assert len(cut(list(straights([(1, half * 1.01, 0), (2, 0, 0)])))) == 2


def test_a_point_that_is_left_out_is_still_one_that_the_path_comes_by() -> None:
    points = [(1.0, 0.25 / 400, 0.0), (2.0, 0.0, 0.0)]
    (piece,) = cut(list(straights(points)))
    assert piece.way == tuple(points)


def test_no_point_is_left_out_when_that_is_not_wanted() -> None:
    assert len(cut(list(straights([(1, 0, 0), (2, 0, 0)])), within=-1)) == 2


def test_a_path_that_turns_back_on_its_line_is_not_joined() -> None:
    assert len(cut(list(straights([(2, 0, 0), (1, 0, 0)])))) == 2
    assert len(cut(list(straights([(2, 0, 0), (1, 0, 0), (3, 0, 0)])))) == 3


def test_what_ends_where_it_began_is_not_joined_to_nothing() -> None:
    assert len(cut(list(straights([(1, 0, 0), (0, 0, 0)])))) == 2


@pytest.mark.parametrize("between", [Dwell(1.0), Halt("M1")])
def test_nothing_is_joined_across_a_rest(between: PathItem) -> None:
    items = [Straight((1.0, 0.0, 0.0), 30), between, Straight((2.0, 0.0, 0.0), 30)]
    found = list(pieces(items, XYZ, 0.5))
    assert [type(one) for one in found] == [Piece, type(between), Piece]


def test_items_of_different_feeds_are_not_joined() -> None:
    items: list[PathItem] = [
        Straight((float(i), 0.0, 0.0), f) for i, f in enumerate((30, 40, None))
    ]
    assert [piece.feed for piece in cut(items)] == [30, 40, None]


@pytest.mark.slow
def test_a_fine_circle_becomes_as_many_pieces_as_its_steps_can_tell() -> None:
    found = cut(list(straights(circle(10, 5000))))
    # A chord whose middle is half a step inside: 2 sqrt(2 r d) with r = 4000 and d = 0.5 steps.
    chords = 2 * math.pi * 4000 / (2 * math.sqrt(2 * 4000 * 0.5))
    assert chords * 0.7 < len(found) < chords * 1.5
    assert sum(piece.length for piece in found) == pytest.approx(2 * math.pi * 10, rel=1e-5)


def test_a_piece_takes_in_no_more_than_a_certain_number_of_items() -> None:
    found = cut(list(straights((i / 100, 0, 0) for i in range(1, 1001))))
    assert max(b - a + 1 for a, b in (piece.lines for piece in found)) == JOINED_MAX


@pytest.mark.slow
@given(wanderings())
def test_pieces_end_where_the_path_ends_and_are_as_long(items: list[PathItem]) -> None:
    ends = [item.to for item in items if isinstance(item, Straight)]
    found = cut(items)
    assert found[-1:] == [] or found[-1].way[-1] == ends[-1]
    assert {point for piece in found for point in piece.way} <= set(ends)
    length = sum(map(math.dist, [(0.0, 0.0, 0.0), *ends], ends))
    assert sum(piece.length for piece in found) == pytest.approx(length)


@pytest.mark.slow
@given(wanderings(), st.floats(0, 3))
def test_no_point_left_out_is_further_off_than_allowed(
    items: list[PathItem], within: float
) -> None:
    begin: tuple[float, ...] = (0.0, 0.0, 0.0)
    for piece in cut(items, within):
        way = [math.dist(begin, piece.way[-1])]
        for point in piece.way[:-1]:
            along = sum(
                (one - at) * (end - at)
                for one, end, at in zip(point, piece.way[-1], begin, strict=True)
            ) / (way[0] ** 2)
            for one, end, at in zip(point, piece.way[-1], begin, strict=True):
                assert abs(one - at - along * (end - at)) * 400 <= within + 1e-6
        begin = piece.way[-1]


@pytest.mark.parametrize(
    ("item", "told"),
    [
        (
            Straight((1.0, 2.0), 30, 7),
            "a position has one finite figure for each of 3 axes, line 7",
        ),
        (Straight((1.0, 2.0, math.nan), 30, 7), "a position has one finite figure"),
        (Straight((1.0, 2.0, 3.0), 0, 8), "a feed is some mm/min, line 8, got 0"),
        (Straight((1.0, 2.0, 3.0), math.inf, 8), "a feed is some mm/min, line 8, got inf"),
    ],
)
def test_an_item_that_makes_no_sense_is_refused_with_its_line(item: Straight, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        cut([item])


@pytest.mark.slow
def test_a_path_that_wriggles_within_a_step_for_ever_is_not_kept() -> None:
    items = (Straight((0.0001 * (i % 3), 0.0, 0.0), 30) for i in range(20_000))
    tracemalloc.start()
    for _ in stretches(pieces(items, XYZ, 0.5), XYZ):
        pass
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # The items would take some 4 MB; what is left is Python's own spare tuples.
    assert peak < 500_000
