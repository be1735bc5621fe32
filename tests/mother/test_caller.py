"""Transactions in kernel time, against real nodes on a line that is now and then bad."""

from __future__ import annotations

from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND, SacSettings
from sacbus.bus import Bus, Port
from sacbus.kernel import MS, Kernel
from sacbus.mother import (
    Acknowledged,
    BadRequest,
    Caller,
    LineLost,
    NoAnswer,
    Refused,
    Sent,
    UnknownOutcome,
)
from sacbus.mother.soft_ops import SoftOpHeard
from sacbus.wire import encode
from tests.mother.rig import Outcome, Rig, Weather, answer_lost, body_spoilt, packet_lost

# The line's figures (spec, wire): 10 bits a byte at 38 400 baud, truncated per transmission.
FOUR_BYTES = 1_041_666
TEN_BYTES = 2_604_166
TWENTY_BYTES = 5_208_333
TURNAROUND = 385_000
A_FURTHER_CHARACTER = 13_000
GAP = 1_000_000


def test_acknowledged_command_has_been_executed_once() -> None:
    rig = Rig(10, 11)
    outcome = rig.ask(10, b"m400")
    assert outcome == Acknowledged(10, 1, TEN_BYTES + TURNAROUND + FOUR_BYTES)
    assert rig.sent == [bytes.fromhex("02 0a 01") + b"m400" + bytes.fromhex("03 de 00")]
    assert rig.answers == [bytes.fromhex("02 01 0a 06")]
    assert (rig.steps(10), rig.steps(11)) == (400, 0)


def test_a_hundred_exchanges_take_exactly_what_the_figures_add_up_to() -> None:
    rig = Rig(10)
    line = b"V100 as before"
    outcomes = [rig.call(10, line) for _ in range(101)]
    rig.kernel.run()
    assert {len(packet) for packet in rig.sent} == {20}
    nine_further = 9 * A_FURTHER_CHARACTER
    exchange = TWENTY_BYTES + TURNAROUND + nine_further + FOUR_BYTES + GAP
    assert exchange == 7_751_999
    packets = [sent.start for sent in rig.line if len(sent.data) == 20]
    assert packets == [number * exchange for number in range(101)]
    assert packets[100] == 775_199_900
    assert [one for (one,) in outcomes] == [Acknowledged(10, 1, exchange - GAP)] * 101


def test_mother_leaves_a_millisecond_after_an_ack_and_after_a_broadcast() -> None:
    rig = Rig(10)
    rig.call(10, b"V100")
    rig.caller.broadcast(b"V100", lambda _: None)
    rig.call(10, b"V100")
    rig.kernel.run()
    first, its_ack, broadcast, second, second_ack = rig.line
    assert broadcast.start == its_ack.end + GAP
    assert second.start == broadcast.end + GAP
    assert its_ack.data == second_ack.data == bytes.fromhex("02 01 0a 06")
    assert its_ack.start == first.end + TURNAROUND


def test_a_packet_that_follows_the_gap_is_never_lost_in_deaf_time() -> None:
    rig = Rig(10)
    # The longest body that there is, and the longest deaf time after it.
    outcomes = [rig.call(10, b"V100 " + b"x" * 41) for _ in range(3)]
    rig.kernel.run()
    assert [type(one) for (one,) in outcomes] == [Acknowledged] * 3
    assert rig.caller.statistics[10].retries == 0


def test_requests_go_out_in_the_order_of_the_calls_one_at_a_time() -> None:
    rig = Rig(10, 11)
    settled: list[int] = []

    def note(number: int, outcome: Outcome) -> None:
        settled.append(number)

    for number, node in enumerate((10, 11, 10, 11)):
        rig.caller.call(node, b"m1", partial(note, number))
    rig.kernel.run()
    assert settled == [0, 1, 2, 3]
    senders = [one.data[1] for one in rig.line]
    assert senders == [10, 1, 11, 1, 10, 1, 11, 1]


def test_broadcast_reaches_all_and_nobody_answers() -> None:
    rig = Rig(*range(4, 254))
    outcomes: list[Outcome] = []
    rig.caller.broadcast(b"m400", outcomes.append)
    rig.kernel.run()
    assert outcomes == [Sent()]
    assert rig.answers == []
    assert {rig.steps(address) for address in range(4, 254)} == {400}
    assert len(rig.line) == 1


