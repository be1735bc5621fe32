"""The quadrature decoder."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nodes.sac.encoder import Encoder

CLOCKWISE = [(0, 1), (0, 0), (1, 0), (1, 1)]
BACK = [(1, 0), (0, 0), (0, 1), (1, 1)]


def detents(encoder: Encoder, levels: list[tuple[int, int]]) -> list[int]:
    return [encoder.drive(a, b) for a, b in levels]


def test_four_quarters_are_one_detent_either_way() -> None:
    encoder = Encoder()
    assert detents(encoder, CLOCKWISE * 2) == [0, 0, 0, 1] * 2
    assert detents(encoder, BACK * 2) == [0, 0, 0, -1] * 2


def test_a_contact_that_bounces_counts_nothing() -> None:
    encoder = Encoder()
    assert detents(encoder, [(0, 1), (1, 1)] * 20) == [0] * 40
    assert detents(encoder, CLOCKWISE) == [0, 0, 0, 1]


def test_the_same_levels_again_and_both_at_once_say_nothing() -> None:
    encoder = Encoder()
    assert detents(encoder, [(1, 1), (0, 0), (0, 0), (1, 1)]) == [0] * 4
    assert detents(encoder, CLOCKWISE) == [0, 0, 0, 1]


@given(st.lists(st.sampled_from([1, -1])))
def test_detents_are_the_quarters_turned_to_within_one(steps: list[int]) -> None:
    encoder = Encoder()
    turn = [(1, 1), *CLOCKWISE[:3]]
    at = turned = 0
    for step in steps:
        at += step
        turned += encoder.drive(*turn[at % 4])
        assert abs(4 * turned - at) < 4
