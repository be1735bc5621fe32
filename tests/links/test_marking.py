"""Ninth bits as mark and space parity: runs of bytes that have one in common."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from sacbus.links.marking import PARITIES, runs


def test_each_run_has_the_parity_that_makes_its_ninth_bit() -> None:
    assert list(runs(b"abcd", bytes((1, 0, 0, 1)))) == [("M", b"a"), ("S", b"bc"), ("M", b"d")]
    assert list(runs(b"", b"")) == []


@given(st.lists(st.tuples(st.integers(0, 255), st.integers(0, 1))))
def test_nothing_is_lost_and_neighbours_differ(pairs: list[tuple[int, int]]) -> None:
    data, ninth = bytes(one for one, _ in pairs), bytes(bit for _, bit in pairs)
    found = list(runs(data, ninth))
    assert b"".join(run for _, run in found) == data
    assert b"".join(bytes((PARITIES.index(p),)) * len(run) for p, run in found) == ninth
    assert all(left != right for (left, _), (right, _) in pairwise(found))
