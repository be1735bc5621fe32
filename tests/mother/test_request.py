"""What mother sends: every body arrives checked, whatever its CRC byte."""

from __future__ import annotations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sacbus.language import parse
from sacbus.mother import Acknowledged, BadRequest, safe_body
from sacbus.wire import DeviceReceiver, Packet, Verdict, crc8, encode
from tests.mother.rig import Rig, body_spoilt

SAFE_BYTES = [value for value in range(256) if value not in (0, 2, 3, 6)]


def as_the_device_hears(packet: bytes, address: int = 10) -> Packet:
    found = DeviceReceiver(address).receive(packet)
    assert found is not None, "the device heard no packet"
    event, _ = found
    assert isinstance(event, Packet)
    return event


@pytest.mark.parametrize(
    ("line", "crc"),
    [(b"m132", 0x02), (b"m349", 0x03), (b"m13", 0x00), (b"+", 0x03)],
)
def test_bodies_whose_crc_the_device_misreads_arrive_checked(line: bytes, crc: int) -> None:
    """Spec, wire: "Bodies that a device loses or accepts unchecked, and the cure"."""
    assert crc8(line) == crc
    rig = Rig(10)
    assert isinstance(rig.ask(10, line), Acknowledged)
    (packet,) = rig.sent
    heard = as_the_device_hears(packet)
    assert heard == Packet(10, 1, line + b" ", Verdict.RIGHT)
    assert rig.bus.node(10).snapshot(rig.kernel.now).counters["ack"] == 1
    assert rig.steps(10) == {b"m132": 132, b"m349": 349, b"m13": 13, b"+": 1}[line]


def test_m132_sent_raw_is_lost_as_on_the_device() -> None:
    rig = Rig(10)
    rig.port.talk(encode(10, 1, b"m132"))
    rig.kernel.run()
    assert rig.answers == []
    assert rig.steps(10) == 0


def test_a_damaged_m349_sent_raw_is_accepted_as_on_the_device_but_never_mothers() -> None:
    damaged = encode(10, 1, b"m349").replace(b"m349", b"m949")
    raw = Rig(10)
    raw.port.talk(damaged)
    raw.kernel.run()
    assert raw.answers == [bytes.fromhex("02 01 0a 06")]
    assert raw.steps(10) == 949
    mothers = Rig(10)
    mothers.expect([body_spoilt])
    outcome = mothers.ask(10, b"m349")
    assert isinstance(outcome, Acknowledged)
    assert outcome.attempts == 2
    assert mothers.steps(10) == 349


def test_most_bodies_go_out_as_they_are() -> None:
    assert safe_body(b"m3000a2d1") == b"m3000a2d1"
    assert safe_body(b" hello") == b" hello"


def test_the_empty_body_is_left_alone_although_its_crc_is_00() -> None:
    assert crc8(b"") == 0
    assert safe_body(b"") == b""
    assert isinstance(Rig(10).ask(10, b""), Acknowledged)


@pytest.mark.parametrize(("line", "crc"), [(b"m13", 0x23), (b"m132", 0x9F), (b"m349", 0xC1)])
def test_one_space_always_cures(line: bytes, crc: int) -> None:
    assert crc8(safe_body(line)) == crc


@given(st.lists(st.sampled_from(SAFE_BYTES), max_size=45).map(bytes))
def test_any_body_up_to_45_bytes_is_sent_and_arrives_checked(line: bytes) -> None:
    sent = safe_body(line)
    assert sent.rstrip(b" ") == line.rstrip(b" ")
    assert len(line) <= len(sent) <= len(line) + 1
    verdict = Verdict.RIGHT if line else Verdict.UNCHECKED
    assert as_the_device_hears(encode(10, 1, sent)) == Packet(10, 1, sent, verdict)


@given(st.from_regex(rb"[mM][0-9]{1,4}(v[1-9][0-9]{0,2})?(a[1-9])?", fullmatch=True))
def test_the_spaces_change_nothing_of_a_command(line: bytes) -> None:
    assert parse(safe_body(line)).command == parse(line).command
    assert parse(line + b"  ").command == parse(line).command


@pytest.mark.parametrize(
    ("value", "name"),
    [(0, "NUL"), (2, "STX"), (3, "ETX"), (6, "ACK")],
    ids=["00", "02", "03", "06"],
)
@pytest.mark.parametrize("place", ["first", "last"])
def test_bytes_that_would_end_or_break_the_packet_are_refused(
    value: int, name: str, place: str
) -> None:
    byte = bytes((value,))
    line = byte + b"m400" if place == "first" else b"m400" + byte
    with pytest.raises(BadRequest, match=rf"byte {value:02x} \({name}\) would end or break"):
        safe_body(line)


def a_body(length: int, spaces: int) -> bytes:
    """A body of this length that needs so many spaces."""
    for number in range(1_000):
        line = b"m400 %0*d" % (length - 5, number)
        if (crc8(line) in (0, 2, 3)) == (spaces == 1):
            return line
    pytest.fail("no such body")


@pytest.mark.parametrize(("length", "spaces"), [(46, 0), (45, 1)])
def test_46_bytes_are_the_most_with_the_spaces_they_need(length: int, spaces: int) -> None:
    line = a_body(length, spaces)
    assert safe_body(line) == line + b" " * spaces
    rig = Rig(10)
    assert isinstance(rig.ask(10, line), Acknowledged)
    assert rig.steps(10) == 400


@pytest.mark.parametrize(("length", "spaces"), [(47, 0), (46, 1)])
def test_more_than_46_bytes_with_their_spaces_are_refused(length: int, spaces: int) -> None:
    line = a_body(length, spaces)
    expected = f"expected at most 46 characters, got {length}"
    if spaces:
        expected += " and a trailing space for its CRC"
    with pytest.raises(BadRequest, match=f"{expected}; split it"):
        safe_body(line)


@given(st.binary(max_size=60))
def test_whatever_is_asked_is_sent_safely_or_refused(line: bytes) -> None:
    try:
        sent = safe_body(line)
    except BadRequest:
        assert len(line) > 45 or set(line) & {0, 2, 3, 6}
        return
    assume(sent)
    assert len(sent) <= 46
    assert crc8(sent) not in (0, 2, 3)


@pytest.mark.parametrize("line", [b"m" * 3_000, b"m" * 3_000 + b"\x03"])
def test_a_line_that_is_refused_is_quoted_but_not_at_any_length(line: bytes) -> None:
    with pytest.raises(BadRequest) as refused:
        safe_body(line)
    assert str(refused.value).startswith(f"line '{'m' * 57}'…: ")
    assert len(str(refused.value)) < 200
