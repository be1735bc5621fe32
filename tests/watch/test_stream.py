"""From a decoder's places back to times, senders and what was talked over."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND
from sacbus.kernel import MS, LineRate
from sacbus.watch.stream import Stream, Stretch
from sacbus.wire import encode
from tests.bus.strategies import bursts
from tests.watch.rig import M400

RATE = LineRate()


def stream() -> Stream:
    return Stream(KIND.protocol, RATE)


def stretch(data: bytes, start: int = 0, *hits: tuple[int, int]) -> Stretch:
    return Stretch(start, start + RATE.span(len(data)), data, "somebody", hits)


def test_each_event_of_a_stretch_has_its_own_time() -> None:
    first, second = stream().hear(stretch(b"\x55\x55" + M400, MS))
    assert (first.start, first.end) == (MS, MS + RATE.span(2))
    assert (second.start, second.end) == (MS + RATE.span(2), MS + RATE.span(12))
    assert (first.raw, second.raw) == (b"\x55\x55", M400)


def test_an_event_over_several_stretches_begins_in_one_and_ends_in_another() -> None:
    heard = stream()
    pieces = [stretch(M400[:3], 0), stretch(M400[3:4], 5 * MS), stretch(M400[4:], 9 * MS)]
    assert heard.hear(pieces[0]) == heard.hear(pieces[1]) == []
    assert heard.pending == M400[:4]
    (event,) = heard.hear(pieces[2])
    assert (event.start, event.end, event.raw) == (0, pieces[2].end, M400)
    assert (event.began_in, event.ended_in) == (pieces[0], pieces[2])


def test_a_stretch_that_came_too_fast_is_divided_evenly() -> None:
    _, second = stream().hear(Stretch(100, 300, b"\x55" * 10 + M400))
    assert (second.start, second.end) == (200, 300)


def test_only_what_was_talked_over_is_spoilt() -> None:
    for hit in ((RATE.span(10), RATE.span(20)), (RATE.span(12), RATE.span(12) + 1)):
        events = stream().hear(stretch(M400 * 3, 0, hit))
        assert [one.spoilt for one in events] == [False, True, False]


def test_an_event_with_bytes_that_nobody_could_talk_over_is_not_spoilt() -> None:
    heard = stream()
    heard.hear(stretch(M400[:5], 0, (0, RATE.span(5))))
    (event,) = heard.hear(stretch(M400[5:], 5 * MS))
    assert not event.spoilt


def test_what_is_given_up_is_garbage_and_forgotten() -> None:
    heard = stream()
    heard.hear(stretch(M400[:4], MS))
    assert heard.unfinished
    event = heard.give_up("unfinished")
    assert event is not None
    assert (event.said.kind, event.said.words, event.raw) == ("garbage", "unfinished", M400[:4])
    assert (event.start, event.end) == (MS, MS + RATE.span(4))
    assert (heard.pending, heard.unfinished) == (b"", False)
    assert heard.give_up("unfinished") is None
    (event,) = heard.hear(stretch(encode(0, 1, b"S"), 5 * MS))
    assert event.start == 5 * MS


@given(st.lists(bursts, max_size=30))
def test_it_keeps_no_more_than_what_is_pending(pieces: list[bytes]) -> None:
    heard = stream()
    for number, data in enumerate(pieces):
        heard.hear(stretch(data, number * MS))
        assert sum(len(one.data) for _, one in heard._kept) >= len(heard.pending)
        assert len(heard._kept) <= max(len(heard.pending), 0)
