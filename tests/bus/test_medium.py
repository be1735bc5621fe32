"""The line: when bytes arrive where, and what becomes of those that overlap."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND
from sacbus.bus import Bus, Medium, Transmission
from sacbus.kernel import MS, Kernel, LineRate, Ns
from sacbus.node import Heard
from tests.nodes.sac.bench import packet

RATE = LineRate()


def run_of(size: int, filler: bytes = b"A") -> bytes:
    """Bytes that begin like a packet and hold no ETX: everybody hears them in one piece."""
    return b"\x02".ljust(size, filler)


class Ear:
    """A listener that keeps all it hears, with its times."""

    def __init__(self) -> None:
        self.heard: list[tuple[Ns, Ns, bytes]] = []

    def hear(self, heard: Heard, now: Ns) -> None:
        assert now == heard.ends(len(heard.data) - 1)
        self.heard.append((heard.begins(0), now, heard.data))

    @property
    def data(self) -> bytes:
        return b"".join(data for _, _, data in self.heard)


def line(lanes: int = 1, seed: int = 0) -> tuple[Kernel, Medium]:
    """A line without nodes."""
    kernel = Kernel()
    return kernel, Bus(kernel, KIND.protocol, lanes=lanes, seed=seed).medium


def listening(medium: Medium, lane: int = 0, owner: object = None) -> Ear:
    ear = Ear()
    medium.listen(lane, ear, owner)
    return ear


@pytest.mark.parametrize("lanes", [0, 3, -1])
def test_a_line_has_one_lane_or_two(lanes: int) -> None:
    with pytest.raises(ValueError, match=rf"lanes: expected 1 or 2, got {lanes}"):
        Bus(Kernel(), KIND.protocol, lanes=lanes)


def test_on_one_lane_everybody_talks_and_listens_on_it_and_on_two_the_nodes_have_their_own() -> (
    None
):
    assert (line(1)[1].master_lane, line(1)[1].node_lane, line(1)[1].lanes) == (0, 0, 1)
    assert (line(2)[1].master_lane, line(2)[1].node_lane, line(2)[1].lanes) == (0, 1, 2)


# ---- line time ----------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1, 2, 20, 63, 64, 1000])
def test_bytes_take_ten_bits_each_and_are_heard_when_the_last_has_ended(size: int) -> None:
    kernel, medium = line()
    ear = listening(medium)
    kernel.run_until(5 * MS)
    sent = medium.transmit(object(), run_of(size), 0)
    assert (sent.start, sent.end) == (5 * MS, 5 * MS + RATE.span(size))
    kernel.run_until(sent.end - 1)
    assert ear.heard == []
    kernel.run_until(sent.end)
    assert ear.heard == [(sent.start, sent.end, run_of(size))]


def test_listeners_hear_packets_that_follow_each_other_one_by_one() -> None:
    kernel, medium = line()
    ear = listening(medium)
    first, second = packet("m200"), packet("v100", 10)
    medium.transmit(object(), first + second + first, 0)
    kernel.run()
    assert [data for _, _, data in ear.heard] == [first, second, first]


def test_a_line_is_free_when_the_last_of_all_transmissions_ends() -> None:
    kernel, medium = line()
    assert medium.free_at(0) is None
    long = medium.transmit(object(), b"A" * 50, 0)
    kernel.run_until(long.end // 2)
    medium.transmit(object(), b"B", 0)
    assert medium.free_at(0) == long.end
    kernel.run()
    assert medium.free_at(0) == long.end


def test_one_does_not_hear_oneself_and_others_do() -> None:
    kernel, medium = line()
    me, other = object(), object()
    mine, theirs = listening(medium, owner=me), listening(medium, owner=other)
    medium.transmit(me, b"AB", 0)
    kernel.run()
    assert (mine.data, theirs.data) == (b"", b"AB")


def test_a_listener_that_left_hears_no_more_and_leaving_twice_is_no_mistake() -> None:
    kernel, medium = line()
    gone, stays = listening(medium), listening(medium)
    medium.transmit(object(), b"A", 0)
    kernel.run()
    medium.unlisten(0, gone)
    medium.unlisten(0, gone)
    medium.transmit(object(), b"B", 0)
    kernel.run()
    assert (gone.data, stays.data) == (b"A", b"AB")


def test_a_listener_may_leave_while_it_hears() -> None:
    kernel, medium = line()

    class Once(Ear):
        def hear(self, heard: Heard, now: Ns) -> None:
            super().hear(heard, now)
            medium.unlisten(0, self)

    once = Once()
    medium.listen(0, once, None)
    stays = listening(medium)
    for _ in range(2):
        medium.transmit(object(), b"A", 0)
        kernel.run()
    assert (once.data, stays.data) == (b"A", b"AA")


def test_watchers_see_each_transmission_once_when_it_is_over() -> None:
    kernel, medium = line(lanes=2)
    seen: list[tuple[Ns, Transmission]] = []
    medium.watchers.append(lambda sent: seen.append((kernel.now, sent)))
    first = medium.transmit(object(), packet("m1") + packet("m2"), 0)
    second = medium.transmit(object(), b"A", 1)
    kernel.run()
    assert seen == [(second.end, second), (first.end, first)]


# ---- collisions ---------------------------------------------------------------------------------


def test_transmissions_on_different_lanes_never_collide() -> None:
    kernel, medium = line(lanes=2)
    ears = listening(medium, 0), listening(medium, 1)
    medium.transmit(object(), b"AAAA", 0)
    medium.transmit(object(), b"BBBB", 1)
    kernel.run()
    assert [ear.data for ear in ears] == [b"AAAA", b"BBBB"]
    assert [medium.counters(lane).collided for lane in (0, 1)] == [0, 0]
    assert [medium.counters(lane).transmissions for lane in (0, 1)] == [1, 1]


def test_a_transmission_that_begins_as_another_ends_does_not_touch_it() -> None:
    kernel, medium = line()
    ear = listening(medium)
    first = medium.transmit(object(), b"AAAA", 0)
    kernel.at(first.end, medium.transmit, object(), b"BBBB", 0)
    kernel.run()
    assert ear.data == b"AAAABBBB"
    assert medium.counters().collided == 0


def test_one_nanosecond_earlier_the_last_byte_and_the_first_are_lost() -> None:
    kernel, medium = line()
    ear = listening(medium)
    first = medium.transmit(object(), run_of(4), 0)
    kernel.at(first.end - 1, medium.transmit, object(), run_of(4, b"B"), 0)
    kernel.run()
    one, two = (data for _, _, data in ear.heard)
    assert one[:3] == b"\x02AA"
    assert one[3:] != b"A"
    assert two[:1] != b"\x02"
    assert two[1:] == b"BBB"
    assert medium.counters().collided == 2


def test_each_of_several_that_overlap_counts_once() -> None:
    kernel, medium = line()
    for at in (0, 100_000, 200_000):
        kernel.at(at, medium.transmit, object(), b"A" * 10, 0)
    kernel.at(50 * MS, medium.transmit, object(), b"A" * 10, 0)
    kernel.run()
    counters = medium.counters()
    assert (counters.transmissions, counters.bytes, counters.collided) == (4, 40, 3)
    assert counters.busy == 4 * RATE.span(10)


def test_what_was_delivered_before_the_overlap_stays_delivered() -> None:
    kernel, medium = line()
    ear = listening(medium)
    first, second = packet("m200"), packet("m300")
    medium.transmit(object(), first + second, 0)
    # Into the last instant of the second packet's CRC.
    kernel.at(RATE.span(len(first + second) - 1) - 1, medium.transmit, object(), b"X", 0)
    kernel.run()
    assert ear.heard[0] == (0, RATE.span(len(first)), first)
    rest = next(data for start, _, data in ear.heard if start == RATE.span(len(first)))
    assert rest[:-2] == second[:-2]
    assert rest[-2] != second[-2]
    assert rest[-1] != second[-1]


TALK = st.lists(
    st.tuples(
        st.one_of(st.integers(0, 8 * MS), st.integers(0, 30).map(RATE.span)),
        st.integers(1, 24),
    ),
    min_size=1,
    max_size=6,
)


@given(TALK, st.integers(0, 2**16))
def test_whoever_overlaps_exactly_the_bytes_that_were_touched_differ(
    talk: list[tuple[Ns, int]], seed: int
) -> None:
    kernel, medium = line(seed=seed)
    done: list[Transmission] = []
    medium.watchers.append(done.append)
    ear = listening(medium)
    for when, size in talk:
        kernel.at(when, medium.transmit, object(), run_of(size), 0)
    kernel.run()
    assert len(done) == len(talk) == len(ear.heard)
    spans = [(sent.start, sent.end) for sent in done]
    for at, sent in enumerate(done):
        others = spans[:at] + spans[at + 1 :]
        arrived = ear.heard[at][2]
        for index, byte in enumerate(arrived):
            begin, end = sent.start + RATE.span(index), sent.start + RATE.span(index + 1)
            struck = any(first < end and last > begin for first, last in others)
            assert (byte != sent.data[index]) == struck
        assert sent.collided == any(
            first < sent.end and last > sent.start for first, last in others
        )
    assert medium.counters().collided == sum(sent.collided for sent in done)


def test_the_same_seed_spoils_bytes_the_same_way_and_another_seed_otherwise() -> None:
    def run(seed: int) -> bytes:
        kernel, medium = line(seed=seed)
        ear = listening(medium)
        medium.transmit(object(), b"A" * 20, 0)
        medium.transmit(object(), b"A" * 20, 0)
        kernel.run()
        return ear.data

    assert run(1) == run(1) != run(2)
