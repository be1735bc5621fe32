"""The network port: what is answered, exactly when, and what a node is deaf to."""

from __future__ import annotations

import pytest

from nodes.sac import SacSettings
from sacbus.bus import Transmission
from sacbus.kernel import MS, US, Ns
from sacbus.node import ReportKind
from sacbus.wire import DC1, GENERAL_CALL, MOTHER, ack, nak
from tests.nodes.sac.bench import NODE, Bench, Said, packet

START: Ns = 10 * MS
ACKED, NAKED = ack(MOTHER, NODE), nak(MOTHER, NODE)

#: From the end of the NUL to the answer: 385 us, and 13 us for each character beyond five.
TURNAROUND = [(0, 385), (1, 385), (5, 385), (6, 398), (14, 502), (39, 827), (46, 918)]


def body(size: int) -> str:
    """A line of that many characters that every SAC obeys; its padding does nothing."""
    return "v100"[:size].ljust(size) if size >= 2 else "v"[:size]


def damaged(data: bytes) -> bytes:
    """The same with one bit of its CRC wrong, that makes it no other character of meaning."""
    return data[:-2] + bytes((data[-2] ^ 0x40,)) + data[-1:]


def lost(bench: Bench) -> list[str]:
    return [report.text for report in bench.told(ReportKind.LOST)]


# ---- answers and their times --------------------------------------------------------------------


@pytest.mark.parametrize(("size", "us"), TURNAROUND)
def test_an_ack_begins_exactly_a_turnaround_after_the_nul(size: int, us: int) -> None:
    bench = Bench()
    sent = bench.sends(packet(body(size)), at=START)
    bench.run()
    assert bench.heard == [Said(sent.end + us * US, ACKED)]


@pytest.mark.parametrize(("size", "us"), TURNAROUND)
def test_a_nak_takes_as_long(size: int, us: int) -> None:
    bench = Bench()
    sent = bench.sends(damaged(packet(body(size))), at=START)
    bench.run()
    assert bench.heard == [Said(sent.end + us * US, NAKED)]


@pytest.mark.parametrize("size", [5, 14])
def test_without_the_nul_an_answer_comes_406_microseconds_after_the_trigger(size: int) -> None:
    for data, answer in (
        (packet(body(size))[:-1], ACKED),
        (damaged(packet(body(size)))[:-1], NAKED),
        (packet(body(size), crc=False), ACKED),
    ):
        bench = Bench()
        sent = bench.sends(data, at=START)
        bench.run()
        assert bench.heard == [Said(sent.end + (406 + 13 * (size - 5)) * US, answer)]


@pytest.mark.parametrize("late_us", [0, 1, 100, 145])
def test_a_nul_that_still_comes_in_time_puts_the_answer_off(late_us: int) -> None:
    data = packet("v1234")
    bench = Bench(lanes=2)
    sent = bench.sends(data[:-1], at=START)
    nul = bench.sends(b"\x00", at=sent.end + late_us * US)
    bench.run()
    assert bench.heard == [Said(nul.end + 385 * US, ACKED)]


def test_a_nul_that_comes_too_late_runs_into_the_answer() -> None:
    data = packet("v1234")
    bench = Bench(lanes=2)
    sent = bench.sends(data[:-1], at=START)
    bench.sends(b"\x00", at=sent.end + 146 * US)
    bench.run()
    assert bench.heard == [Said(sent.end + 406 * US, ACKED)]


def test_all_bytes_up_to_the_next_stx_put_a_nak_off() -> None:
    bench = Bench(lanes=2)
    sent = bench.sends(damaged(packet("v1234")) + b"\x00\x41\x03\x00\x41", at=START)
    bench.run()
    assert bench.heard == [Said(sent.end + 385 * US, NAKED)]


def test_without_turnaround_an_answer_follows_the_nul_at_once() -> None:
    bench = Bench(settings=SacSettings(turnaround=False))
    sent = bench.sends(packet(body(46)), at=START)
    bench.run()
    assert bench.heard == [Said(sent.end, ACKED)]


