"""Two sequences side by side: what is missing or too much is told, and nothing behind it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.trace.alignment import NOTHING, Entry, walk

MS = 1_000_000


def entries(text: str, every: int = 100, since: int = 0) -> list[Entry]:
    """A letter an entry, so many ms apart; a space takes the time of one and is none."""
    return [
        Entry((since + every * place) * MS, letter)
        for place, letter in enumerate(text)
        if letter != " "
    ]


def told(expected: list[Entry], got: list[Entry], within: int = 0) -> list[tuple[int, str, str]]:
    return [(when // MS, one, other) for when, one, other in walk(expected, got, within * MS)]


@pytest.mark.parametrize(
    ("expected", "got", "found"),
    [
        ("abcdefg", "abcdefg", []),
        ("abc efg", "abcdefg", [(300, NOTHING, "d")]),
        ("abcdefg", "abc efg", [(300, "d", NOTHING)]),
        ("abcdefg", "abcxefg", [(300, "d", "x")]),
        ("abc", "abcd", [(300, NOTHING, "d")]),
        ("abcd", "abc", [(300, "d", NOTHING)]),
        ("abcd", "", [(100 * at, one, NOTHING) for at, one in enumerate("abcd")]),
        # Of two alike it is told which of them has no like at its time.
        ("aaa aaa", "aaaaaaa", [(300, NOTHING, "a")]),
        ("aaaaaaa", "aaa aaa", [(300, "a", NOTHING)]),
    ],
)
def test_what_has_no_like_is_told_where_it_stands(
    expected: str, got: str, found: list[tuple[int, str, str]]
) -> None:
    assert told(entries(expected), entries(got)) == found


@pytest.mark.parametrize("within", [0, 5])
def test_what_makes_all_the_rest_later_is_told_and_the_shift_once(within: int) -> None:
    before, after = entries("abcd"), "efghijklmnopqrstuvwxyz" * 4
    later = [Entry(450 * MS, "!"), Entry(451 * MS, "?")]
    got = before + later + entries(after, since=408)
    assert told(before + entries(after, since=400), got, within) == [
        (450, NOTHING, "!"),
        (451, NOTHING, "?"),
        (400, "e", f"e +{8 * MS} ns off"),
    ]


def test_one_of_many_that_are_alike_is_found_though_it_makes_the_rest_later() -> None:
    expected = entries("a." * 20, every=500)
    got = entries("a." * 10, every=500) + entries("a.", every=2, since=9_700)
    got += entries("a." * 10, every=500, since=10_004)
    assert told(expected, got) == [
        (9_700, NOTHING, "a"),
        (9_702, NOTHING, "."),
        (10_000, "a", f"a +{4 * MS} ns off"),
    ]


def test_a_shift_that_grows_beyond_the_tolerance_is_told_again() -> None:
    expected, got = entries("abcdef"), entries("abcdef", every=103)
    whens = [when for when, _, _ in told(expected, got, within=5)]
    assert whens == [200, 400]
    assert told(expected, got, within=15) == []


def test_one_that_comes_back_in_time_may_be_late_anew() -> None:
    expected = entries("abcdef")
    offs = [0, 9, 9, 0, 9, 0]
    late = [Entry(one.when + off * MS, one.words) for one, off in zip(expected, offs, strict=True)]
    assert [when for when, _, _ in told(expected, late)] == [100, 400]


def test_two_that_jitter_are_late_and_not_missing() -> None:
    expected = entries("aaaa", every=2)
    got = [Entry(one.when + off * MS, "a") for one, off in zip(expected, [0, 1, 1, 0], strict=True)]
    assert all(NOTHING not in pair for _, *pair in told(expected, got))


@pytest.mark.parametrize("shift", [0, 7])
def test_very_much_more_is_followed_after_a_while(shift: int) -> None:
    before, after = entries("abcd"), [Entry(one * MS, f"{one}") for one in range(400, 900)]
    more = [Entry(300 * MS + one, f"more {one}") for one in range(50)]
    later = [Entry(one.when + shift * MS, one.words) for one in after]
    found = told(before + after, before + more + later)
    assert len(found) < 2 * 16 + 50 + 2
    assert {other for _, one, other in found if one == NOTHING} & {one.words for one in more}


sequences = st.lists(st.sampled_from("abc"), max_size=40).map("".join)


@given(sequences)
def test_what_is_the_same_has_no_difference(text: str) -> None:
    assert told(entries(text), entries(text)) == []


@given(sequences, sequences, st.integers(0, 3))
def test_every_entry_is_paired_or_told(one: str, other: str, late: int) -> None:
    expected, got = entries(one), entries(other, every=100 + late)
    found = told(expected, got)
    missing = sum(words != NOTHING and got_words == NOTHING for _, words, got_words in found)
    extra = sum(words == NOTHING for _, words, _ in found)
    assert len(expected) - missing == len(got) - extra
    assert bool(found) is (one != other or (late > 0 and len(one) > 1))
    assert all(words != got_words for _, words, got_words in found)


@given(
    st.lists(st.sampled_from("abcdefgh"), min_size=4, max_size=60).map("".join),
    st.data(),
)
def test_one_that_is_put_in_anywhere_is_all_that_is_told(text: str, data: st.DataObject) -> None:
    place = data.draw(st.integers(0, len(text)))
    shift = data.draw(st.sampled_from([0, 4]))
    expected = entries(text)
    later = [Entry(one.when + shift * MS, one.words) for one in expected[place:]]
    extra = Entry(expected[place].when - 30 * MS if place < len(text) else 10**10, "!")
    found = list(walk(expected, [*expected[:place], extra, *later], 0))
    assert found[0] == (extra.when, NOTHING, "!")
    assert len(found) == 1 + bool(shift and later)
