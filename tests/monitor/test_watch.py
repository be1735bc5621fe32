"""The monitor's core: what belongs together, and what is certain when."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND
from sacbus.bus import (
    BitErrors,
    Dead,
    Delay,
    Drop,
    Duplicate,
    Fault,
    LateDirection,
    WrongBaud,
)
from sacbus.feed import Sent
from sacbus.kernel import MS, SECOND, LineRate, Ns
from sacbus.monitor.entries import Collision, Entry, Lost, Reported, Spoken, Unanswered
from sacbus.monitor.watch import LINK_SLACK, Watch
from sacbus.node import Report, ReportKind, Said
from sacbus.wire import ack, encode, nak
from tests.bus.strategies import bursts
from tests.monitor.rig import LINK, M400, Rig, told

RATE = LineRate()
#: The line's figures: 10 bits a byte at 38 400 baud, and the turnaround of a node (spec, wire).
FOUR_BYTES, EIGHT_BYTES, TEN_BYTES = 1_041_666, 2_083_333, 2_604_166
TURNAROUND = 385_000
SLACK = 10 * MS


def spoken(entry: Entry) -> Spoken:
    assert isinstance(entry, Spoken)
    return entry


# ------------------------------------------------------------------ requests and answers


def test_an_answer_is_told_with_its_request_and_its_delay() -> None:
    rig = Rig(10)
    rig.says(M400, at=5 * MS)
    asked, answered = rig.run()
    assert asked == Spoken(
        5 * MS,
        5 * MS + TEN_BYTES,
        None,
        0,
        LINK,
        Said("packet", 1, 10, b"m400", "move 400 full steps", "right", 10, TURNAROUND),
        M400,
    )
    start = 5 * MS + TEN_BYTES + TURNAROUND
    assert answered == Spoken(
        start,
        start + FOUR_BYTES,
        TURNAROUND,
        0,
        "node 10",
        Said("ack", 10, 1, b"", "ACK", "", 4),
        ack(1, 10),
        asked,
        TURNAROUND,
    )


def test_a_packet_with_a_wrong_crc_is_told_and_so_is_the_nak_that_answers_it() -> None:
    rig = Rig(10)
    rig.says(M400[:-2] + b"\x55\x00", at=0)
    asked, report, answer = rig.run()
    assert told([report]) == ["report 10"]
    assert (spoken(asked).said.kind, spoken(asked).said.verdict) == ("packet", "wrong")
    answered = spoken(answer)
    assert (answered.said.kind, answered.request, answered.delay) == ("nak", asked, TURNAROUND)


def test_nobody_is_expected_to_answer_a_general_call() -> None:
    rig = Rig(10)
    rig.says(encode(0, 1, b"V100"), at=0)
    assert told(rig.run()) == ["packet 1>0"]


def test_silence_is_told_when_the_protocols_figures_are_over() -> None:
    rig = Rig(10)
    rig.says(encode(99, 1, b"m400"), at=0)
    due = TEN_BYTES + TURNAROUND + EIGHT_BYTES + SLACK
    assert told(rig.run(due - 1)) == ["packet 1>99"]
    assert rig.watch.wake_at() == due
    asked, silence = rig.run(due)
    assert silence == Unanswered(due, spoken(asked))
    assert rig.watch.wake_at() is None
    assert len(rig.run(SECOND)) == 2


def test_who_asks_again_has_not_been_answered() -> None:
    rig = Rig(10)
    rig.says(encode(99, 1, b"m400"), at=0)
    rig.says(encode(99, 1, b"m400"), at=5 * MS)
    entries = rig.run(8 * MS)
    assert told(entries) == ["packet 1>99", "no answer 1>99", "packet 1>99"]
    assert entries[1] == Unanswered(5 * MS, spoken(entries[0]))
    assert told(rig.run())[3:] == ["no answer 1>99"]


def test_silence_is_told_once() -> None:
    rig = Rig(10)
    for at in (0, 50 * MS):
        rig.says(encode(99, 1, b"m400"), at=at)
    assert told(rig.run()) == ["packet 1>99", "no answer 1>99"] * 2


def test_silence_comes_before_what_is_said_after_it() -> None:
    rig = Rig(10)
    rig.says(encode(99, 1, b"m400"), at=0)
    rig.says(M400, at=50 * MS)
    assert told(rig.run()) == ["packet 1>99", "no answer 1>99", "packet 1>10", "ack 10>1"]


def test_answers_to_different_nodes_are_kept_apart() -> None:
    rig = Rig(10, 11)
    for number, node in enumerate((10, 99, 11)):
        rig.says(encode(node, 1, b"V100"), at=number * 5 * MS)
    entries = rig.run()
    assert told(entries) == [
        "packet 1>10",
        "ack 10>1",
        "packet 1>99",
        "packet 1>11",
        "ack 11>1",
        "no answer 1>99",
    ]
    assert [spoken(entries[at]).request for at in (1, 4)] == [entries[0], entries[3]]


def test_an_answer_to_nothing_is_told_as_that() -> None:
    rig = Rig()
    rig.stranger_says(nak(1, 10), at=0)
    (answer,) = rig.run()
    assert (spoken(answer).request, spoken(answer).delay) == (None, None)


def test_an_answer_that_comes_too_late_is_known_as_late() -> None:
    rig = Rig()
    rig.says(M400, at=0)
    rig.stranger_says(ack(1, 10), at=40 * MS)
    asked, silence, answer = rig.run()
    assert isinstance(silence, Unanswered)
    assert (spoken(answer).late, spoken(answer).request) == (True, asked)
    assert spoken(answer).delay == 40 * MS - TEN_BYTES


def test_for_ever_is_too_late_to_be_an_answer() -> None:
    rig = Rig()
    rig.says(M400, at=0)
    rig.run(5 * SECOND)
    rig.stranger_says(ack(1, 10), at=5 * SECOND)
    assert spoken(rig.run(6 * SECOND)[-1]).request is None


# ------------------------------------------------------------------------- collisions


def test_who_does_not_wait_for_the_ack_collides_with_it() -> None:
    rig = Rig(10)
    rig.says(M400 + M400, at=0)
    first, collision, silence = rig.run()
    # The first packet had arrived; its ACK and the second packet are what collided.
    assert told([first]) == ["packet 1>10"]
    assert isinstance(collision, Collision)
    start = TEN_BYTES + TURNAROUND
    assert (collision.start, collision.end) == (start, start + FOUR_BYTES)
    assert collision.gap == TURNAROUND
    link, node = collision.parts
    assert (link.sender, link.node, link.start) == (LINK, None, 0)
    assert (node.sender, node.node, node.start) == ("node 10", 10, start)
    assert link.raw[:10] == M400
    assert link.raw[10:] != M400
    assert len(node.raw) == 4
    assert silence == Unanswered(TEN_BYTES + TURNAROUND + EIGHT_BYTES + SLACK, spoken(first))


def test_what_arrives_unharmed_behind_a_collision_is_told_behind_it() -> None:
    rig = Rig(10)
    rig.stranger_says(b"\x55\x55", at=0)
    late = RATE.span(2) - 1_000
    rig.stranger_says(b"\x55" + M400, at=late)
    collision, packet, answer = rig.run()
    assert told([collision, packet, answer]) == [
        "collision somebody somebody",
        "packet 1>10",
        "ack 10>1",
    ]
    assert spoken(packet).start == late + RATE.span(1)
    assert spoken(packet).gap == RATE.span(1) - 1_000


def test_what_a_collision_leaves_in_the_decoder_is_not_told_again() -> None:
    rig = Rig()
    # Whatever is left of these two, the next frame would cut it short.
    rig.says(M400[:-2], at=0)
    rig.stranger_says(M400[:-2], at=MS)
    rig.says(M400, at=20 * MS)
    rig.stranger_says(ack(1, 10), at=23 * MS)
    assert told(rig.run()) == [f"collision {LINK} somebody", "packet 1>10", "ack 10>1"]


def test_what_a_collision_leaves_in_the_decoder_is_not_told_after_silence_either() -> None:
    rig = Rig()
    rig.says(M400[:-2], at=0)
    rig.stranger_says(M400[:-2], at=MS)
    assert told(rig.run(10 * SECOND)) == [f"collision {LINK} somebody"]
    assert rig.watch.wake_at() is None


def test_a_chain_of_overlaps_is_one_collision() -> None:
    rig = Rig()
    rig.says(b"\x55" * 40, at=0)
    rig.stranger_says(b"\x55" * 40, at=5 * MS)
    rig.stranger_says(b"\x55" * 40, at=12 * MS)
    rig.stranger_says(b"\x55" * 2, at=13 * MS)
    (collision,) = rig.run(30 * MS)
    assert isinstance(collision, Collision)
    assert [part.start for part in collision.parts] == [0, 5 * MS, 12 * MS, 13 * MS]


def test_while_somebody_still_talks_the_others_are_held_and_no_answer_is_missed() -> None:
    rig = Rig(10)
    # Both packets were heard whole; the ACK of the first hits a long burst of noise behind them.
    rig.says(M400 + b"\x55" * 2_000, at=0)
    assert told(rig.run(400 * MS)) == []
    assert rig.watch.wake_at() is None
    rig.run(600 * MS)
    assert told(rig.entries)[:2] == ["packet 1>10", f"collision {LINK} node 10"]
    assert told(rig.entries)[-1] == "no answer 1>10"
    assert {"garbage"} == {*told(rig.entries)[2:-1]}


def test_what_is_held_may_be_the_answer() -> None:
    rig = Rig()
    rig.says(M400, at=0)
    # Over soon, but not told before the other one is, who goes on for half a second.
    rig.stranger_says(ack(1, 10) + b"\x55", at=5 * MS)
    rig.stranger_says(b"\x55" * 2_000, at=5 * MS + RATE.span(4))
    assert told(rig.run(400 * MS)) == ["packet 1>10"]
    entries = rig.run(600 * MS)
    assert told(entries)[1:3] == ["ack 10>1", "collision somebody somebody"]
    assert not spoken(entries[1]).late


def test_collisions_one_after_the_other_are_told_apart() -> None:
    rig = Rig()
    for at in (0, 20 * MS):
        rig.says(b"\x55" * 10, at=at)
        rig.stranger_says(b"\x55" * 10, at=at + MS)
    assert told(rig.run()) == [f"collision {LINK} somebody"] * 2


def test_a_pile_up_without_end_is_told_in_parts() -> None:
    watch = Watch(KIND.protocol, RATE)
    entries: list[Entry] = []
    # Each overlaps the one before and the one after it, for ever.
    for number in range(1, 200):
        start = number * 8 * MS
        hits = ((start, start + 2 * MS), (start + 8 * MS, start + 10 * MS))
        sent = Sent(start, start + 10 * MS, 0, "somebody", None, b"\x55" * 38, hits)
        entries += watch.sent(sent)
    assert {type(one) for one in entries} == {Collision}
    assert len(entries) == 199 // 64


# ------------------------------------------------------------------ bytes and silences


def test_a_packet_that_comes_in_pieces_is_one_from_its_first_byte_to_its_last() -> None:
    rig = Rig(10)
    for number in range(8):
        rig.says(M400[number : number + 1], at=number * 200 * MS)
    rig.says(M400[8:], at=8 * 200 * MS)
    packet, answer = (spoken(one) for one in rig.run(3 * SECOND))
    assert (packet.start, packet.end) == (0, 8 * 200 * MS + RATE.span(2))
    assert packet.raw == M400
    assert (answer.request, answer.delay) == (packet, TURNAROUND)


def test_an_answer_that_comes_before_the_nul_is_still_one() -> None:
    # A device answers the byte after ETX, and waits for no NUL.
    rig = Rig(10)
    rig.says(M400[:-1], at=0)
    rig.says(M400[-1:], at=20 * MS)
    packet, answer, nul = (spoken(one) for one in rig.run())
    assert (packet.said.verdict, packet.raw) == ("no NUL", M400[:-1])
    assert answer.request == packet
    assert (nul.said.words, nul.raw) == ("noise", b"\x00")


def test_noise_is_told_after_a_moment_of_silence() -> None:
    rig = Rig(10)
    rig.says(b"hello", at=0)
    assert rig.run(RATE.span(5) + 49 * MS) == []
    assert rig.watch.wake_at() == RATE.span(5) + 50 * MS
    (noise,) = rig.run(RATE.span(5) + 50 * MS)
    assert spoken(noise).said == Said("garbage", None, None, b"hello", "noise", "", 5)
    assert (spoken(noise).start, spoken(noise).end) == (0, RATE.span(5))


def test_a_pause_within_a_packet_is_waited_for_and_in_the_end_given_up() -> None:
    rig = Rig()
    rig.says(M400[:5], at=0)
    rig.says(M400[5:], at=2 * SECOND)
    rig.says(M400[:5], at=3 * SECOND)
    end = 3 * SECOND + RATE.span(5)
    assert told(rig.run(end + 3 * SECOND - 1)) == ["packet 1>10", "no answer 1>10"]
    garbage = spoken(rig.run(end + 3 * SECOND)[-1])
    assert (garbage.said.words, garbage.raw) == ("unfinished", M400[:5])
    rig.says(M400, at=10 * SECOND)
    assert told(rig.run(11 * SECOND))[3:] == ["packet 1>10", "no answer 1>10"]


def test_at_the_end_all_that_is_pending_is_told() -> None:
    rig = Rig()
    rig.says(M400[:5], at=0)
    assert rig.run(10 * MS) == []
    (garbage,) = rig.watch.end(10 * MS)
    assert spoken(garbage).said.words == "unfinished"
    assert rig.watch.end(10 * MS) == []


def test_silence_is_counted_on_each_lane_for_itself() -> None:
    watch = Watch(KIND.protocol, RATE, lanes=2)
    entries: list[Entry] = []
    for lane, start in ((0, 0), (1, 5 * MS), (0, 10 * MS), (1, 20 * MS)):
        data = encode(0, 10, b"\x11")
        entries += watch.sent(Sent(start, start + RATE.span(7), lane, "node 10", 10, data))
    gaps = [spoken(one).gap for one in entries]
    assert gaps == [None, None, 10 * MS - RATE.span(7), 15 * MS - RATE.span(7)]


# ----------------------------------------------------------------- reports and misses


def test_a_report_follows_the_packet_that_it_came_of() -> None:
    rig = Rig(10)
    rig.says(encode(10, 1, b"?4"), at=0)
    assert told(rig.run()) == ["packet 1>10", "report 10", "ack 10>1"]


def test_a_report_of_its_own_is_told_when_time_has_passed_it() -> None:
    watch = Watch(KIND.protocol, RATE)
    report = Report(5 * MS, None, ReportKind.WARNING, "the wind blows")
    assert watch.reported(report) == []
    assert watch.wake(4 * MS) == []
    assert watch.wake(5 * MS) == [Reported(report)]


def test_where_lines_are_missing_nothing_is_made_of_what_was_before() -> None:
    rig = Rig()
    rig.says(encode(99, 1, b"m400"), at=0)
    rig.says(M400[:5], at=5 * MS)
    rig.run(10 * MS)
    assert rig.watch.lost(7) == [Lost(7)]
    rig.says(M400, at=20 * MS)
    entries = rig.run(25 * MS)
    assert told(entries) == ["packet 1>99", "packet 1>10"]
    assert spoken(entries[1]).gap is None


# ------------------------------------------------------------------- a plain listener


def listener() -> Watch:
    return Watch(KIND.protocol, RATE, slack=LINK_SLACK)


def test_a_reads_times_are_counted_back_from_its_arrival() -> None:
    watch = listener()
    (packet,) = watch.read(M400, 20 * MS)
    assert (spoken(packet).start, spoken(packet).end) == (20 * MS - TEN_BYTES, 20 * MS)
    assert spoken(packet).sender is None


def test_two_packets_of_one_read_follow_each_other() -> None:
    first, second = listener().read(encode(0, 1, b"V100") * 2, 20 * MS)
    assert spoken(first).start == 20 * MS - RATE.span(20)
    assert spoken(second).start == spoken(first).end == spoken(first).start + TEN_BYTES
    assert spoken(second).gap == 0


def test_no_byte_begins_before_those_of_the_read_before_it_ended() -> None:
    watch = listener()
    watch.read(M400, 20 * MS)
    # Both had waited here for a while: the second came in less time than the line takes for it.
    (answer,) = watch.read(ack(1, 10), 20 * MS + 100)
    assert (spoken(answer).start, spoken(answer).end) == (20 * MS, 20 * MS + 100)
    # So of the silence between them nothing is known.
    assert spoken(answer).delay is None


def test_the_delay_of_an_answer_that_came_in_the_same_read_is_not_known() -> None:
    asked, answered = listener().read(M400 + ack(1, 10), 20 * MS)
    assert (spoken(answered).request, spoken(answered).delay) == (asked, None)


def test_the_delay_between_reads_is_known_as_well_as_their_times() -> None:
    watch = listener()
    watch.read(M400[:4], 20 * MS)
    watch.read(M400[4:], 22 * MS)
    (answered,) = watch.read(ack(1, 10), 25 * MS)
    assert spoken(answered).delay == 3 * MS - FOUR_BYTES


def test_on_a_link_an_answer_may_take_its_time() -> None:
    watch = listener()
    watch.read(M400, 20 * MS)
    due = 20 * MS + TURNAROUND + EIGHT_BYTES + LINK_SLACK
    assert watch.wake_at() == due
    assert watch.wake(due - 1) == []
    assert told(watch.wake(due)) == ["no answer 1>10"]


@given(st.lists(st.tuples(bursts, st.integers(0, 20 * MS)), max_size=8))
def test_whatever_is_read_is_told_in_order_and_in_time(reads: list[tuple[bytes, Ns]]) -> None:
    watch, decoder = listener(), KIND.protocol.decoder()
    now = 0
    entries: list[Entry] = []
    expected: list[Said] = []
    for data, pause in reads:
        now += pause
        entries += watch.read(data, now)
        expected += [KIND.protocol.tell(event) for event in decoder.receive(data)]
    entries += watch.end(now)
    # Silences are too short here for anything to be given up but at the end.
    heard = [one for one in entries if isinstance(one, Spoken)]
    assert [one.said for one in heard][: len(expected)] == expected
    assert len(heard) <= len(expected) + 1
    assert b"".join(data for data, _ in reads).endswith(heard[-1].raw if heard else b"")
    for one in heard:
        assert 0 <= one.start <= one.end <= now
        assert one.gap is None or one.gap >= 0
    assert all(one.end <= other.start for one, other in pairwise(heard))


@given(
    st.lists(
        st.tuples(bursts, st.integers(0, 20 * MS), st.booleans(), st.integers(1, 4)), max_size=8
    )
)
def test_whatever_a_feed_says_is_taken(
    lines: list[tuple[bytes, Ns, bool, int]],
) -> None:
    # Times and hits that no bus would give: a monitor looks on, and never fails over it.
    watch = Watch(KIND.protocol, RATE)
    for data, start, hit, parts in lines:
        end = start + RATE.span(len(data))
        hits = tuple((start + part, end) for part in range(parts)) if hit else ()
        watch.sent(Sent(start, end, 0, "somebody", None, data, hits))
        watch.wake(end)
    watch.end(SECOND)
    assert watch.wake_at() is None or watch.wake_at()


@pytest.mark.parametrize("lanes", [1, 2])
def test_load_counts_the_time_in_which_anybody_talks_once(lanes: int) -> None:
    rig = Rig(lanes=lanes)
    rig.says(b"\x55" * 10, at=0)
    rig.stranger_says(b"\x55" * 10, at=MS)
    rig.run()
    assert rig.watch.summary.busy == (MS + TEN_BYTES) // lanes


# ------------------------------------------------------------------------------- faults


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (Dead(10), ["packet 1>10", "no answer 1>10"]),
        (Drop(1), []),
        (BitErrors(1), ["garbage"]),
        (LateDirection(MS), ["packet 1>10", "garbage", "no answer 1>10"]),
    ],
)
def test_what_arrived_is_told_and_what_did_not_is_not(fault: Fault, expected: list[str]) -> None:
    rig = Rig(10)
    rig.bus.medium.add_fault(fault)
    rig.says(M400, at=5 * MS)
    assert told(rig.run()) == expected


@pytest.mark.slow
@given(
    st.lists(
        st.sampled_from(
            (BitErrors(0.02), Drop(0.1), Duplicate(0.1), Delay(0.1, MS), WrongBaud(10, 9_600))
        ),
        min_size=1,
    ),
    st.lists(bursts, max_size=6),
)
def test_whatever_faults_do_to_a_line_each_entry_ends_after_it_began(
    faults: list[Fault], talk: list[bytes]
) -> None:
    rig = Rig(10, 11)
    for fault in faults:
        rig.bus.medium.add_fault(fault)
    for number, data in enumerate(talk):
        rig.says(data, at=number * 3 * MS)
    for entry in rig.run(SECOND):
        if isinstance(entry, Spoken):
            assert entry.start <= entry.end
