"""The device's receiver against recordings of the firmware and a machine that reads byte by byte.

The recordings are read as far as a receiver without time can: see `lost_to_deafness`.
"""

import json
from enum import Enum, auto
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.wire import (
    ACK,
    ETX,
    GENERAL_CALL,
    MAX_BODY,
    NUL,
    STX,
    Answer,
    DeviceReceiver,
    Fault,
    Heard,
    LineFault,
    Packet,
    Verdict,
    ack,
    crc8,
    encode,
    nak,
)

OWN = 82
Vector = dict[str, Any]  # parsed JSON: its values are of any type

VECTORS_FILE = Path(__file__).parents[1] / "data" / "wire-vectors.jsonl"
VECTORS: list[Vector] = [
    vector
    for vector in map(json.loads, VECTORS_FILE.read_text(encoding="utf-8").splitlines())
    if "rx_hex" in vector
]


def heard(receiver: DeviceReceiver, *chunks: bytes) -> list[tuple[Heard, int]]:
    """All events of the chunks, with the index in their sum after the byte that triggered each."""
    events = []
    before = 0
    for chunk in chunks:
        at = 0
        while (found := receiver.receive(chunk, at)) is not None:
            event, at = found
            assert not receiver.open
            events.append((event, before + at))
        before += len(chunk)
    return events


# ---- the firmware's recordings ------------------------------------------------------------------


def forwarded_to(packet: Packet) -> tuple[int, bytes] | None:
    """Where the device sends a body that begins with a digit or a slash, and what."""
    digits = len(packet.body) - len(packet.body.lstrip(b"0123456789"))
    if digits:
        return int(packet.body[:digits]), packet.body[digits:]
    if packet.body.startswith(b"/"):
        return packet.src, packet.body[1:]
    return None


def reaction(event: Heard) -> tuple[bytes, bytes]:
    """What the firmware prints at its terminal and sends for an event."""
    match event:
        case Answer():
            return b"K\n", b""
        case Packet(verdict=Verdict.WRONG):
            return b"Bad CRC\n", b"" if event.dest == GENERAL_CALL else nak(event.src, OWN)
        case Packet():
            answer = b"" if event.dest == GENERAL_CALL else ack(event.src, OWN)
            if forward := forwarded_to(event):
                dest, body = forward
                return b"%d> %b\r\n" % (dest, body), answer + encode(dest, OWN, body)
            return b"%d:%d> %b\r\n" % (event.src, event.dest, event.body), answer
        case LineFault():
            pytest.fail("no recording has a body of 47 bytes or more")


def outcome(event: Heard) -> str:
    """The word that the recordings have for an event."""
    match event:
        case Answer():
            return "ack_seen"
        case Packet(verdict=Verdict.WRONG):
            return "bad_crc"
        case Packet():
            return "forwarded" if forwarded_to(event) else "message"
        case LineFault():
            pytest.fail("no recording has a body of 47 bytes or more")


def reactions(events: list[tuple[Heard, int]]) -> tuple[bytes, bytes]:
    pairs = [reaction(event) for event, _ in events]
    return b"".join(text for text, _ in pairs), b"".join(sent for _, sent in pairs)


def whole(vector: Vector) -> list[tuple[Heard, int]]:
    return heard(DeviceReceiver(OWN), bytes.fromhex(vector["rx_hex"]))


def lost_to_deafness(vector: Vector) -> bool:
    """Whether the device was deaf to a packet that its receiver alone, without time, would hear.

    So it is when a packet is accepted and the next event comes out of the same unbroken run of
    bytes: the device was still busy with the first. That is the node's part and its tests'. Where
    the device merely answered into the rest of the bytes (`overlaps`) the events are the same.
    """
    pauses = set()
    if vector["gap_us"]:
        if isinstance(vector["gap_us"], int):
            return False  # a pause after every byte
        done = 0
        segments = vector["gap_us"]["segments"]
        for port, pause, segment in zip(
            vector["gap_us"]["ports"], vector["gap_us"]["before_each_us"], segments, strict=True
        ):
            if pause:
                pauses.add(done)
            done += len(segment) // 2 if port == "net" else 0
    return any(
        isinstance(first, Packet)
        and first.verdict is not Verdict.WRONG
        and not any(trigger <= pause < end for pause in pauses)
        for (first, trigger), (_, end) in pairwise(whole(vector))
    )


