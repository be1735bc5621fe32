"""Those who listen to the two lanes of a Super Stepper Bus."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sacbus.wire.superstepper import Answer, Read, Stop, encode, encode_answer
from sacbus.wire.superstepper_receivers import (
    Acknowledged,
    AnswerReceiver,
    MessageReceiver,
    Noise,
    Told,
)
from tests.wire.test_superstepper import MESSAGES

STOP, READ = encode(3, Stop()), encode(4, Read(6))
STOPPED, WHAT_IS_READ = Told(3, Stop(), STOP), Told(4, Read(6), READ)


def test_without_ninth_bits_a_message_follows_the_one_before_it() -> None:
    receiver = MessageReceiver()
    assert receiver.locate(STOP + READ[:1]) == [(STOPPED, 0, 2)]
    assert (receiver.pending, receiver.unfinished) == (READ[:1], True)
    assert receiver.locate(READ[1:] + STOP) == [(WHAT_IS_READ, -1, 2), (STOPPED, 2, 4)]
    assert (receiver.pending, receiver.unfinished) == (b"", False)


def test_with_ninth_bits_a_header_begins_anew() -> None:
    receiver = MessageReceiver()
    data = READ[:2] + STOP + b"\x55\x66" + READ + b"\x77"
    ninth = bytes((1, 0, 1, 0, 0, 0, 1, 0, 0, 0))
    assert receiver.locate(data, ninth) == [
        (Noise(READ[:2], cut=True), 0, 2),
        (STOPPED, 2, 4),
        (Noise(b"\x55\x66"), 4, 6),
        (WHAT_IS_READ, 6, 9),
        (Noise(b"\x77"), 9, 10),
    ]
    assert receiver.receive(STOP, b"\x01\x00") == [STOPPED]


@given(st.lists(st.tuples(st.integers(0, 31), MESSAGES), max_size=8), st.data())
def test_messages_are_read_however_they_are_split(
    said: list[tuple[int, object]], data: st.DataObject
) -> None:
    whole = [encode(address, message) for address, message in said]  # type: ignore[arg-type]  # of MESSAGES
    stream = b"".join(whole)
    cut = data.draw(st.integers(0, len(stream)))
    receiver = MessageReceiver()
    found = receiver.receive(stream[:cut]) + receiver.receive(stream[cut:])
    assert [one.data for one in found if isinstance(one, Told)] == whole
    assert receiver.pending == b""


ANSWER = encode_answer(Answer(3, value=0x1234))


def test_answers_are_found_among_noise() -> None:
    receiver = AnswerReceiver()
    told = Acknowledged(Answer(3, value=0x1234))
    assert receiver.locate(b"\x55" + ANSWER + ANSWER[:2]) == [
        (Noise(b"\x55"), 0, 1),
        (told, 1, 6),
    ]
    assert (receiver.pending, receiver.unfinished) == (ANSWER[:2], True)
    assert receiver.locate(ANSWER[2:] + b"\x01\x02\x03\x04\x05\x06") == [
        (told, -2, 3),
        (Noise(b"\x01\x02"), 3, 5),
    ]
    assert receiver.pending == b"\x03\x04\x05\x06"
    assert receiver.receive(b"\x07" * 2) == [Noise(b"\x03\x04")]


def test_an_answer_has_nothing_in_its_reserved_byte() -> None:
    wrong = bytes((ANSWER[0], 1, *ANSWER[2:4], (ANSWER[4] + 1) & 0xFF))
    assert AnswerReceiver().receive(wrong) == [Noise(wrong[:1])]


@given(st.lists(st.binary(max_size=12), max_size=6))
def test_every_byte_is_in_one_event_or_pending(chunks: list[bytes]) -> None:
    for receiver in (MessageReceiver(), AnswerReceiver()):
        at, heard = 0, 0
        for chunk in chunks:
            for _, first, last in receiver.locate(chunk):
                assert first + heard == at
                assert last > first
                at = last + heard
            heard += len(chunk)
        assert len(receiver.pending) == heard - at
        assert receiver.unfinished == bool(receiver.pending)
