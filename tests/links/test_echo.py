"""Own bytes taken out of what an adapter hears, whatever else is on the line."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sacbus.links.echo import ANCHOR, BOUND, GRACE, SLIP, Echo

BYTE = 260_417  # ns at 38400 baud
PACKET = b"\x02\x55\x01m3000a2d1\x03\x7f\x00"
ACK = b"\x02\x01\x0a\x06"

chunks = st.binary(min_size=1, max_size=40)


def later(count: int) -> int:
    """An instant after so many bytes and the grace."""
    return count * BYTE + GRACE


def split(data: bytes, cuts: list[int]) -> list[bytes]:
    """Data in pieces, cut at these places; as a port hands on what it has."""
    at = sorted({cut % (len(data) + 1) for cut in cuts} | {0, len(data)})
    return [data[one:other] for one, other in pairwise(at)]


def hear(echo: Echo, data: bytes, cuts: list[int]) -> bytes:
    return b"".join(echo.heard(piece) for piece in split(data, cuts))


def told_apart(foreign: bytes, own: bytes) -> bool:
    """Whether what is foreign looks like no part of the beginning of what is own."""
    marks = [own[at : at + ANCHOR] for at in range(SLIP + 1)]
    return (foreign + own).find(marks[0]) == len(foreign) and not any(
        len(mark) > 1 and (foreign + own).find(mark) < len(foreign) for mark in marks
    )


# ------------------------------------------------------------------------ a line without faults


def test_what_is_heard_before_anything_was_sent_is_foreign() -> None:
    assert Echo(BYTE).heard(PACKET) == PACKET


@pytest.mark.parametrize("size", [1, 2, len(PACKET)])
def test_own_bytes_are_taken_out_and_what_follows_is_handed_on_at_once(size: int) -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    heard = [PACKET[at : at + size] for at in range(0, len(PACKET), size)]
    assert [echo.heard(piece) for piece in heard] == [b""] * len(heard)
    assert echo.heard(ACK) == ACK
    assert echo.due is None


@given(
    rounds=st.lists(st.tuples(st.binary(max_size=20), chunks), min_size=1, max_size=6),
    last=st.binary(max_size=20),
    cuts=st.lists(st.integers(0, 400), max_size=12),
)
def test_a_faultless_echo_leaves_exactly_what_others_said(
    rounds: list[tuple[bytes, bytes]], last: bytes, cuts: list[int]
) -> None:
    echo = Echo(BYTE)
    now = 0
    foreign = b""
    for others, own in rounds:
        assume(told_apart(others, own))
        echo.sent(own, now)
        foreign += hear(echo, others + own, cuts)
        now += 400 * BYTE
    foreign += echo.heard(last)
    assert foreign == b"".join(others for others, _ in rounds) + last
    assert (echo.collisions, echo.missing, echo.due) == (0, 0, None)


@given(
    own=st.lists(chunks, min_size=1, max_size=6),
    others=st.binary(max_size=20),
    cuts=st.lists(st.integers(0, 400), max_size=12),
)
def test_what_is_sent_without_a_pause_comes_back_without_one(
    own: list[bytes], others: bytes, cuts: list[int]
) -> None:
    assume(told_apart(others, b"".join(own)))
    echo = Echo(BYTE)
    for piece in own:
        echo.sent(piece, now=0)
    assert hear(echo, others + b"".join(own) + ACK, cuts) == others + ACK
    assert (echo.collisions, echo.missing) == (0, 0)


def test_others_may_speak_between_two_packets_whose_echoes_come_late() -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    echo.sent(ACK, now=100 * BYTE)
    others = bytes(range(100, 140))
    assert echo.heard(PACKET + others + ACK) == others
    assert (echo.collisions, echo.missing) == (0, 0)


def test_what_was_on_its_way_while_we_began_is_heard_in_its_order() -> None:
    echo = Echo(BYTE)
    echo.sent(b"ac", now=0)
    assert echo.heard(b"abac") == b"ab"
    assert echo.collisions == 0


@pytest.mark.parametrize(
    ("own", "heard", "foreign"),
    [
        (b"aaaa", [b"xaaa", b"a"], b"x"),  # not a beginning that was changed
        (b"\1\0\0\0", [b"\0\0", b"\1\0\0\0"], b"\0\0"),  # not an end whose beginning was lost
    ],
)
def test_what_looks_like_an_echo_with_a_fault_is_waited_with_while_it_may_be_another(
    own: bytes, heard: list[bytes], foreign: bytes
) -> None:
    echo = Echo(BYTE)
    echo.sent(own, now=0)
    assert b"".join(echo.heard(piece) for piece in heard) == foreign
    assert (echo.collisions, echo.missing, echo.due) == (0, 0, None)


# ------------------------------------------------------------------------------- changed bytes


@given(
    at=st.integers(0, len(PACKET) - 1), to=st.integers(0, 255), cuts=st.lists(st.integers(0, 40))
)
def test_a_changed_byte_is_one_collision_and_no_more(at: int, to: int, cuts: list[int]) -> None:
    assume(to not in PACKET)
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    heard = PACKET[:at] + bytes((to,)) + PACKET[at + 1 :]
    assert hear(echo, heard, cuts) + echo.settle(later(len(PACKET))) == b""
    assert (echo.collisions, echo.missing) == (1, 0)
    echo.sent(ACK, now=later(100))
    assert echo.heard(ACK + PACKET) == PACKET
    assert echo.collisions == 1


@given(first=st.integers(0, len(PACKET) - 1), count=st.integers(1, len(PACKET)))
def test_whatever_a_collision_has_changed_what_is_heard_next_is_whole(
    first: int, count: int
) -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    last = min(first + count, len(PACKET))
    spoilt = PACKET[:first] + bytes(200 + at for at in range(first, last)) + PACKET[last:]
    foreign = echo.heard(spoilt) + echo.settle(later(len(PACKET)))
    assert (foreign, echo.collisions, echo.missing) == (b"", last - first, 0)
    assert echo.heard(ACK) == ACK


def test_a_byte_that_was_changed_into_the_next_one_is_not_taken_for_lost() -> None:
    echo = Echo(BYTE)
    echo.sent(b"123456ca", now=0)
    assert [echo.heard(bytes((byte,))) for byte in b"123456aaX"] == [b""] * 8 + [b"X"]
    assert (echo.collisions, echo.missing) == (1, 0)


@pytest.mark.parametrize("at", range(1, len(PACKET) - 1))
def test_a_byte_that_the_receiver_lost_costs_nobody_else_one(at: int) -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    foreign = echo.heard(PACKET[:at] + PACKET[at + 1 :] + ACK) + echo.settle(later(40))
    assert foreign == ACK
    assert (echo.collisions, echo.missing) == (0, 1)


@pytest.mark.parametrize("at", range(len(PACKET)))
def test_a_byte_that_the_receiver_made_up_counts_as_foreign(at: int) -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    foreign = echo.heard(PACKET[:at] + b"\xee" + PACKET[at:] + ACK) + echo.settle(later(40))
    assert foreign[1:] == ACK
    assert echo.missing == 0
    # Within the first bytes, and before the last, it cannot be told which one was made up.
    if at == 0 or ANCHOR <= at < len(PACKET) - 1:
        assert (foreign[:1], echo.collisions) == (b"\xee", 0)


def test_what_was_on_its_way_is_told_from_a_packet_that_was_hit_at_its_beginning() -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    others = b"others speak"
    assert echo.heard(others + b"\xee" + PACKET[1:]) == others
    assert (echo.collisions, echo.missing) == (1, 0)


def test_a_single_byte_that_came_back_changed_is_a_collision() -> None:
    echo = Echo(BYTE)
    echo.sent(b"\x12", now=0)
    assert echo.heard(b"\x13") == b""
    assert echo.due is not None
    assert echo.settle(echo.due) == b""
    assert echo.collisions == 1


# -------------------------------------------------------------------- echoes that never come back


def test_an_echo_that_never_comes_is_given_up_and_hides_nothing() -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    assert echo.heard(b"an answer of another length") == b""
    due = echo.due
    assert due == later(len(PACKET))
    assert echo.settle(due - 1) == b""
    assert echo.settle(due) == b"an answer of another length"
    assert (echo.missing, echo.collisions, echo.unheard, echo.due) == (len(PACKET), 0, 1, None)
    assert echo.heard(PACKET) == PACKET


def test_echoes_that_never_come_are_counted_until_one_does() -> None:
    echo = Echo(BYTE)
    for turn in range(3):
        echo.sent(PACKET, now=turn * later(40))
        echo.settle((turn + 1) * later(40))
    assert echo.unheard == 3
    echo.sent(PACKET, now=3 * later(40))
    echo.heard(PACKET)
    assert echo.unheard == 0


def test_an_echo_that_breaks_off_is_given_up_and_what_comes_then_is_foreign() -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    assert echo.heard(PACKET[:5]) == b""
    assert echo.settle(later(len(PACKET))) == b""
    assert echo.missing == len(PACKET) - 5
    assert echo.heard(ACK) == ACK


def test_the_next_packet_does_not_wait_for_an_echo_that_was_given_up() -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    echo.sent(ACK, now=later(40))
    assert echo.settle(later(40)) == b""
    assert echo.heard(ACK + b"and on") == b"and on"
    assert echo.missing == len(PACKET)


def test_a_line_that_is_gone_has_no_echo_left() -> None:
    echo = Echo(BYTE)
    echo.sent(PACKET, now=0)
    assert echo.heard(b"\xee\xee") == b""
    assert echo.forget() == b"\xee\xee"
    assert echo.due is None
    assert echo.heard(PACKET) == PACKET


def test_sending_nothing_expects_nothing() -> None:
    echo = Echo(BYTE)
    echo.sent(b"", now=0)
    assert echo.due is None


# ------------------------------------------------------------------------------------- all inputs

steps = st.one_of(
    st.tuples(st.just("send"), st.binary(max_size=12)),
    st.tuples(st.just("hear"), st.binary(max_size=12)),
    st.tuples(st.just("echo"), st.binary(max_size=4)),
    st.tuples(st.just("wait"), st.binary(max_size=1)),
)


@given(st.lists(steps, max_size=40))
def test_whatever_happens_no_byte_is_lost_doubled_or_out_of_order(
    happened: list[tuple[str, bytes]],
) -> None:
    echo = Echo(BYTE)
    now = sent = 0
    said = heard = foreign = b""
    for what, data in happened:
        if what == "send":
            echo.sent(data, now)
            said += data
            sent += len(data)
        elif what == "wait":
            now += GRACE // 2
            foreign += echo.settle(now)
        else:
            # What was said, with an accident in it, or something else.
            came = said[-6:] + data if what == "echo" else data
            heard += came
            foreign += echo.heard(came)
    foreign += echo.settle(now + later(sent + 1))
    assert echo.due is None
    assert len(foreign) == len(heard) - (sent - echo.missing)
    rest = iter(heard)
    assert all(byte in rest for byte in foreign)
    assert echo.collisions <= sent - echo.missing


def test_what_is_expected_and_what_is_held_are_bounded() -> None:
    echo = Echo(BYTE)
    for _ in range(5):
        echo.sent(b"x" * 40_000, now=0)
    assert echo._expected <= BOUND
    assert echo.missing >= 5 * 40_000 - BOUND
    heard = 0
    for _ in range(5):
        heard += len(echo.heard(bytes(40_000)))
    assert heard >= 5 * 40_000 - BOUND
    assert len(echo._held) <= BOUND
    assert heard + len(echo.settle(later(BOUND))) == 5 * 40_000


def test_a_receiver_that_slips_further_than_can_be_followed_costs_this_packet_only() -> None:
    echo = Echo(BYTE)
    own = bytes(range(1, 60))
    echo.sent(own, now=0)
    echo.heard(own[:10] + own[10 + SLIP + 1 :])
    echo.settle(later(60))
    assert echo.missing == SLIP + 1
    echo.sent(ACK, now=later(200))
    assert echo.heard(b"others" + ACK + b"others") == b"othersothers"
