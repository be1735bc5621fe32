"""The robust receiver, case by case; its laws are in test_robust_laws.py."""

import pytest

from sacbus.wire import (
    STX,
    Answer,
    Fault,
    Heard,
    LineFault,
    Packet,
    PacketReceiver,
    Verdict,
    ack,
    crc8,
    encode,
    nak,
)

M7 = encode(82, 5, b"m7")
HEARD_M7 = Packet(82, 5, b"m7", Verdict.RIGHT)


def right(body: bytes) -> Packet:
    return Packet(82, 1, body, Verdict.RIGHT)


def unchecked(body: bytes) -> Packet:
    return Packet(82, 1, body, Verdict.UNCHECKED)


def noise(data: bytes) -> LineFault:
    return LineFault(Fault.NOISE, data)


def cut_short(data: bytes) -> LineFault:
    return LineFault(Fault.CUT_SHORT, data)


def bad_crc(data: bytes) -> LineFault:
    return LineFault(Fault.BAD_CRC, data)


def frame(body: bytes, tail: bytes) -> bytes:
    """From mother to node 82; the tail is all that comes after the body."""
    return b"\x02\x52\x01" + body + tail


ACCEPTED = Answer(1, 82, accepted=True)
REFUSED = Answer(1, 82, accepted=False)
BODY_249 = b"x" * 249
# A body of the right length whose CRC is 02.
LONG_CRC_02 = next(
    body for body in (b"x" * 248 + bytes((last,)) for last in range(4, 256)) if crc8(body) == STX
)