def test_an_answer_goes_to_the_source_and_comes_from_the_node() -> None:
    bench = Bench(10, 200)
    bench.sends(packet("v100", 200, 7), at=START)
    bench.run()
    bench.sends(packet("v100", 10, GENERAL_CALL), at=START * 2)
    bench.run()
    assert bench.answers == [b"\x02\x07\xc8\x06", b"\x02\x00\x0a\x06"]


@pytest.mark.parametrize("crc", [True, False])
def test_a_general_call_is_obeyed_but_never_acknowledged(crc: bool) -> None:
    bench = Bench()
    bench.sends(packet("m200v100", GENERAL_CALL, crc=crc), at=START)
    bench.run()
    assert bench.heard == []
    assert bench.position(bench.kernel.now) == 200


def test_a_general_call_with_a_wrong_crc_is_lost_in_silence() -> None:
    bench = Bench()
    bench.sends(damaged(packet("m200v100", GENERAL_CALL)), at=START)
    bench.run()
    assert bench.heard == []
    assert bench.position(bench.kernel.now) == 0
    assert lost(bench) == ["broadcast with a wrong CRC"]


def test_a_packet_with_a_wrong_crc_is_refused_and_not_obeyed() -> None:
    bench = Bench()
    bench.sends(damaged(packet("m200v100")), at=START)
    bench.run()
    assert bench.answers == [NAKED]
    assert bench.position(bench.kernel.now) == 0


def test_what_is_accepted_and_refused_is_counted() -> None:
    bench = Bench(10, NODE)
    for number, data in enumerate((packet("v100"), damaged(packet("v100")), packet("v1", 10))):
        bench.sends(data, at=START * (number + 1))
    bench.run()
    assert bench.nodes[NODE].snapshot(0).counters == {"packets": 2, "ack": 1, "nak": 1}
    assert bench.nodes[10].snapshot(0).counters == {"packets": 1, "ack": 1, "nak": 0}


def test_with_acks_off_packets_are_obeyed_and_refused_in_silence() -> None:
    bench = Bench(settings=SacSettings(ack=False))
    bench.sends(packet("m200v100"), at=START)
    bench.sends(damaged(packet("m300v100")), at=START * 2)
    bench.run()
    assert bench.heard == []
    assert bench.position(bench.kernel.now) == 200


def test_an_ack_from_somebody_is_of_no_consequence() -> None:
    bench = Bench()
    bench.sends(ack(NODE, MOTHER), at=START)
    bench.run()
    assert (bench.heard, bench.told(), bench.node.receiving) == ([], [], False)


# ---- bodies that the device loses, or takes unchecked -------------------------------------------


def test_m132_sent_raw_is_lost_and_its_nul_opens_every_receiver_as_a_broadcast() -> None:
    bench = Bench()
    bench.sends(packet("m132"), at=START)
    bench.run()
    assert bench.heard == []
    assert bench.position(bench.kernel.now) == 0
    assert bench.node.receiving


def test_m132_with_a_space_behind_it_arrives() -> None:
    bench = Bench()
    bench.sends(packet("m132 "), at=START)
    bench.run()
    assert bench.answers == [ACKED]
    assert bench.position(bench.kernel.now) == 132


@pytest.mark.parametrize(("line", "instead"), [("m349", "m341"), ("m13", "m19")])
def test_a_damaged_m349_or_m13_is_accepted(line: str, instead: str) -> None:
    data = packet(line).replace(line.encode(), instead.encode())
    assert data != packet(instead)
    bench = Bench()
    bench.sends(data, at=START)
    bench.run()
    assert bench.answers == [ACKED]
    assert bench.position(bench.kernel.now) == int(instead[1:])


def test_46_characters_are_taken_and_47_are_lost_in_silence_and_reported() -> None:
    bench = Bench()
    bench.sends(packet("m200v100".ljust(46)), at=START)
    bench.run()
    assert (bench.answers, bench.position(bench.kernel.now)) == ([ACKED], 200)
    bench.sends(packet("m200v100".ljust(47)), at=bench.kernel.now + START)
    bench.run()
    assert (bench.answers, bench.position(bench.kernel.now)) == ([ACKED], 200)
    assert lost(bench) == ["a packet whose body is over 46 bytes"]


