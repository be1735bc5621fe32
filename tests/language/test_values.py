from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, dataclass

import pytest

from sacbus.language.values import maker


@dataclass(frozen=True, slots=True)
class Pair:
    left: int
    right: str = "nothing"


make_pair = maker(Pair)


def test_what_a_maker_makes_is_the_frozen_value_itself() -> None:
    made = make_pair(1, right="two")
    assert type(made) is Pair
    assert made == Pair(1, "two")
    assert hash(made) == hash(Pair(1, "two"))
    assert repr(made) == repr(Pair(1, "two"))
    assert pickle.loads(pickle.dumps(made)) == made  # noqa: S301 (our own bytes)


def test_what_a_maker_makes_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        make_pair(1).left = 2  # type: ignore[misc]


def test_a_maker_fills_in_the_defaults() -> None:
    assert make_pair(1) == Pair(1)


def test_a_maker_wants_what_the_class_wants() -> None:
    with pytest.raises(TypeError, match="left"):
        make_pair()  # type: ignore[call-arg]