def test_250_nodes_answer_a_round_each_for_itself() -> None:
    addresses = range(4, 254)
    rig = Rig(*addresses)
    outcomes = [rig.call(address, b"m%d" % address) for address in addresses]
    rig.kernel.run()
    assert rig.answers == [bytes((2, 1, address, 6)) for address in addresses]
    assert [one.node for (one,) in outcomes if isinstance(one, Acknowledged)] == list(addresses)
    assert [rig.steps(address) for address in addresses] == list(addresses)
    assert rig.caller.strays == rig.caller.faults == 0


# ----------------------------------------------------------------------------- NAK


def test_nak_is_followed_by_another_attempt_and_the_command_runs_once() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt])
    outcome = rig.ask(10, b"m400")
    assert isinstance(outcome, Acknowledged)
    assert outcome.attempts == 2
    # The last attempt's round trip, not the first one's.
    assert outcome.round_trip == TEN_BYTES + TURNAROUND + FOUR_BYTES
    assert rig.answers == [bytes.fromhex("02 01 0a 15"), bytes.fromhex("02 01 0a 06")]
    assert rig.steps(10) == 400


def test_nak_every_time_is_refused_with_all_that_is_known() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt] * 3)
    outcome = rig.ask(10, b"m400")
    assert isinstance(outcome, Refused)
    assert (outcome.node, outcome.line, outcome.attempts, outcome.last) == (10, "m400", 3, "NAK")
    assert rig.steps(10) == 0
    assert len(rig.sent) == 3


def test_mother_leaves_a_millisecond_after_a_nak_too() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt])
    rig.ask(10, b"m400")
    nak = next(one for one in rig.line if one.data == bytes.fromhex("02 01 0a 15"))
    again = [one for one in rig.line if one.data == rig.sent[1]][1]
    assert again.start == nak.end + GAP


# ------------------------------------------------------------------------- silence


def test_silence_is_known_when_the_lines_own_figures_are_over() -> None:
    rig = Rig(10)
    outcomes = rig.call(99, b"m400")
    slack = 10 * MS
    overdue = TEN_BYTES + TURNAROUND + FOUR_BYTES + slack
    rig.kernel.run_until(overdue - 1)
    assert outcomes == []
    rig.kernel.run_until(overdue)
    assert [type(one) for one in outcomes] == [UnknownOutcome]


@pytest.mark.parametrize(
    "line", [b"", b"V100", b"A1", b"D1", b"S", b"y", b"q1m400", b"$Ca10", b"LN5"]
)
def test_what_may_be_repeated_is_until_the_limit(line: bytes) -> None:
    outcome = Rig(10).ask(99, line)
    assert isinstance(outcome, NoAnswer)
    assert (outcome.node, outcome.line) == (99, line.decode())
    assert (outcome.attempts, outcome.last) == (3, "silence")


@pytest.mark.parametrize(
    "line", [b"m400", b"X1", b"+ ", b"-", b"N", b"n", b"G5", b"$U", b"$C", b"hello"]
)
def test_what_must_not_run_twice_is_sent_once(line: bytes) -> None:
    rig = Rig(10)
    outcome = rig.ask(99, line)
    assert isinstance(outcome, UnknownOutcome)
    assert (outcome.attempts, outcome.last) == (1, "silence")
    assert len(rig.sent) == 1


def test_a_lost_packet_that_may_be_repeated_arrives_at_the_second_attempt() -> None:
    rig = Rig(10)
    rig.expect([packet_lost])
    outcome = rig.ask(10, b"V100")
    assert isinstance(outcome, Acknowledged)
    assert outcome.attempts == 2
    assert rig.sent[0] == rig.sent[1]


def test_unknown_outcome_when_the_packet_was_lost_and_when_only_its_ack_was() -> None:
    lost = Rig(10)
    lost.expect([packet_lost])
    assert isinstance(lost.ask(10, b"m400"), UnknownOutcome)
    assert lost.steps(10) == 0
    executed = Rig(10)
    executed.expect([answer_lost])
    assert isinstance(executed.ask(10, b"m400"), UnknownOutcome)
    assert executed.steps(10) == 400


def test_who_accepts_duplicates_may_get_two() -> None:
    rig = Rig(10)
    rig.expect([answer_lost])
    outcome = rig.ask(10, b"m400", accept_duplicates=True)
    assert isinstance(outcome, Acknowledged)
    assert outcome.attempts == 2
    assert rig.steps(10) == 800