# ---- deaf time ----------------------------------------------------------------------------------


def after(first: bytes, pause: Ns, *, then: str = "v1") -> tuple[Bench, Transmission]:
    """A packet, what it brings about, and ``pause`` ns after the end of it all another packet."""
    bench = Bench()
    sent = bench.sends(first, at=START)
    bench.run()
    end = bench.bus.medium.free_at(0)
    assert end is not None
    bench.sends(packet(then), at=end + pause)
    bench.run()
    return bench, sent


@pytest.mark.parametrize(("size", "us"), [(0, 310), (5, 310), (39, 560)])
def test_a_node_hears_again_exactly_a_deaf_time_after_its_ack(size: int, us: int) -> None:
    assert after(packet(body(size)), us * US)[0].answers == [ACKED, ACKED]
    early, _ = after(packet(body(size)), us * US - 1)
    assert early.answers == [ACKED]
    assert early.node.snapshot(0).counters["nak"] == 0


@pytest.mark.parametrize(("size", "us"), [(5, 370), (39, 620)])
def test_after_a_broadcast_it_is_deaf_from_the_end_of_the_nul_on(size: int, us: int) -> None:
    assert after(packet(body(size), GENERAL_CALL), us * US)[0].answers == [ACKED]
    assert after(packet(body(size), GENERAL_CALL), us * US - 1)[0].answers == []


@pytest.mark.parametrize(("to", "us", "before"), [(NODE, 310, 1), (GENERAL_CALL, 370, 0)])
def test_a_nul_that_comes_by_itself_puts_the_deaf_time_off_too(
    to: int, us: int, before: int
) -> None:
    for pause, heard in ((us * US, 1), (us * US - 1, 0)):
        bench = Bench(lanes=2)
        data = packet("v1234", to)
        sent = bench.sends(data[:-1], at=START)
        nul = bench.sends(b"\x00", at=sent.end + 100 * US)
        handled = nul.end + (385 * US + bench.span(4) if before else 0)
        bench.sends(packet("v1"), at=handled + pause)
        bench.run()
        assert bench.answers == [ACKED] * (before + heard)


def test_the_ack_of_a_soft_op_is_never_heard_but_its_deaf_time_is_felt() -> None:
    soft_op = packet(bytes((DC1,)), GENERAL_CALL, 10)
    assert after(soft_op, 370 * US)[0].answers == [ACKED]
    assert after(soft_op, 370 * US - 1)[0].answers == []


def test_where_nobody_answers_a_node_is_deaf_as_after_a_broadcast() -> None:
    for pause, packets in ((370 * US, 2), (370 * US - 1, 1)):
        bench = Bench(settings=SacSettings(ack=False))
        sent = bench.sends(packet("v1234"), at=START)
        bench.sends(packet("v1234"), at=sent.end + pause)
        bench.run()
        assert bench.node.snapshot(0).counters["packets"] == packets


@pytest.mark.parametrize(
    "first",
    [
        damaged(packet("v1234")),
        packet("v1234", 99),
        damaged(packet("v1234", 99)),
        ack(NODE, 99),
        nak(NODE, 99),
        ack(99, NODE),
        damaged(packet("v1234", GENERAL_CALL)),
        b"\x41\x03\x00",
        b"\x02\x52\x01abc",
    ],
    ids=[
        "nak",
        "others",
        "others damaged",
        "ack seen",
        "nak seen",
        "others ack",
        "damaged broadcast",
        "noise",
        "cut short",
    ],
)
def test_nothing_is_lost_right_behind_what_was_not_accepted(first: bytes) -> None:
    bench, _ = after(first, 0)
    assert bench.answers[-1] == ACKED


def test_only_the_bytes_that_begin_in_the_deaf_time_are_lost() -> None:
    bench = Bench()
    bench.sends(packet("v1234"), at=START)
    bench.run()
    end = bench.bus.medium.free_at(0)
    assert end is not None
    # The packet's own STX is the second byte, 260 us after the first, which is lost.
    bench.sends(b"\x02" + packet("v1"), at=end + 100 * US)
    bench.run()
    assert bench.answers == [ACKED, ACKED]


