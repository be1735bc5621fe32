"""One transmission: what arrives of it when others run into it."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.bus import Transmission
from sacbus.kernel import LineRate, Ns

RATE = LineRate()
START: Ns = 1_000
DATA = bytes(range(0x40, 0x60))


def transmission(data: bytes = DATA) -> Transmission:
    return Transmission(1, None, 0, START, data, RATE, START + RATE.span(len(data)), ())


def differing(sent: bytes, arrived: bytes) -> list[int]:
    return [at for at, (was, became) in enumerate(zip(sent, arrived, strict=True)) if was != became]


def touched(hits: list[tuple[Ns, Ns]], size: int) -> list[int]:
    """Bytes that share any instant with a hit, looked at one by one."""
    return [
        at
        for at in range(size)
        if any(
            begin < START + RATE.span(at + 1) and end > START + RATE.span(at) for begin, end in hits
        )
    ]


#: Spans that begin no earlier than the transmission, as the medium gives them; not empty.
HITS = st.lists(
    st.tuples(
        st.one_of(
            st.integers(0, RATE.span(len(DATA))),
            st.builds(
                lambda at, off: max(0, RATE.span(at) + off),
                st.integers(0, len(DATA)),
                st.integers(-2, 2),
            ),
        ),
        st.one_of(st.integers(1, 3), st.integers(1, 2_000_000)),
    ).map(lambda hit: (START + hit[0], START + hit[0] + hit[1])),
    max_size=5,
)


def test_what_nobody_touched_arrives_as_it_was_sent() -> None:
    sent = transmission()
    assert not sent.collided
    assert sent.arrived(0, len(DATA), 0) == DATA
    assert sent.arrived(3, 5, 0) == DATA[3:5]


def test_only_the_first_hit_is_news() -> None:
    sent = transmission()
    assert sent.hit(START, START + 1)
    assert not sent.hit(START, START + 1)
    assert sent.collided


@given(HITS, st.integers(0, 2**32))
def test_every_byte_that_was_touched_is_another_and_no_other_is(
    hits: list[tuple[Ns, Ns]], seed: int
) -> None:
    sent = transmission()
    for begin, end in hits:
        sent.hit(begin, end)
    arrived = sent.arrived(0, len(DATA), seed)
    assert differing(DATA, arrived) == touched(hits, len(DATA))


@pytest.mark.slow
@given(HITS, st.lists(st.integers(0, len(DATA))), st.integers(0, 2**32))
def test_everybody_hears_the_same_however_often_and_in_whatever_pieces(
    hits: list[tuple[Ns, Ns]], stops: list[int], seed: int
) -> None:
    whole, pieces = transmission(), transmission()
    for begin, end in hits:
        whole.hit(begin, end)
        pieces.hit(begin, end)
    expected = whole.arrived(0, len(DATA), seed)
    bounds = [0, *sorted(stops), len(DATA)]
    heard = [pieces.arrived(first, last, seed) for first, last in pairwise(bounds)]
    assert b"".join(heard) == expected
    assert pieces.arrived(0, len(DATA), seed) == expected


def test_what_had_arrived_before_the_overlap_had_arrived() -> None:
    sent = transmission()
    first = sent.arrived(0, 4, 1)
    sent.hit(START + RATE.span(4), START + RATE.span(6))
    assert first == DATA[:4]
    assert differing(DATA, sent.arrived(0, len(DATA), 1)) == [4, 5]


def test_a_touched_byte_may_become_any_other_value() -> None:
    values = set()
    for seed in range(5_000):
        sent = transmission(b"\x02")
        sent.hit(START, START + 1)
        values |= set(sent.arrived(0, 1, seed))
    assert values == set(range(256)) - {2}


def test_two_transmissions_that_collide_are_not_spoilt_alike() -> None:
    first = transmission()
    second = Transmission(2, None, 0, START, DATA, RATE, START + RATE.span(len(DATA)), ())
    for one in (first, second):
        one.hit(START, START + RATE.span(len(DATA)))
    assert first.arrived(0, len(DATA), 0) != second.arrived(0, len(DATA), 0)


@given(HITS, st.integers(0, 2**32))
def test_bytes_without_a_stop_bit_are_among_those_that_were_touched(
    hits: list[tuple[Ns, Ns]], seed: int
) -> None:
    sent = transmission()
    assert sent.framing_errors(0, len(DATA), seed) is None
    for begin, end in hits:
        sent.hit(begin, end)
    framing = sent.framing_errors(0, len(DATA), seed) or bytes(len(DATA))
    assert {at for at, lacks in enumerate(framing) if lacks} <= set(touched(hits, len(DATA)))


def test_half_of_the_touched_bytes_have_no_stop_bit_and_those_sent_without_have_none() -> None:
    sent = transmission(DATA * 40)
    sent.hit(START, START + RATE.span(len(sent.data)))
    framing = sent.framing_errors(0, len(sent.data), 7)
    assert framing is not None
    assert 0.4 < sum(framing) / len(framing) < 0.6
    lacking = transmission()
    lacking.framing = b"\x01" * len(DATA)
    assert lacking.framing_errors(2, 5, 0) == b"\x01\x01\x01"
    lacking.hit(START, START + RATE.span(4))
    assert lacking.framing_errors(0, len(DATA), 0) == lacking.framing