def recorded(vector: Vector) -> tuple[bytes, bytes]:
    text = vector["terminal"].encode("latin-1")
    if isinstance(vector["gap_us"], dict) and "term" in vector["gap_us"]["ports"]:
        text = text.removesuffix(b"> \r\n")  # what was typed meanwhile is no business of the wire
    return text, bytes.fromhex(vector["tx_hex"])


every_vector = pytest.mark.parametrize("vector", VECTORS, ids=[v["name"] for v in VECTORS])


@every_vector
def test_a_recorded_exchange_is_heard_as_the_firmware_heard_it(vector: Vector) -> None:
    events = whole(vector)
    if lost_to_deafness(vector):
        events = events[:1]
    assert reactions(events) == recorded(vector)
    outcomes = [outcome(event) for event, _ in events] or ["silent"]
    assert vector["outcome"] in outcomes
    assert vector["accepted"] == (not {"message", "forwarded"}.isdisjoint(outcomes))


@every_vector
def test_a_recorded_exchange_is_the_same_when_split_anywhere(vector: Vector) -> None:
    data = bytes.fromhex(vector["rx_hex"])
    events = whole(vector)
    for at in range(len(data) + 1):
        assert heard(DeviceReceiver(OWN), data[:at], data[at:]) == events
    assert heard(DeviceReceiver(OWN), *(bytes((byte,)) for byte in data)) == events


@every_vector
def test_leading_noise_without_stx_changes_nothing(vector: Vector) -> None:
    noise = b"\x52\x01\x00\x03\xff\x06\x15S\x03\x00"
    data = bytes.fromhex(vector["rx_hex"])
    shifted = [(event, end - len(noise)) for event, end in heard(DeviceReceiver(OWN), noise + data)]
    assert shifted == whole(vector)


def test_deafness_explains_two_recordings_and_no_more() -> None:
    assert [v["name"] for v in VECTORS if lost_to_deafness(v)] == ["b2b", "b2b_first_bcast"]
    assert len(VECTORS) == 92


# ---- the machine that reads byte by byte --------------------------------------------------------


class Place(Enum):
    IDLE = auto()
    DEST = auto()
    SOURCE = auto()
    BODY = auto()


class ByteMachine:
    """The device's receiver as the wire specification lists it, one byte at a time."""

    def __init__(self, address: int) -> None:
        self.address = address
        self.place = Place.IDLE
        self.etx_seen = False
        self.dest = self.src = 0
        self.body = b""

    def feed(self, byte: int) -> Heard | None:
        if byte == STX:
            self.place, self.etx_seen, self.body = Place.DEST, False, b""
        elif self.place is Place.DEST:
            self.dest = byte
            own = byte in (self.address, GENERAL_CALL)
            self.place = Place.SOURCE if own else Place.IDLE
        elif self.place is not Place.IDLE and byte == ETX:
            self.etx_seen = True
        elif self.place is Place.SOURCE:
            self.src = byte
            self.place = Place.BODY
        elif self.place is Place.BODY and self.etx_seen:
            return self.verdict(byte)
        elif self.place is Place.BODY and byte == ACK:
            self.place = Place.IDLE
            return Answer(self.dest, self.src, accepted=True)
        elif self.place is Place.BODY:
            self.body += bytes((byte,))
            if len(self.body) > MAX_BODY:
                self.place = Place.IDLE
                frame = bytes((STX, self.dest, self.src)) + self.body
                return LineFault(Fault.TOO_LONG, frame)
        return None

    def verdict(self, check: int) -> Packet:
        self.place = Place.IDLE
        text = self.body.split(b"\x00")[0]
        if check == NUL:
            verdict = Verdict.UNCHECKED
        elif check == crc8(text):
            verdict = Verdict.RIGHT
        else:
            verdict = Verdict.WRONG
        return Packet(self.dest, self.src, text, verdict)