def test_a_packet_that_comes_while_an_answer_is_made_is_lost() -> None:
    bench = Bench(lanes=2)
    sent = bench.sends(packet("v1234"), at=START)
    bench.sends(packet("v1"), at=sent.end)
    bench.run()
    assert bench.answers == [ACKED]


def test_without_deaf_time_a_packet_right_behind_the_ack_is_answered() -> None:
    bench = Bench(settings=SacSettings(deaf_time=False))
    bench.sends(packet("v1234"), at=START)
    bench.run()
    end = bench.bus.medium.free_at(0)
    assert end is not None
    bench.sends(packet("v1234"), at=end)
    bench.run()
    assert bench.answers == [ACKED, ACKED]


def test_without_deaf_time_even_a_packet_without_any_pause_is_answered() -> None:
    bench = Bench(lanes=2, settings=SacSettings(deaf_time=False))
    sent = bench.sends(packet("v1234") * 2, at=START)
    bench.run()
    assert bench.answers == [ACKED, ACKED]
    assert bench.heard[1].at == sent.end + 385 * US


# ---- packets of its own -------------------------------------------------------------------------


def test_what_is_sent_on_follows_the_ack_within_its_lead() -> None:
    bench = Bench()
    sent = bench.sends(packet("85hi!!"), at=START)
    bench.run()
    acked = Said(sent.end + 398 * US, ACKED)
    assert bench.heard == [
        acked,
        Said(acked.at + bench.span(4) + 8 * US, packet("hi!!", 85, NODE)),
    ]


def test_after_a_broadcast_it_is_sent_on_when_an_ack_would_have_been() -> None:
    bench = Bench()
    sent = bench.sends(packet("85hi!!", GENERAL_CALL), at=START)
    bench.run()
    assert bench.heard == [Said(sent.end + 398 * US, packet("hi!!", 85, NODE))]


def test_with_crc_off_its_own_packets_carry_none_and_one_that_arrives_is_still_checked() -> None:
    bench = Bench(settings=SacSettings(crc=False))
    bench.sends(packet("85hi"), at=START)
    bench.run()
    assert bench.answers == [ACKED, packet("hi", 85, NODE, crc=False)]
    bench.sends(damaged(packet("v1")), at=bench.kernel.now + START)
    bench.run()
    assert bench.answers[-1] == NAKED


def test_a_node_hears_what_another_sends_on_and_answers_it() -> None:
    bench = Bench(10, 11)
    bench.sends(packet("11m200v100", 10), at=START)
    bench.run()
    assert bench.answers == [
        ack(MOTHER, 10),
        packet("m200v100", 11, 10),
        ack(10, 11),
    ]
    assert bench.position(bench.kernel.now, 11) == 200
    assert bench.position(bench.kernel.now, 10) == 0


# ---- its receiver, as the bus sees it -----------------------------------------------------------


def test_a_receiver_is_open_from_its_address_to_the_trigger() -> None:
    bench = Bench()
    data = packet("v100")[:-1]
    opened = []
    for at in range(len(data)):
        sent = bench.sends(data[at : at + 1], at=bench.kernel.now)
        bench.kernel.run_until(sent.end)
        opened.append(bench.node.receiving)
    # Open after STX too: the address is still to come. And a NUL that may follow still counts.
    assert opened == [True] * len(data)
    bench.run()
    assert not bench.node.receiving


def test_a_receiver_that_is_not_meant_closes_at_the_address() -> None:
    bench = Bench()
    data = packet("v100", 99)
    opened = []
    for at in range(len(data)):
        sent = bench.sends(data[at : at + 1], at=bench.kernel.now)
        bench.kernel.run_until(sent.end)
        opened.append(bench.node.receiving)
    assert opened == [True] + [False] * (len(data) - 1)


def test_mid_packet_a_node_waits_for_ever() -> None:
    bench = Bench()
    data = packet("m200v100")
    bench.sends(data[:5], at=START)
    bench.sends(data[5:], at=START + 3_600_000 * MS)
    bench.run()
    assert bench.answers == [ACKED]
    assert bench.position(bench.kernel.now) == 200