def test_silence_after_a_nak_leaves_the_outcome_unknown() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt, answer_lost])
    outcome = rig.ask(10, b"m400")
    assert isinstance(outcome, UnknownOutcome)
    assert (outcome.attempts, outcome.last) == (2, "silence")
    assert rig.steps(10) == 400


def test_an_absent_node_does_not_keep_the_others_waiting_for_ever() -> None:
    rig = Rig(10)
    absent = rig.call(99, b"V100")
    present = rig.call(10, b"m400")
    rig.kernel.run()
    assert isinstance(absent[0], NoAnswer)
    assert present == [Acknowledged(10, 1, TEN_BYTES + TURNAROUND + FOUR_BYTES)]
    assert rig.steps(10) == 400


_WEATHER: dict[str, Weather | None] = {
    "good": None,
    "NAK": body_spoilt,
    "packet lost": packet_lost,
    "answer lost": answer_lost,
}


@given(
    st.lists(st.sampled_from(sorted(_WEATHER)), max_size=12),
    st.lists(st.booleans(), min_size=1, max_size=5),
)
def test_in_any_weather_each_call_ends_once_and_says_what_is_known(
    weather: list[str], duplicates: list[bool]
) -> None:
    rig = Rig(10)
    rig.expect(_WEATHER[one] for one in weather)
    for accept in duplicates:
        before = rig.steps(10)
        outcome = rig.ask(10, b"m400", accept_duplicates=accept)
        ran = (rig.steps(10) - before) / 400
        match outcome:
            case Acknowledged(attempts=attempts):
                assert 1 <= ran <= (attempts if accept else 1)
            case Refused():
                # NAK every time: it has not run, whatever was accepted.
                assert ran == 0
            case NoAnswer():
                assert accept
            case UnknownOutcome():
                assert ran in (0, 1)
                assert not accept
            case _:
                pytest.fail(f"{outcome!r}")


# ------------------------------------------------------------- what else is on the line


def test_an_answer_that_nobody_waits_for_is_a_stray() -> None:
    rig = Rig(10, 11)
    rig.interrupt(0, bytes.fromhex("02 01 0a 06"))
    rig.kernel.run()
    assert rig.caller.strays == 1
    assert rig.caller.statistics[10].acks == 0


@pytest.mark.parametrize(
    "answer",
    ["02 01 0b 06", "02 52 63 06", "02 01 0b 15"],
    ids=["other node", "other master", "NAK"],
)
def test_an_answer_of_another_is_not_taken_for_the_one_we_wait_for(answer: str) -> None:
    rig = Rig(10, 11)
    outcomes = rig.call(99, b"m400")
    rig.interrupt(TEN_BYTES + 100_000, bytes.fromhex(answer))
    rig.kernel.run()
    assert isinstance(outcomes[0], UnknownOutcome)
    assert rig.caller.strays == 1


def test_an_answer_that_comes_too_late_is_a_stray() -> None:
    rig = Rig()
    outcomes = rig.call(99, b"m400")
    rig.interrupt(20 * MS, bytes.fromhex("02 01 63 06"))
    rig.kernel.run()
    assert isinstance(outcomes[0], UnknownOutcome)
    assert rig.caller.strays == 1


def test_packets_of_others_are_counted_and_noise_is_too() -> None:
    rig = Rig()
    rig.interrupt(0, encode(11, 82, b"m400"))
    rig.interrupt(10 * MS, b"\x55\x55")
    rig.interrupt(20 * MS, encode(11, 82, b"m400")[:-2] + b"\x99\x00")
    rig.kernel.run()
    assert rig.caller.overheard == 1
    assert rig.caller.faults == 2
    assert rig.caller.strays == 0


def test_soft_ops_are_told_to_who_listens() -> None:
    rig = Rig(10)
    heard: list[SoftOpHeard] = []
    rig.ask(10, b"$O1")
    rig.caller.soft_op_listeners.append(heard.append)
    begin = rig.kernel.now
    # A tenth of a second of wait, so that its ACK is long out when it starts.
    rig.ask(10, b"m2v60a999d999t100000")
    assert [(one.node, one.begins) for one in heard] == [(10, True), (10, False)]
    assert heard[0].at > begin + 100 * MS
    assert heard[1].at - heard[0].at == 10 * MS
    # A message of another node's to everybody, and a soft op to one node alone, are none.
    rig.interrupt(rig.kernel.now + MS, encode(0, 11, b" hello"))
    rig.interrupt(rig.kernel.now + 20 * MS, encode(85, 11, b"\x11"))
    rig.kernel.run()
    assert len(heard) == 2
    rig.caller.soft_op_listeners.clear()
    rig.ask(10, b"m1")
    assert len(heard) == 2
    assert rig.caller.overheard == 6