def heard_byte_by_byte(machine: ByteMachine, data: bytes) -> list[tuple[Heard, int]]:
    found = ((machine.feed(byte), end) for end, byte in enumerate(data, 1))
    return [(event, end) for event, end in found if event is not None]


@cache
def traffic(address: int) -> st.SearchStrategy[bytes]:
    """Bytes in which every trap of the receiver at this address is likely."""
    addresses = st.sampled_from([address, 0, 1, 2, 3, 6, 85]) | st.integers(0, 255)
    byte = st.sampled_from([0, 2, 3, 6, 0x15, 0x11, ord("m"), ord("1"), address])
    body = st.binary(max_size=52) | st.lists(byte, max_size=52).map(bytes)
    frame = st.builds(encode, addresses, addresses, body)
    plain = st.builds(lambda d, s, b: encode(d, s, b, crc=False), addresses, addresses, body)
    answer = st.builds(ack, addresses, addresses) | st.builds(nak, addresses, addresses)
    cut = st.builds(lambda f, n: f[:n], frame, st.integers(0, 55))
    etx_first = st.builds(
        lambda d, n, s, m, c: bytes((STX, d)) + b"\3" * n + bytes((s,)) + b"\3" * m + bytes((c,)),
        addresses,
        st.integers(0, 3),
        addresses,
        st.integers(0, 3),
        addresses,
    )
    noise = st.lists(byte, max_size=60).map(bytes) | st.binary(max_size=60)
    piece = st.one_of(frame, plain, answer, cut, etx_first, noise)
    return st.lists(piece, max_size=6).map(b"".join)


@st.composite
def traffic_to(draw: st.DrawFn, addresses: st.SearchStrategy[int]) -> tuple[int, list[bytes]]:
    """An address, and bytes in pieces."""
    address = draw(addresses)
    data = draw(traffic(address))
    cuts = sorted(draw(st.lists(st.integers(0, len(data)), max_size=8)))
    return address, [data[a:b] for a, b in pairwise([0, *cuts, len(data)])]


@given(traffic_to(st.integers(0, 255)))
def test_the_receiver_agrees_with_the_machine_on_any_bytes_in_any_pieces(
    case: tuple[int, list[bytes]],
) -> None:
    address, chunks = case
    machine = ByteMachine(address)
    receiver = DeviceReceiver(address)
    before = 0
    for chunk in chunks:
        expected = heard_byte_by_byte(machine, chunk)
        assert heard(receiver, chunk) == expected, f"after {before} bytes"
        assert receiver.open == (machine.place is not Place.IDLE)
        before += len(chunk)


@given(traffic_to(st.integers(4, 255)), st.integers(4, 255))
def test_a_new_address_counts_from_the_next_destination(
    case: tuple[int, list[bytes]], other: int
) -> None:
    address, chunks = case
    machine = ByteMachine(address)
    receiver = DeviceReceiver(address)
    for new, chunk in zip([address, other] * len(chunks), chunks, strict=False):
        machine.address = receiver.address = new
        assert heard(receiver, chunk) == heard_byte_by_byte(machine, chunk)
        assert receiver.open == (machine.place is not Place.IDLE)
        assert receiver.address == new


@given(traffic_to(st.integers(10, 255)), st.binary(max_size=80))
def test_open_tells_whether_a_byte_other_than_stx_can_change_anything(
    case: tuple[int, list[bytes]], more: bytes
) -> None:
    address, chunks = case
    receiver = DeviceReceiver(address)
    heard(receiver, *chunks)
    if receiver.open:
        # From wherever it stands, one of these comes to an event without another STX.
        continued = []
        for ending in (b"\x03\x00", b"\x01\x03\x00", b"%c\x01\x03\x00" % address):
            again = DeviceReceiver(address)
            heard(again, *chunks)
            continued += heard(again, ending)
        assert continued
    else:
        assert heard(receiver, more.replace(b"\x02", b"")) == []
        assert not receiver.open