# name: bytes, what is heard, what stays pending
CASES: dict[str, tuple[bytes, list[Heard], bytes]] = {
    "a packet": (encode(82, 1, b"m1234"), [right(b"m1234")], b""),
    "a packet without CRC": (encode(82, 1, b"m1234", crc=False), [unchecked(b"m1234")], b""),
    "an empty body": (encode(82, 1, b""), [right(b"")], b""),
    "a soft op": (encode(0, 82, b"\x11"), [Packet(0, 82, b"\x11", Verdict.RIGHT)], b""),
    "CRC 02": (encode(82, 1, b"m132"), [right(b"m132")], b""),
    "CRC 03": (encode(82, 1, b"m349"), [right(b"m349")], b""),
    "CRC 00": (encode(82, 1, b"m13"), [right(b"m13")], b""),
    "CRC 06": (encode(82, 1, b"m177"), [right(b"m177")], b""),
    "CRC 15": (encode(82, 1, b"m464"), [right(b"m464")], b""),
    "CRC 00 without the NUL behind it": (
        frame(b"m13", b"\3\0") + M7,
        [right(b"m13"), HEARD_M7],
        b"",
    ),
    "CRC 00 without its NUL, and a NUL that is not its own": (
        frame(b"m13", b"\3\0") + M7 + b"\0" + M7,
        [right(b"m13"), HEARD_M7, noise(b"\0"), HEARD_M7],
        b"",
    ),
    "ACK, a packet, and an ending that is not the ACK's": (
        ack(1, 82) + M7 + b"\3\0" + M7,
        [ACCEPTED, HEARD_M7, noise(b"\3\0"), HEARD_M7],
        b"",
    ),
    "CRC 00 and two NULs behind it": (
        frame(b"m13", b"\3\0\0\0") + M7,
        [right(b"m13"), noise(b"\0"), HEARD_M7],
        b"",
    ),
    "no CRC and two NULs": (
        frame(b"m12", b"\3\0\0") + M7,
        [unchecked(b"m12"), noise(b"\0"), HEARD_M7],
        b"",
    ),
    "wrong CRC": (frame(b"m1235", b"\3\x0c\0"), [bad_crc(frame(b"m1235", b"\3\x0c\0"))], b""),
    "wrong CRC of value 00": (
        frame(b"m1234", b"\3\0\0") + M7,
        [unchecked(b"m1234"), noise(b"\0"), HEARD_M7],
        b"",
    ),
    "wrong CRC of value 02": (
        frame(b"m1234", b"\3\2\0") + M7,
        [cut_short(frame(b"m1234", b"\3")), cut_short(b"\2\0"), HEARD_M7],
        b"",
    ),
    "wrong CRC of value 03": (
        frame(b"m1234", b"\3\3\0"),
        [bad_crc(frame(b"m1234", b"\3\3\0"))],
        b"",
    ),
    "wrong CRC and no NUL": (
        frame(b"m1235", b"\3\x0c") + M7,
        [bad_crc(frame(b"m1235", b"\3\x0c")), HEARD_M7],
        b"",
    ),
    "missing NUL": (
        frame(b"m1234", b"\3\x0c") + M7,
        [LineFault(Fault.NO_NUL, frame(b"m1234", b"\3\x0c")), HEARD_M7],
        b"",
    ),
    "FF for NUL": (
        frame(b"m1234", b"\3\x0c\xff") + M7,
        [LineFault(Fault.NO_NUL, frame(b"m1234", b"\3\x0c")), noise(b"\xff"), HEARD_M7],
        b"",
    ),
    "missing NUL, so far": (frame(b"m1234", b"\3\x0c"), [], frame(b"m1234", b"\3\x0c")),
    "missing NUL behind CRC 02": (
        frame(b"m132", b"\3\2") + M7,
        [cut_short(frame(b"m132", b"\3")), cut_short(b"\2"), HEARD_M7],
        b"",
    ),
    "cut at ETX where CRC 02 could follow": (
        frame(b"m132", b"\3") + M7,
        [cut_short(frame(b"m132", b"\3")), HEARD_M7],
        b"",
    ),
    "missing NUL behind CRC 03": (
        frame(b"m349", b"\3\3") + M7,
        [LineFault(Fault.NO_NUL, frame(b"m349", b"\3\3")), HEARD_M7],
        b"",
    ),
    "STX in the body": (
        frame(b"ab\2cd", b"\3\x0f\0") + M7,
        [cut_short(frame(b"ab", b"")), bad_crc(b"\2cd\3\x0f\0"), HEARD_M7],
        b"",
    ),
    "ETX in the body": (
        frame(b"ab\3cd", b"\3\xa4\0") + M7,
        [bad_crc(frame(b"ab\3c", b"")), noise(b"d\3\xa4\0"), HEARD_M7],
        b"",
    ),
    "ETX twice": (
        frame(b"ab", b"\3\3\x47\0") + M7,
        [bad_crc(frame(b"ab", b"\3\3")), noise(b"\x47\0"), HEARD_M7],
        b"",
    ),
    "NUL in the body": (encode(82, 1, b"ab\0cd"), [right(b"ab\0cd")], b""),
    "ACK in the body": (encode(82, 1, b"ab\x06cd"), [right(b"ab\x06cd")], b""),
    "any byte of a terminal": (encode(82, 1, b"\r\n\x1b\xff"), [right(b"\r\n\x1b\xff")], b""),
    "cut short at every place": (
        b"\2\2\x52\2\x52\1\2\x52\1m" + M7,
        [
            cut_short(b"\2"),
            cut_short(b"\2\x52"),
            cut_short(b"\2\x52\1"),
            cut_short(b"\2\x52\1m"),
            HEARD_M7,
        ],
        b"",
    ),
    "an ACK by its mark in the source place is none": (
        b"\2\x52\x06" + M7[3:],
        [Packet(82, 6, b"m7", Verdict.RIGHT)],
        b"",
    ),
    "an STX in the source place before a mark": (
        b"\2\x52\2\x06\x05S\3\0",
        [cut_short(b"\2\x52"), Packet(6, 5, b"S", Verdict.UNCHECKED)],
        b"",
    ),
    "address 3": (encode(3, 3, b"S"), [Packet(3, 3, b"S", Verdict.RIGHT)], b""),
    "ACK": (ack(1, 82), [ACCEPTED], b""),
    "NAK": (nak(1, 82), [REFUSED], b""),
    "ACK, then a packet": (ack(1, 82) + M7, [ACCEPTED, HEARD_M7], b""),
    "NAK, then an ACK": (nak(1, 82) + ack(1, 82), [REFUSED, ACCEPTED], b""),
    "ACK as a packet": (encode(1, 82, b"\x06") + M7, [ACCEPTED, HEARD_M7], b""),
    "NAK as a packet": (encode(1, 82, b"\x15") + M7, [REFUSED, HEARD_M7], b""),
    "ACK as a packet without CRC": (encode(1, 82, b"\x06", crc=False) + b"\0", [ACCEPTED], b"\0"),
    "ACK as a packet, so far": (encode(1, 82, b"\x06")[:-1], [ACCEPTED], b"\3\xdd"),
    "ACK as a packet, NUL missing": (
        encode(1, 82, b"\x06")[:-1] + M7,
        [ACCEPTED, noise(b"\3\xdd"), HEARD_M7],
        b"",
    ),
    "ACK as a packet, wrong CRC": (
        ack(1, 82) + b"\3\x55\0" + M7,
        [ACCEPTED, noise(b"\3\x55\0"), HEARD_M7],
        b"",
    ),
    "ACK and text behind it": (
        ack(1, 82) + b"hello" + M7,
        [ACCEPTED, noise(b"hello"), HEARD_M7],
        b"",
    ),
    "back to back": (
        M7 + M7 + encode(82, 1, b"S", crc=False) + M7,
        [HEARD_M7, HEARD_M7, unchecked(b"S"), HEARD_M7],
        b"",
    ),
    "noise before": (
        b"\x41\x80\xff\x00\x06\x15\x03" + M7,
        [noise(b"\x41\x80\xff\x00\x06\x15\x03"), HEARD_M7],
        b"",
    ),
    "noise between": (
        M7 + b"\xff\xff" + M7 + b"\0",
        [HEARD_M7, noise(b"\xff\xff"), HEARD_M7],
        b"\0",
    ),
    "noise in bounded pieces": (
        b"\xff" * 600,
        [noise(b"\xff" * 255), noise(b"\xff" * 255)],
        b"\xff" * 90,
    ),
    "the longest frame": (encode(82, 1, BODY_249), [right(BODY_249)], b""),
    "a body of 250 without CRC": (frame(b"x" * 250, b"\3\0"), [unchecked(b"x" * 250)], b""),
    "a body of 250 with CRC": (
        encode(82, 1, b"x" * 250),
        [LineFault(Fault.TOO_LONG, encode(82, 1, b"x" * 250)[:255])],
        b"\0",
    ),
    "a body of 251": (
        frame(b"x" * 251, b"\3\0") + M7,
        [LineFault(Fault.TOO_LONG, frame(b"x" * 251, b"\3")), noise(b"\0"), HEARD_M7],
        b"",
    ),
    "no end at all": (
        frame(b"x" * 300, b"") + M7,
        [LineFault(Fault.TOO_LONG, frame(b"x" * 252, b"")), noise(b"x" * 48), HEARD_M7],
        b"",
    ),
    "the longest frame with CRC 02": (encode(82, 1, LONG_CRC_02), [right(LONG_CRC_02)], b""),
    "nothing": (b"", [], b""),
}


