"""What the bus must know of the SAC network, held against the receivers that it speaks for."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from nodes.sac.protocol import SAC_PROTOCOL
from sacbus.node import EVERYONE, Said
from sacbus.wire import (
    Answer,
    DeviceReceiver,
    Fault,
    LineFault,
    Packet,
    PacketReceiver,
    Verdict,
    ack,
    encode,
    nak,
)
from tests.bus.strategies import bursts
from tests.nodes.sac.bench import NODE

PACKET = encode(NODE, 1, b"m200")


def test_it_is_one_pair_of_wires_at_38400_baud() -> None:
    assert (SAC_PROTOCOL.name, SAC_PROTOCOL.lanes) == ("sac", 1)
    assert (SAC_PROTOCOL.rate.baud, SAC_PROTOCOL.rate.bits) == (38_400, 10)


@pytest.mark.parametrize(
    ("data", "cuts"),
    [
        (PACKET, [9]),
        (PACKET[:-1], []),
        (ack(1, NODE), []),
        (PACKET + PACKET, [9, 10, 19]),
        (encode(NODE, 1, b"m200", crc=False), []),
        (encode(NODE, 1, b"a\x03\x00b"), [6, 7, 9]),
        # ETX before the source: the byte after the source is the trigger.
        (b"\x02\x52\x03\x01\x41\x41", [5]),
        (b"\x02\x52\x01\x03\x03\x03\xa5\x00", [7]),
        # What goes on with an earlier transmission: STX, destination and source may have been in
        # it, and its first byte may put an answer off.
        (b"\xa5\x00", [1]),
        (b"\x03\xa5\x00", [1, 2]),
        (b"\x52\x03\x01\x03\xa5\x41\x41", [1, 3, 4, 5, 6]),
        (b"abcdef", [1, 2, 3]),
        (b"\x03\x03", [1]),
        (b"\x00" + PACKET, [1, 10]),
    ],
)
def test_a_node_may_have_to_act_at_the_end_of_a_trigger_byte(data: bytes, cuts: list[int]) -> None:
    assert list(SAC_PROTOCOL.cuts(data)) == cuts


@pytest.mark.parametrize(
    ("data", "addressed"),
    [
        (PACKET, [NODE]),
        (encode(0, 1, b"m200"), EVERYONE),
        (ack(1, NODE), [1]),
        (b"A" + PACKET, [NODE]),
        (PACKET + encode(10, 1, b""), [10, NODE]),
        (PACKET + encode(0, 1, b""), EVERYONE),
        (b"hello\x03\x00", []),
        (b"\x02", EVERYONE),
        (PACKET + b"\x02", EVERYONE),
        (b"\x02\x02\x02\x0a", [10]),
    ],
)
def test_those_are_addressed_for_whom_a_packet_opens(
    data: bytes, addressed: list[int] | None
) -> None:
    found = SAC_PROTOCOL.addressed(data)
    assert (found if found is None else list(found)) == addressed


@given(st.binary(max_size=12), bursts)
@example(b"\x02\x52\x01\x61\x03", b"\x41\x00\x41\x41")
@example(b"\x02\x52\x03", b"\x01\x41\x41\x41")
@example(b"\x02", b"\x52\x03\x01\x41\x41")
def test_a_device_that_hears_at_the_cuts_acts_nowhere_else(before: bytes, data: bytes) -> None:
    cuts = {*SAC_PROTOCOL.cuts(data), len(data)}
    assert sorted(cuts) == [*SAC_PROTOCOL.cuts(data), len(data)]
    receiver = DeviceReceiver(NODE)
    at = 0
    while (found := receiver.receive(before, at)) is not None:
        at = found[1]
    for index in range(len(data)):
        found = receiver.receive(data[index : index + 1])
        # An ACK seen, or a body too long, is nothing to act on.
        if found is not None and isinstance(found[0], Packet):
            assert index + 1 in cuts


@pytest.mark.slow
@given(bursts, st.sampled_from((NODE, 10, 5)))
def test_a_receiver_that_is_not_addressed_is_idle_and_stays_so(data: bytes, address: int) -> None:
    addressed = SAC_PROTOCOL.addressed(data)
    receiver = DeviceReceiver(address)
    found = receiver.receive(data)
    if addressed is not EVERYONE and address not in addressed:
        assert found is None
        assert not receiver.open


def test_its_decoder_is_the_robust_receiver() -> None:
    decoder = SAC_PROTOCOL.decoder()
    assert isinstance(decoder, PacketReceiver)
    assert decoder.receive(PACKET) == [Packet(NODE, 1, b"m200", Verdict.RIGHT)]
    assert SAC_PROTOCOL.decoder() is not decoder


@pytest.mark.parametrize(
    ("event", "said"),
    [
        (Answer(1, NODE, accepted=True), Said("ack", NODE, 1, b"", "ACK", "", 4)),
        (Answer(1, NODE, accepted=False), Said("nak", NODE, 1, b"", "NAK", "", 4)),
        (
            LineFault(Fault.NOISE, b"\x41\x00"),
            Said("garbage", None, None, b"\x41\x00", "noise", "", 2),
        ),
        (
            LineFault(Fault.CUT_SHORT, b"\x02"),
            Said("garbage", None, None, b"\x02", "cut short", "", 1),
        ),
        (
            LineFault(Fault.TOO_LONG, b"\x02\x02"),
            Said("garbage", None, None, b"\x02\x02", "too long", "", 2),
        ),
    ],
)
def test_answers_and_garbage_are_told(event: object, said: Said) -> None:
    assert SAC_PROTOCOL.tell(event) == said


@pytest.mark.parametrize(
    ("data", "verdict", "size"),
    [
        (PACKET, "right", 10),
        (encode(NODE, 1, b"m200", crc=False), "unchecked", 9),
        (PACKET[:-2] + b"\x99\x00", "wrong", 10),
        # Whatever is not the NUL ends the frame, and belongs to what comes next.
        (PACKET[:-2] + b"\x99" + PACKET, "wrong", 9),
        (PACKET[:-1] + PACKET, "no NUL", 9),
    ],
)
def test_a_packet_is_told_with_what_its_check_says(data: bytes, verdict: str, size: int) -> None:
    event = SAC_PROTOCOL.decoder().receive(data)[0]
    assert SAC_PROTOCOL.tell(event) == Said(
        "packet", 1, NODE, b"m200", "move 200 full steps", verdict, size, 385_000
    )


def test_a_long_packet_is_answered_later_and_a_general_call_never() -> None:
    long = SAC_PROTOCOL.tell(Packet(NODE, 1, b"V100 as before", Verdict.RIGHT))
    assert long.reply_after == 385_000 + 9 * 13_000
    to_all = SAC_PROTOCOL.tell(Packet(0, 1, b"S", Verdict.UNCHECKED))
    assert (to_all.destination, to_all.reply_after) == (0, None)


def test_the_devices_own_receiver_calls_a_packet_wrong_as_well() -> None:
    assert SAC_PROTOCOL.tell(Packet(NODE, 1, b"S", Verdict.WRONG)).verdict == "wrong"


def test_what_is_no_event_of_this_network_is_a_mistake() -> None:
    with pytest.raises(TypeError, match="not an event of the SAC decoder: 'ACK'"):
        SAC_PROTOCOL.tell("ACK")


@given(bursts)
@example(b"\x02\x52\x01m1235\x03\x0c")
def test_whatever_the_decoder_gives_can_be_told_and_has_its_size(data: bytes) -> None:
    for event, begin, end in SAC_PROTOCOL.decoder().locate(data + nak(1, NODE)):
        said = SAC_PROTOCOL.tell(event)
        assert said.kind in {"packet", "ack", "nak", "garbage"}
        assert said.words
        assert (said.source is None) == (said.destination is None) == (said.kind == "garbage")
        # A peer may send an answer with an ending, and leave out the NUL behind a CRC of 00.
        assert said.size - 1 <= end - begin <= said.size + 3