@given(traffic_to(st.integers(10, 255)), st.integers(0, 40))
def test_reading_from_the_middle_is_reading_the_rest(
    case: tuple[int, list[bytes]], start: int
) -> None:
    address, chunks = case
    *before, data = chunks
    receivers = [DeviceReceiver(address), DeviceReceiver(address)]
    for receiver in receivers:
        heard(receiver, *before)
    found = receivers[0].receive(data, start)
    rest = receivers[1].receive(data[start:])
    assert found == (rest and (rest[0], rest[1] + start))


def test_the_index_counts_from_the_data_and_not_from_what_was_held() -> None:
    packet = encode(OWN, 1, b"m1")
    receiver = DeviceReceiver(OWN)
    assert receiver.receive(packet[:4]) is None
    found = receiver.receive(b"deaf" + packet[4:], len(b"deaf"))
    assert found == (Packet(OWN, 1, b"m1", Verdict.RIGHT), 4 + len(packet) - 5)


def test_endless_etx_does_not_grow_the_receiver() -> None:
    receiver = DeviceReceiver(OWN)
    for piece in (b"\x02\x52", b"\x03" * 9999, b"\x01", b"\x03" * 9999):
        assert receiver.receive(piece) is None
        assert len(receiver._held) <= 50
    assert receiver.receive(b"\x00") == (Packet(OWN, 1, b"", Verdict.UNCHECKED), 1)


# ---- what the specification says, one sentence each ---------------------------------------------


def only_event(data: bytes, address: int = OWN) -> Heard:
    [(event, _)] = heard(DeviceReceiver(address), data)
    return event


def test_46_body_bytes_are_a_packet_and_47_are_dropped_at_the_47th() -> None:
    body = b"m" * MAX_BODY
    assert only_event(encode(OWN, 1, body)) == Packet(OWN, 1, body, Verdict.RIGHT)
    packet = encode(OWN, 1, body + b"m")
    fault = LineFault(Fault.TOO_LONG, packet[:50])
    assert heard(DeviceReceiver(OWN), packet) == [(fault, 50)]


def test_an_ack_after_46_body_bytes_is_an_ack() -> None:
    packet = b"\x02\x52\x01" + b"m" * MAX_BODY + b"\x06"
    assert only_event(packet) == Answer(OWN, 1, accepted=True)


def test_the_limit_counts_bytes_behind_a_nul_too() -> None:
    packet = encode(OWN, 1, b"ab\x00" + b"m" * 44)
    assert only_event(packet) == LineFault(Fault.TOO_LONG, packet[:50])


def test_a_nul_in_the_body_cuts_text_and_crc_there() -> None:
    packet = b"\x02\x52\x01ab\x00cd\x03" + bytes((crc8(b"ab"),))
    assert only_event(packet) == Packet(OWN, 1, b"ab", Verdict.RIGHT)


def test_the_destination_place_takes_an_etx_for_an_address() -> None:
    assert heard(DeviceReceiver(OWN), b"\x02\x03\x52\x01\x03\x00") == []


def test_a_device_at_address_2_hears_the_general_call_only() -> None:
    data = encode(2, 1, b"m1") + encode(0, 1, b"S")
    assert only_event(data, address=2) == Packet(0, 1, b"S", Verdict.RIGHT)


def test_the_general_call_with_a_wrong_crc_is_reported_as_such() -> None:
    assert only_event(b"\x02\x00\x01S\x03\x55") == Packet(0, 1, b"S", Verdict.WRONG)


@pytest.mark.parametrize("address", [-1, 256])
def test_an_address_that_is_no_byte_is_refused(address: int) -> None:
    with pytest.raises(ValueError, match=f"0 to 255: got {address}"):
        DeviceReceiver(address)
    receiver = DeviceReceiver(OWN)
    with pytest.raises(ValueError, match="0 to 255"):
        receiver.address = address
    assert receiver.address == OWN
