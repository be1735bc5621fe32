"""The receiver for difficult lines: frames as specified, for one address."""

from __future__ import annotations

import pytest

from nodes.sac import SacSettings
from nodes.sac.robust import RobustReceiver
from sacbus.kernel import MS, US
from sacbus.node import ReportKind
from sacbus.wire import Fault, LineFault, Packet, Verdict, ack, encode, nak
from tests.nodes.sac.bench import NODE, Bench, Said, packet

AT = 20 * MS
ROBUST = SacSettings(receiver="robust")
ACKED, NAKED = ack(1, NODE), nak(1, NODE)


def events(data: bytes) -> list[tuple[object, int]]:
    receiver = RobustReceiver(NODE)
    found: list[tuple[object, int]] = []
    at = 0
    while (event := receiver.receive(data, at)) is not None:
        found.append(event)
        at = event[1]
    return found


@pytest.mark.parametrize("body", [b"m200", b"m132", b"m349", b"a\x06b", b"m13", b""])
def test_a_frame_is_an_event_at_its_last_byte_whatever_its_crc_happens_to_be(body: bytes) -> None:
    data = encode(NODE, 1, body)
    # A CRC of 00 is where the NUL would stand: the frame may be over with it.
    size = len(data) - (data[-2] == 0)
    packet_heard = Packet(NODE, 1, body, Verdict.RIGHT)
    assert events(data) == [(packet_heard, size)]
    assert events(b"noise" + data + data) == [
        (packet_heard, 5 + size),
        (packet_heard, 5 + len(data) + size),
    ]


def test_a_general_call_is_for_this_node_too_and_others_are_not() -> None:
    assert [event for event, _ in events(encode(0, 1, b"S"))] == [Packet(0, 1, b"S", Verdict.RIGHT)]
    assert events(encode(99, 1, b"S") + ack(NODE, 1) + nak(NODE, 1) + b"noise") == []


def test_a_frame_with_a_wrong_crc_is_a_packet_to_refuse() -> None:
    data = encode(NODE, 1, b"m200")
    wrong = data.replace(b"m200", b"m300")
    assert [event for event, _ in events(wrong)] == [Packet(NODE, 1, b"m300", Verdict.WRONG)]
    assert events(encode(99, 1, b"m200").replace(b"m200", b"m300")) == []


def test_a_body_over_46_bytes_is_a_fault_and_46_are_not() -> None:
    long = encode(NODE, 1, b"x" * 47)
    assert events(long) == [(LineFault(Fault.TOO_LONG, b"x" * 47), len(long))]
    fits = encode(NODE, 1, b"x" * 46)
    assert events(fits) == [(Packet(NODE, 1, b"x" * 46, Verdict.RIGHT), len(fits))]


def test_its_receiver_is_always_open() -> None:
    assert RobustReceiver(NODE).open


@pytest.mark.parametrize("line", ["m132", "m349", "m13"])
def test_a_node_with_it_takes_what_the_device_loses(line: str) -> None:
    bench = Bench(settings=ROBUST)
    bench.sends(packet(line), at=AT)
    bench.run()
    assert bench.answers == [ACKED]
    assert bench.position(bench.kernel.now) == int(line[1:])


def test_a_node_with_it_checks_a_crc_that_the_device_does_not() -> None:
    bench = Bench(settings=ROBUST)
    bench.sends(packet("m349").replace(b"m349", b"m341"), at=AT)
    bench.run()
    assert bench.answers == [NAKED]
    assert bench.position(bench.kernel.now) == 0


def test_a_node_with_it_acts_and_counts_its_turnaround_from_the_frames_end() -> None:
    bench = Bench(settings=ROBUST)
    sent = bench.sends(packet("m9v10"), at=AT)
    bench.run()
    assert bench.heard == [Said(sent.end + 385 * US, ACKED)]
    twin = Bench(settings=ROBUST)
    twin.sends(packet("m9v10"), at=AT)
    assert twin.position(sent.end + 40 * US - 1) == 0
    assert twin.position(sent.end + 40 * US) == 1


def test_a_node_with_it_is_answered_for_split_packets_too() -> None:
    bench = Bench(settings=ROBUST)
    data = packet("m200v100")
    for at in range(len(data)):
        bench.sends(data[at : at + 1], at=bench.kernel.now + MS)
        bench.kernel.run_until(bench.kernel.now + bench.span(1))
    bench.run()
    assert bench.answers == [ACKED]
    assert bench.position(bench.kernel.now) == 200


def test_a_node_with_it_reports_what_is_too_long() -> None:
    bench = Bench(settings=ROBUST)
    bench.sends(packet("m200".ljust(47)), at=AT)
    bench.run()
    assert bench.answers == []
    assert [report.kind for report in bench.told()] == [ReportKind.LOST]


@pytest.mark.parametrize("behind", [packet("m" + "1" * 45, 99), b"noise" * 200])
def test_a_node_with_it_answers_at_once_whatever_its_sender_goes_on_with(behind: bytes) -> None:
    alone, followed = Bench(settings=ROBUST, lanes=2), Bench(settings=ROBUST, lanes=2)
    alone.sends(packet("m200"), at=AT)
    followed.sends(packet("m200") + behind, at=AT)
    for bench in (alone, followed):
        bench.run()
    assert followed.heard == alone.heard
    assert followed.heard[0].data == ACKED
