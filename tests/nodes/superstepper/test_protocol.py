"""The Super Stepper Bus as the bus, the monitor and the recordings see it."""

from __future__ import annotations

import pytest

from nodes.superstepper.protocol import EIGHT_BITS, NINE_BITS
from sacbus.feed import Sent
from sacbus.kernel import MS, LineRate
from sacbus.node import EVERYONE, MASTER, Said
from sacbus.watch import Spoken, Unanswered, Watch
from sacbus.wire.superstepper import Answer, Read, Stop, encode, encode_answer
from sacbus.wire.superstepper_receivers import Acknowledged, AnswerReceiver, MessageReceiver, Noise


def test_the_two_modes_differ_in_the_bits_of_a_byte() -> None:
    assert (EIGHT_BITS.name, NINE_BITS.name) == ("superstepper", "superstepper-9")
    assert (EIGHT_BITS.rate, NINE_BITS.rate) == (LineRate(9_600, 10), LineRate(9_600, 11))
    assert EIGHT_BITS.lanes == 2
    assert EIGHT_BITS.addresses == range(32)


def test_every_module_hears_every_byte_as_it_ends() -> None:
    assert list(EIGHT_BITS.cuts(b"abc")) == [1, 2]
    assert EIGHT_BITS.addressed(b"abc") is EVERYONE
    assert EIGHT_BITS.patience(1_041_666) == 10_416_660
    assert EIGHT_BITS.patience(86_805) == 5 * MS


def test_each_lane_has_a_decoder_of_its_own() -> None:
    assert type(EIGHT_BITS.decoder()) is type(EIGHT_BITS.decoder(0)) is MessageReceiver
    assert type(EIGHT_BITS.decoder(1)) is AnswerReceiver
    assert EIGHT_BITS.dissector.is_file()


@pytest.mark.parametrize(
    ("data", "lane", "said"),
    [
        (
            encode(3, Read(6)),
            0,
            Said(
                "packet",
                MASTER,
                3,
                b"\x00\x06",
                "read the byte at RAM 0x06",
                "",
                3,
                100_000,
                binary=True,
            ),
        ),
        (
            encode_answer(Answer(3, value=7, framing=True, overrun=True)),
            1,
            Said("ack", 3, MASTER, b"", "ACK 7 (framing error, overrun)", "right", 5),
        ),
        (
            encode_answer(Answer(3, positive=False)),
            1,
            Said("nak", 3, MASTER, b"", "NAK", "right", 5),
        ),
    ],
)
def test_events_are_told_in_the_words_of_all_protocols(data: bytes, lane: int, said: Said) -> None:
    (event,) = EIGHT_BITS.decoder(lane).receive(data)
    assert EIGHT_BITS.tell(event) == said


def test_noise_is_told_and_nothing_else_is_an_event() -> None:
    assert EIGHT_BITS.tell(Noise(b"ab")).words == "noise"
    assert EIGHT_BITS.tell(Noise(b"ab", cut=True)).words == "cut short"
    assert EIGHT_BITS.tell(Acknowledged(Answer(3))).kind == "ack"
    with pytest.raises(TypeError, match="Super Stepper"):
        EIGHT_BITS.tell("ack")


def test_a_message_without_an_answer_is_noticed_and_a_cut_one_given_up() -> None:
    watch = Watch(EIGHT_BITS, EIGHT_BITS.rate, lanes=2)
    span = EIGHT_BITS.rate.span
    assert isinstance(watch.sent(Sent(0, span(2), 0, "master", None, encode(3, Stop())))[0], Spoken)
    (late,) = watch.wake(100 * MS)
    assert isinstance(late, Unanswered)
    at = 200 * MS
    assert watch.sent(Sent(at, at + span(2), 0, "master", None, encode(3, Read(6))[:2])) == []
    # 10 byte times later a message begins anew.
    at += span(2) + EIGHT_BITS.patience(span(1))
    given_up, whole = watch.sent(Sent(at, at + span(2), 0, "master", None, encode(3, Stop())))
    assert isinstance(given_up, Spoken)
    assert isinstance(whole, Spoken)
    assert (given_up.said.kind, whole.said.words) == ("garbage", "decelerate and stop")
    at += span(2) + MS
    (answered,) = watch.sent(Sent(at, at + span(5), 1, "node 3", 3, encode_answer(Answer(3))))
    assert isinstance(answered, Spoken)
    assert answered.request is whole
    assert answered.delay == MS
    # There is no check in a message, so none is wrong.
    assert (watch.summary.packets, watch.summary.wrong) == (2, 0)


def test_a_link_hears_the_modules_alone() -> None:
    watch = Watch(EIGHT_BITS, EIGHT_BITS.rate, first=EIGHT_BITS.lanes - 1)
    (entry,) = watch.read(encode_answer(Answer(3)), 10 * MS)
    assert isinstance(entry, Spoken)
    assert entry.said.kind == "ack"
