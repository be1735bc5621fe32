"""The bytes of packets and answers, and the room's public names."""

import json
from pathlib import Path

import pytest

import sacbus.wire
from sacbus.wire import MOTHER, ack, crc8, encode, nak

VECTORS = Path(__file__).parents[1] / "data" / "wire-vectors.jsonl"
# What device 82 put on the network for a line typed at its terminal.
SENT = [
    vector
    for vector in map(json.loads, VECTORS.read_text(encoding="utf-8").splitlines())
    if "typed" in vector and vector["tx_hex"]
]


@pytest.mark.parametrize("vector", SENT, ids=[vector["name"] for vector in SENT])
def test_a_packet_is_encoded_as_the_firmware_sends_it(vector: dict[str, str]) -> None:
    # The terminal shows "dest> body".
    dest, body = vector["terminal"].removesuffix("\r\n").split("> ", 1)
    assert encode(int(dest), 82, body.encode("latin-1")).hex() == vector["tx_hex"]


def test_there_are_recordings_of_sent_packets() -> None:
    assert len(SENT) == 10


def test_without_crc_the_nul_follows_etx() -> None:
    assert encode(82, 1, b"m1234", crc=False) == b"\x02\x52\x01m1234\x03\x00"


def test_an_empty_body_has_the_crc_00() -> None:
    assert encode(82, 1, b"") == b"\x02\x52\x01\x03\x00\x00"


def test_nothing_is_escaped_and_no_length_refused() -> None:
    body = bytes(range(256))
    assert encode(255, 0, body) == b"\x02\xff\x00" + body + b"\x03" + bytes((crc8(body), 0))


def test_answers_are_four_bytes() -> None:
    assert ack(MOTHER, 82) == b"\x02\x01\x52\x06"
    assert nak(MOTHER, 82) == b"\x02\x01\x52\x15"


@pytest.mark.parametrize(("dest", "src"), [(256, 1), (-1, 1), (1, 256), (1, -1)])
def test_an_address_that_is_no_byte_is_refused(dest: int, src: int) -> None:
    with pytest.raises(ValueError, match=f"0 to 255: got dest {dest}, src {src}"):
        encode(dest, src, b"S")
    with pytest.raises(ValueError, match="0 to 255"):
        encode(dest, src, b"S", crc=False)
    with pytest.raises(ValueError, match="0 to 255"):
        ack(dest, src)
    with pytest.raises(ValueError, match="0 to 255"):
        nak(dest, src)


def test_the_public_names_stand_still() -> None:
    assert sorted(sacbus.wire.__all__) == [
        "ACK",
        "Answer",
        "CRC_IS_FAST",
        "DC1",
        "DC2",
        "DeviceReceiver",
        "ETX",
        "Fault",
        "GENERAL_CALL",
        "Heard",
        "LineFault",
        "MAX_BODY",
        "MAX_FRAME",
        "MOTHER",
        "NAK",
        "NUL",
        "Packet",
        "PacketReceiver",
        "STX",
        "Verdict",
        "ack",
        "crc8",
        "encode",
        "nak",
    ]
    assert all(hasattr(sacbus.wire, name) for name in sacbus.wire.__all__)