def test_mothers_own_bytes_echoed_by_the_adapter_are_nobody_elses() -> None:
    rig = Rig(10, echo=True)
    assert isinstance(rig.ask(10, b"m400"), Acknowledged)
    assert (rig.caller.overheard, rig.caller.strays, rig.caller.faults) == (0, 0, 0)


# --------------------------------------------------------------- lost, withdrawn, refused


def test_a_lost_line_fails_what_waits_and_what_is_asked_later() -> None:
    rig = Rig(10)
    outstanding, queued = rig.call(10, b"m400"), rig.call(10, b"m400")
    rig.kernel.run_until(1 * MS)
    rig.caller.lose("unplugged")
    later = rig.call(10, b"m400")
    for outcomes in (outstanding, queued, later):
        assert [type(one) for one in outcomes] == [LineLost]
        assert str(outcomes[0]) == "unplugged"
    rig.kernel.run()
    assert len(rig.sent) == 1
    assert len(outstanding) == len(queued) == 1


def test_a_lost_line_fails_a_broadcast_on_its_way() -> None:
    rig = Rig(10)
    outcomes: list[Outcome] = []
    rig.caller.broadcast(b"m400", outcomes.append)
    rig.kernel.run_until(1 * MS)
    rig.caller.lose("unplugged")
    rig.kernel.run()
    assert [type(one) for one in outcomes] == [LineLost]


def test_what_was_withdrawn_before_its_turn_is_never_sent() -> None:
    rig = Rig(10)
    first = rig.call(10, b"m400")
    unwanted: list[Outcome] = []
    rig.caller.call(10, b"m100", unwanted.append)
    rig.caller.withdraw(unwanted.append)
    rig.kernel.run()
    assert rig.steps(10) == 400
    assert len(rig.sent) == 1
    assert unwanted == []
    assert isinstance(first[0], Acknowledged)


def test_what_was_withdrawn_on_its_way_is_not_sent_again() -> None:
    rig = Rig(10)
    rig.expect([packet_lost])
    unwanted: list[Outcome] = []
    done = unwanted.append
    rig.caller.call(10, b"V100", done)
    rig.kernel.run_until(1 * MS)
    rig.caller.withdraw(done)
    next_one = rig.call(10, b"m400")
    rig.kernel.run()
    assert [packet[3:5] for packet in rig.sent] == [b"V1", b"m4"]
    assert isinstance(unwanted[0], NoAnswer)
    assert isinstance(next_one[0], Acknowledged)


def test_what_was_withdrawn_on_its_way_is_not_sent_again_after_a_nak() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt])
    unwanted: list[Outcome] = []
    done = unwanted.append
    rig.caller.call(10, b"m400", done)
    rig.kernel.run_until(1 * MS)
    rig.caller.withdraw(done)
    rig.kernel.run()
    assert len(rig.sent) == 1
    assert isinstance(unwanted[0], Refused)


def test_withdrawing_what_is_settled_changes_nothing() -> None:
    rig = Rig(10)
    settled: list[Outcome] = []
    done = settled.append
    rig.caller.call(10, b"m400", done)
    rig.kernel.run()
    rig.caller.withdraw(done)
    assert isinstance(rig.ask(10, b"m400"), Acknowledged)


@pytest.mark.parametrize("node", [-1, 0, 1, 2, 3, 256])
def test_addresses_that_no_node_can_have_are_refused_and_nothing_is_sent(node: int) -> None:
    rig = Rig(10)
    with pytest.raises(BadRequest, match=rf"node {node}: expected an address from 4 to 255"):
        rig.call(node, b"m400")
    assert rig.sent == []


def test_statistics_count_each_node_apart() -> None:
    rig = Rig(10, 11)
    rig.expect([body_spoilt, None, packet_lost])
    rig.ask(10, b"m400")
    rig.ask(11, b"V100")
    ten, eleven = rig.caller.statistics[10], rig.caller.statistics[11]
    assert (ten.sent, ten.acks, ten.naks, ten.timeouts, ten.retries) == (2, 1, 1, 0, 1)
    assert (eleven.sent, eleven.acks, eleven.naks, eleven.timeouts, eleven.retries) == (
        2,
        1,
        0,
        1,
        1,
    )
    assert list(ten.round_trips) == [TEN_BYTES + TURNAROUND + FOUR_BYTES]


