"""Two sequences side by side: what is missing or too much is told, and nothing behind it."""

from __future__ import annotations

from itertools import accumulate
from random import Random

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
        # What came in time between two that did not is no other one, and not missing.
        ("abcdefghij", " b defghij", [(0, "a", NOTHING), (200, "c", NOTHING)]),
        ("abcdefghij", "a c efghij", [(100, "b", NOTHING), (300, "d", NOTHING)]),
        ("pqpqpqpqpq", "pqpq q qpq", [(400, "p", NOTHING), (600, "p", NOTHING)]),
        ("aaaaaa", "     a", [(100 * at, "a", NOTHING) for at in range(5)]),
        ("abcdefghij", "abxde yhij", [(200, "c", "x"), (500, "f", NOTHING), (600, "g", "y")]),
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


@st.composite
def with_some_of_it(draw: st.DrawFn) -> tuple[list[Entry], set[int]]:
    """A sequence of few or of many words at times of all kinds, and some places of it."""
    words = st.integers(0, draw(st.sampled_from([0, 1, 2, 7, 1_000])))
    said = draw(st.lists(st.tuples(st.integers(1, 50), words), min_size=1, max_size=80))
    times = accumulate(apart for apart, _ in said)
    sequence = [Entry(when * MS, f"w{word}") for when, (_, word) in zip(times, said, strict=True)]
    return sequence, draw(st.sets(st.integers(0, len(sequence) - 1), max_size=5))


@given(with_some_of_it())
def test_several_that_are_missing_or_too_much_are_all_that_is_told(
    drawn: tuple[list[Entry], set[int]],
) -> None:
    sequence, places = drawn
    fewer = [one for place, one in enumerate(sequence) if place not in places]
    some = [sequence[place] for place in sorted(places)]
    assert list(walk(sequence, fewer, 0)) == [(one.when, one.words, NOTHING) for one in some]
    assert list(walk(fewer, sequence, 0)) == [(one.when, NOTHING, one.words) for one in some]


@given(with_some_of_it(), st.data())
def test_of_what_came_in_time_nothing_is_told_whatever_is_missing_or_put_in(
    drawn: tuple[list[Entry], set[int]], data: st.DataObject
) -> None:
    sequence, gone = drawn
    put_in = data.draw(st.sets(st.integers(0, len(sequence) - 1), max_size=5))
    got = []
    for place, one in enumerate(sequence):
        if place in put_in:
            got.append(Entry(one.when - MS // 2, f"put in {place}"))
        if place not in gone:
            got.append(one)
    missing = {(sequence[place].when, sequence[place].words) for place in gone}
    found = list(walk(sequence, got, 0))
    assert {(when, one) for when, one, _ in found if one != NOTHING} == missing
    extra = [other for _, _, other in found if other != NOTHING]
    assert extra == [f"put in {place}" for place in sorted(put_in)]


@given(
    st.lists(st.integers(1, 50), min_size=1, max_size=80),
    st.dictionaries(st.integers(0, 79), st.integers(1, 200), max_size=3),
)
def test_each_that_is_put_in_and_shifts_the_rest_is_told_and_each_shift(
    apart: list[int], put_in: dict[int, int]
) -> None:
    expected = [Entry(when * MS, f"{place}") for place, when in enumerate(accumulate(apart))]
    got, shift = [], 0
    for place, one in enumerate(expected):
        if place in put_in:
            got.append(Entry(one.when + shift, "!"))
            shift += put_in[place] * MS
        got.append(Entry(one.when + shift, one.words))
    extra = sum(place < len(expected) for place in put_in)
    found = list(walk(expected, got, 0))
    assert [other for _, one, other in found if one == NOTHING] == ["!"] * extra
    assert len(found) == 2 * extra


def test_some_20_of_a_loop_are_missing_and_not_late() -> None:
    expected = entries("pq" * 40)
    missing = [(one.when, one.words, NOTHING) for one in expected[20:42]]
    assert list(walk(expected, expected[:20] + expected[42:], 0)) == missing


@pytest.mark.parametrize("seed", range(5))
def test_a_shift_beyond_what_entries_are_apart_is_seen_by_rows_that_are_said_once(
    seed: int,
) -> None:
    text = "".join(Random(seed).choices("abcdefgh", k=60))
    got = [*entries(text[:30]), Entry(3_050 * MS, "!"), *entries(text[30:], since=3_130)]
    assert [other for _, _, other in told(entries(text), got)] == [
        "!",
        f"{text[30]} +{130 * MS} ns off",
    ]


def test_a_loop_behind_something_else_is_found_as_late_as_all_is() -> None:
    loop = "pqr" * 30
    expected = entries("abcd" + "x" * 20 + loop)
    got = entries("abcd" + "y" * 20 + loop, since=1_000)
    found = told(expected, got)
    assert found[0] == (0, "a", f"a +{1_000 * MS} ns off")
    assert [pair for _, *pair in found[1:]] == [["x", "y"]] * 20


class Words(str):
    """Words that count how often they are looked at."""

    __slots__ = ()
    looks = 0

    def __eq__(self, other: object) -> bool:
        Words.looks += 1
        return str.__eq__(self, other)

    def __hash__(self) -> int:
        Words.looks += 1
        return str.__hash__(self)


@pytest.mark.parametrize(
    ("ours", "theirs", "jitter", "most"),
    [
        (("a{at}", "a{at}"), ("b{at}", "b{at}"), 0, 200),
        (("a", "b"), ("a", "b"), 5_000, 5),
        (("a{at}", "p"), ("b{at}", "p"), 0, 400),
    ],
    ids=["all other words", "all jitters", "every second is another one"],
)
def test_the_work_grows_as_the_sequences_do(
    ours: tuple[str, str], theirs: tuple[str, str], jitter: int, most: int
) -> None:
    random, count = Random(3), 2_000
    both = []
    for words in (ours, theirs):
        said = [Words(words[at % 2].format(at=at)) for at in range(count)]
        whens = [at * MS + random.randrange(jitter + 1) for at in range(count)]
        both.append([Entry(*one) for one in zip(whens, said, strict=True)])
    Words.looks = 0
    assert len(list(walk(both[0], both[1], 0))) >= count // 2
    assert Words.looks < most * count