every_case = pytest.mark.parametrize(("data", "events", "pending"), CASES.values(), ids=CASES)


@every_case
def test_a_stream_is_heard_as_the_table_says(
    data: bytes, events: list[Heard], pending: bytes
) -> None:
    receiver = PacketReceiver()
    assert receiver.receive(data) == events
    assert receiver.pending == pending


@every_case
def test_a_stream_split_anywhere_is_heard_the_same(
    data: bytes, events: list[Heard], pending: bytes
) -> None:
    for at in range(len(data) + 1):
        receiver = PacketReceiver()
        assert receiver.receive(data[:at]) + receiver.receive(data[at:]) == events
        assert receiver.pending == pending


def test_a_full_frame_that_would_still_need_a_nul_behind_crc_02_is_cut_short() -> None:
    # One byte longer than the frame may be: no room for the NUL, so the 02 must be an STX.
    body = next(
        body
        for body in (b"x" * 249 + bytes((last,)) for last in range(4, 256))
        if crc8(body) == STX
    )
    receiver = PacketReceiver()
    assert receiver.receive(frame(body, b"\3\2")) == [cut_short(frame(body, b"\3"))]
    assert receiver.pending == b"\2"


def test_an_answer_is_reported_with_its_fourth_byte() -> None:
    receiver = PacketReceiver()
    assert receiver.receive(b"\x02\x01\x52") == []
    assert receiver.receive(b"\x06") == [ACCEPTED]
    assert receiver.pending == b""


@pytest.mark.parametrize(
    ("data", "unfinished"),
    [
        (b"", False),
        (b"hello", False),
        (b"\x02", True),
        (b"hello" + encode(82, 1, b"m7")[:-1], True),
        (encode(82, 1, b"m7"), False),
        # What may be an answer's ending is noise or nothing.
        (ack(1, 82) + b"\x03", False),
    ],
)
def test_only_a_frame_that_has_begun_is_unfinished(data: bytes, unfinished: bool) -> None:
    receiver = PacketReceiver()
    receiver.receive(data)
    assert receiver.unfinished is unfinished