def test_nak_after_silence_is_no_refusal_for_the_first_packet_may_have_been_executed() -> None:
    rig = Rig(10)
    rig.expect([answer_lost, body_spoilt, body_spoilt])
    outcome = rig.ask(10, b"m400", accept_duplicates=True)
    assert isinstance(outcome, NoAnswer)
    assert (outcome.attempts, outcome.last, outcome.refusals) == (3, "NAK", 2)
    assert rig.steps(10) == 400


@pytest.mark.parametrize("line", [b"V100", b"Q1m400", b""])
def test_naks_and_silence_are_not_an_absent_node_and_what_may_be_repeated_still_may(
    line: bytes,
) -> None:
    rig = Rig(10)
    rig.expect([body_spoilt, answer_lost, body_spoilt])
    outcome = rig.ask(10, line)
    assert isinstance(outcome, NoAnswer)
    assert (outcome.attempts, outcome.last, outcome.refusals) == (3, "NAK", 2)
    assert "nobody at that address" not in str(outcome)
    assert str(outcome).endswith("check the line, and send it again, which does no harm")


def test_a_motion_that_met_nak_and_then_silence_is_to_be_looked_at() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt, packet_lost])
    outcome = rig.ask(10, b"m400")
    assert isinstance(outcome, UnknownOutcome)
    assert str(outcome).endswith("look at the node before you send it again")


def test_no_answer_is_late_while_the_packet_still_waits_for_the_line() -> None:
    bench_kernel = Kernel()
    bus = Bus(bench_kernel, KIND.protocol)
    bus.add(KIND.create(10, SacSettings(), bus.rate, bus.tell))
    outcomes: list[object] = []
    port = Port(bus.medium, lambda heard, _now: caller.hear(heard.data), latency=0)
    caller = Caller(bench_kernel, port.talk, unsent=lambda: port.unsent)
    # Somebody else talks for 104 ms.
    bus.medium.transmit("another talker", bytes(400), 0)
    caller.call(10, b"m400", outcomes.append)
    bench_kernel.run()
    (outcome,) = outcomes
    assert isinstance(outcome, Acknowledged)
    assert outcome.attempts == 1


@pytest.mark.parametrize("body", [b"m400", b"q30m4294967295vc4294967295a10.47d1l0u0"])
def test_the_longest_call_is_one_that_fails_to_its_end(body: bytes) -> None:
    rig = Rig(10)
    rig.expect([packet_lost, packet_lost, packet_lost])
    began = rig.kernel.now
    outcomes = rig.call(10, body, accept_duplicates=True)
    while not outcomes:
        rig.kernel.run_next()
    took = rig.kernel.now - began
    assert isinstance(outcomes[0], NoAnswer)
    # It has a pause before it, one after each answer, and a space for its CRC to spare.
    assert took < rig.caller.longest_call(len(body)) < took + 8 * MS


def test_without_a_gap_the_next_request_follows_the_answer_at_once() -> None:
    kernel = Kernel()
    bus = Bus(kernel, KIND.protocol)
    bus.add(KIND.create(10, SacSettings(deaf_time=False), bus.rate, bus.tell))
    outcomes: list[Outcome] = []
    starts: list[int] = []
    port = Port(bus.medium, lambda heard, _now: caller.hear(heard.data), latency=0)
    caller = Caller(kernel, port.talk, gap=0)
    bus.medium.watchers.append(lambda sent: starts.append(sent.start))
    for _ in range(3):
        caller.call(10, b"m400", outcomes.append)
    kernel.run()
    exchange = TEN_BYTES + TURNAROUND + FOUR_BYTES
    assert starts[::2] == [0, exchange, 2 * exchange]
    assert outcomes == [Acknowledged(10, 1, exchange)] * 3


def test_without_a_gap_what_was_refused_is_asked_again_before_the_next() -> None:
    rig = Rig(10)
    rig.caller = Caller(rig.kernel, rig._send, gap=0)
    rig.expect([body_spoilt, packet_lost])
    first, second = rig.call(10, b"V100"), rig.call(10, b"V200")
    rig.kernel.run()
    assert isinstance(first[0], Acknowledged)
    assert isinstance(second[0], Acknowledged)
    # Spoilt and refused; sent into the time in which the node is deaf; heard; and the next one.
    assert [packet[3:7] for packet in rig.sent[:3]] == [b"V100"] * 3
