"""Messages and answers of the Super Stepper Bus, as bytes and as values."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.wire.superstepper import (
    SIZES,
    Answer,
    ChangeSpeed,
    Decay,
    Expanded,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Opcode,
    Rate,
    Read,
    Status,
    Stop,
    Write,
    address_of,
    decode,
    decode_answer,
    decode_status,
    describe,
    encode,
    encode_answer,
    opcode_of,
    patience,
)

_WORDS = st.integers(0, 0xFFFF)
_BYTES = st.integers(0, 0xFF)
MESSAGES = (
    st.builds(MoveAtSpeed, st.booleans(), _WORDS, st.sampled_from(Rate), st.booleans())
    | st.builds(MoveSteps, st.booleans(), _WORDS, _WORDS, st.sampled_from(Rate), st.booleans())
    | st.builds(ChangeSpeed, _WORDS)
    | st.builds(Microsteps, st.integers(0, 3), st.sampled_from(Decay))
    | st.builds(Stop, st.booleans(), st.booleans())
    | st.just(Expanded())
    | st.builds(Write, _BYTES, _BYTES, st.booleans())
    | st.builds(Read, _BYTES, st.booleans(), st.booleans())
)


@pytest.mark.parametrize(
    ("address", "message", "data", "words"),
    [
        (3, MoveAtSpeed(True, 4_000), "18 0c 0f a0", "move clockwise at speed 4000"),
        (
            3,
            MoveAtSpeed(False, 0, Rate.SLOW, accelerate=False),
            "18 02 00 00",
            "move counterclockwise at speed 65536 / 64, at once",
        ),
        (
            31,
            MoveSteps(True, 10_000, 400, Rate.MEDIUM, home=True),
            "f9 0d 27 10 01 90",
            "move 400 steps clockwise at speed 10000 / 8, or until home falls",
        ),
        (
            31,
            MoveSteps(False, 100, 1, Rate.NONE),
            "f9 03 00 64 00 01",
            "move 1 step counterclockwise at no rate",
        ),
        (0, ChangeSpeed(0x1234), "02 12 34", "change the speed to 4660"),
        (1, Microsteps(3, Decay.SLOW), "0b 0f", "eight steps, slow decay"),
        (1, Microsteps(1, Decay.MIXED_TOO), "0b 09", "half steps, mixed decay"),
        (1, Stop(), "0c 03", "decelerate and stop"),
        (1, Stop(decelerate=False, enabled=False), "0c 00", "stop at once, driver off"),
        (1, Expanded(), "0d", "reserved"),
        (1, Write(0x10, 0x5A), "0e 00 10 5a", "write 0x5a to RAM 0x10"),
        (1, Write(4, 9, eeprom=True), "0e 01 04 09", "write 0x09 to EEPROM 0x04"),
        (1, Read(6), "0f 00 06", "read the byte at RAM 0x06"),
        (1, Read(7, word=True), "0f 02 07", "read the word at RAM 0x07"),
        (1, Read(0, eeprom=True, word=True), "0f 03 00", "read the byte at EEPROM 0x00"),
    ],
)
def test_messages_stand_as_the_table_of_places_says(
    address: int, message: Message, data: str, words: str
) -> None:
    assert encode(address, message).hex(" ") == data
    assert decode(bytes.fromhex(data)) == (address, message)
    assert describe(message) == words


@given(st.integers(0, 31), MESSAGES)
def test_a_message_is_read_as_it_was_written(address: int, message: Message) -> None:
    data = encode(address, message)
    assert len(data) == SIZES[opcode_of(data[0])]
    assert address_of(data[0]) == address
    assert decode(data) == (address, message)


@given(st.binary(min_size=1, max_size=8))
def test_whatever_has_its_opcodes_size_is_a_message(data: bytes) -> None:
    if len(data) == SIZES[opcode_of(data[0])]:
        address, message = decode(data)
        assert encode(address, message)[0] == data[0]
        assert describe(message)
    else:
        with pytest.raises(ValueError, match="bytes of a message"):
            decode(data)


def test_nothing_is_no_message() -> None:
    with pytest.raises(ValueError, match="expected 1 bytes of a message, got ''"):
        decode(b"")


@pytest.mark.parametrize(
    ("address", "message", "why"),
    [
        (32, Expanded(), "address: expected a whole number from 0 to 31, got 32"),
        (-1, Expanded(), "address"),
        (3, ChangeSpeed(0x10000), "speed: expected a whole number from 0 to 65535, got 65536"),
        (3, ChangeSpeed(-1), "speed: .* got -1"),
        (3, MoveSteps(True, 100, 0x10000), "steps: .* from 0 to 65535, got 65536"),
        (3, Write(0x100, 0), "place: .* from 0 to 255, got 256"),
        (3, Write(0, 0x100), "byte: .* from 0 to 255, got 256"),
        (3, Microsteps(4), "exponent: .* from 0 to 3, got 4"),
    ],
)
def test_what_there_is_no_room_for_is_refused(address: int, message: Message, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        encode(address, message)


@pytest.mark.parametrize(
    ("answer", "data"),
    [
        (Answer(3), "83 00 00 00 83"),
        (Answer(31, value=0x1234), "9f 00 12 34 e5"),
        (Answer(31, value=0xFFFF, framing=True, overrun=True), "ff 00 ff ff fd"),
        (Answer(3, positive=False), "03 00 00 00 03"),
    ],
)
def test_answers_have_a_checksum(answer: Answer, data: str) -> None:
    assert encode_answer(answer).hex(" ") == data
    assert decode_answer(bytes.fromhex(data)) == answer
    for place in range(5):
        wrong = bytearray.fromhex(data)
        wrong[place] ^= 1
        assert decode_answer(bytes(wrong)) is None
    assert decode_answer(bytes.fromhex(data)[:4]) is None


@pytest.mark.parametrize(
    ("answer", "flags"),
    [
        (Answer(3), ()),
        (Answer(3, framing=True), ("framing error",)),
        (Answer(3, overrun=True), ("overrun",)),
        (Answer(3, framing=True, overrun=True), ("framing error", "overrun")),
    ],
)
def test_the_flags_of_an_answer_are_told_in_words(answer: Answer, flags: tuple[str, ...]) -> None:
    assert answer.flags == flags


@pytest.mark.parametrize(("byte_ns", "ns"), [(1_041_667, 10_416_670), (86_806, 5_000_000)])
def test_a_message_has_ten_byte_times_and_at_least_5_ms(byte_ns: int, ns: int) -> None:
    assert patience(byte_ns) == ns


def test_the_status_register_has_three_bits() -> None:
    assert [Status(True).byte, Status(home_complete=True).byte] == [1, 2]
    assert Status(changing_speed=True).byte == 4
    for byte in range(8):
        assert decode_status(byte).byte == byte
    assert decode_status(0xF8) == Status()


def test_rates_have_their_dividers_and_their_least_speeds() -> None:
    assert [(one.divider, one.least) for one in Rate] == [(1, 100), (8, 20), (64, 2), (0, 0)]


def test_microsteps_stand_in_a_byte() -> None:
    for byte in range(16):
        assert Microsteps.of(byte).byte == byte


def test_opcodes_are_the_low_three_bits_of_a_header() -> None:
    assert [opcode_of(3 << 3 | number) for number in range(8)] == list(Opcode)
