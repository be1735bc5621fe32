"""Telnet and RFC 2217 without I/O: what is data, what is set, what is answered."""

from __future__ import annotations

import struct
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.links.link import SerialFormat
from sacbus.links.telnet import LONGEST, Telnet
from tests.links.programs import plain

IAC, SE, SB, WILL, WILL_NOT, DO, DO_NOT = (
    b"\xff",
    b"\xf0",
    b"\xfa",
    b"\xfb",
    b"\xfc",
    b"\xfd",
    b"\xfe",
)
COM_PORT = b"\x2c"


class Talk:
    """A client's side: all that was heard and answered, in order of their coming."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.answers: list[bytes] = []
        self.telnet = Telnet(38_400, self.heard.append, self.answers.append)
        self.offered = b"".join(self.answers)
        self.answers.clear()

    def says(self, *chunks: bytes) -> Talk:
        for chunk in chunks:
            self.telnet.receive(chunk)
        return self

    @property
    def data(self) -> bytes:
        return b"".join(self.heard)

    @property
    def answer(self) -> bytes:
        return b"".join(self.answers)


def sub(what: int, value: bytes = b"") -> bytes:
    """A suboption of RFC 2217 as a client sends it, or as it is answered."""
    return IAC + SB + COM_PORT + bytes((what,)) + value.replace(IAC, IAC + IAC) + IAC + SE


def reference(stream: bytes) -> bytes:
    """The data in a telnet stream, byte by byte."""
    data = bytearray()
    state = "data"
    for byte in stream:
        if state == "suboption's IAC" and byte == 0xFF:
            state = "suboption"
        elif state in ("IAC", "suboption's IAC"):
            if byte == 0xFF:
                data.append(byte)
            state = "option" if 0xFB <= byte <= 0xFE else "suboption" if byte == 0xFA else "data"
        elif state == "option":
            state = "data"
        elif state == "suboption":
            state = "suboption's IAC" if byte == 0xFF else state
        elif byte == 0xFF:
            state = "IAC"
        else:
            data.append(byte)
    return bytes(data)


tricky = st.sampled_from([*b"\xff\xff\xff\xff\xf0\xfa\xfb\xfc\xfd\xfe\x2c", *range(16)])
garbage = st.lists(tricky, max_size=60).map(bytes)
suboptions = st.builds(sub, st.integers(0, 20), st.one_of(st.binary(max_size=8), garbage))
options = st.builds(
    lambda command, option: IAC + command + bytes((option,)),
    st.sampled_from([WILL, WILL_NOT, DO, DO_NOT]),
    st.one_of(st.sampled_from([0, 1, 3, 0x2C]), st.integers(0, 255)),
)
too_long = st.builds(
    lambda size, byte: sub(1, bytes((byte,)) * size), st.integers(200, 700), st.integers(0, 255)
)
streams = st.lists(st.one_of(st.binary(max_size=40), garbage, suboptions, options, too_long)).map(
    b"".join
)


@pytest.mark.slow
@given(streams, st.lists(st.integers(0, 3000)))
def test_no_garbage_raises_or_gets_into_the_data_wherever_it_is_split(
    stream: bytes, cuts: list[int]
) -> None:
    talk = Talk()
    bounds = [0, *sorted(cut for cut in cuts if cut < len(stream)), len(stream)]
    for start, end in pairwise(bounds):
        if start < end:
            talk.says(stream[start:end])
        assert len(talk.telnet._begun) <= 2 * LONGEST + 4
    assert talk.data == reference(stream)
    assert b"" not in talk.heard
    # What goes back is whole sequences, each of them, and no data.
    for answer in talk.answers:
        assert plain(answer) == (b"", b"")
    whole = Talk().says(stream) if stream else Talk()
    assert whole.data == talk.data
    assert whole.answer == talk.answer
    assert vars(whole.telnet.port) == vars(talk.telnet.port)
    port = talk.telnet.port
    assert port.baudrate > 0
    assert 5 <= port.bytesize <= 8
    assert port.parity in "NEOMS"
    assert port.stopbits in (1, 1.5, 2)


@pytest.mark.slow
@given(st.binary(min_size=1), st.lists(st.integers(0, 200)))
def test_data_passes_as_it_is_when_it_is_escaped(data: bytes, cuts: list[int]) -> None:
    stream = Telnet.escaped(data)
    talk = Talk()
    bounds = [0, *sorted(cut for cut in cuts if cut < len(stream)), len(stream)]
    for start, end in pairwise(bounds):
        if start < end:
            talk.says(stream[start:end])
    assert talk.data == data
    assert talk.answers == []


def test_a_client_is_offered_a_serial_port_from_the_start() -> None:
    offered = Talk().offered
    assert IAC + WILL + COM_PORT in offered
    assert IAC + DO + b"\x00" in offered  # binary
    assert plain(offered) == (b"", b"")


def test_an_option_that_nobody_knows_is_declined() -> None:
    assert Talk().says(IAC + WILL + b"\x18").answer == IAC + DO_NOT + b"\x18"
    assert Talk().says(IAC + DO + b"\x05").answer == IAC + WILL_NOT + b"\x05"
    assert Talk().says(IAC + WILL_NOT + b"\x18", IAC + DO_NOT + b"\x05").answer == b""


def test_a_client_that_takes_the_offer_is_told_the_modem_lines() -> None:
    # CTS, DSR and CD are there, and have just come.
    assert Talk().says(IAC + DO + COM_PORT).answer == sub(107, b"\xbb")
    assert Talk().says(sub(7)).answer == sub(107, b"\xbb")


@pytest.mark.parametrize("rate", [300, 9600, 38_400, 115_200, 4_000_000, 0xFFFFFFFF])
def test_the_rate_is_set_and_acknowledged(rate: int) -> None:
    value = struct.pack(">I", rate)
    talk = Talk().says(sub(1, value))
    assert talk.telnet.port.baudrate == rate
    assert talk.answer == sub(101, value)
    assert talk.says(sub(1, bytes(4))).answer == 2 * sub(101, value)


def test_the_format_is_set_and_acknowledged() -> None:
    talk = Talk().says(sub(2, b"\x07"), sub(3, b"\x03"), sub(4, b"\x02"))
    assert talk.telnet.port.format == SerialFormat(7, "E", 2)
    assert str(talk.telnet.port.format) == "7E2"
    assert talk.answer == sub(102, b"\x07") + sub(103, b"\x03") + sub(104, b"\x02")


@pytest.mark.parametrize(("code", "parity"), list(enumerate("NOEMS", 1)))
def test_every_parity_can_be_set(code: int, parity: str) -> None:
    talk = Talk().says(sub(3, bytes((code,))))
    assert talk.telnet.port.parity == parity
    assert talk.answer == sub(103, bytes((code,)))


@pytest.mark.parametrize(
    ("what", "value", "answer"),
    [
        (2, b"\x04", sub(102, b"\x08")),
        (2, b"\x09", sub(102, b"\x08")),
        (2, b"\xff", sub(102, b"\x08")),
        (3, b"\x06", sub(103, b"\x01")),
        (3, b"\xff", sub(103, b"\x01")),
        (4, b"\x04", sub(104, b"\x01")),
        (4, b"\xff", sub(104, b"\x01")),
    ],
)
def test_what_cannot_be_set_is_answered_with_what_is_set(
    what: int, value: bytes, answer: bytes
) -> None:
    talk = Talk().says(sub(what, value))
    assert talk.answer == answer
    assert talk.telnet.port.format == SerialFormat()


@pytest.mark.parametrize("what", [1, 2, 3, 4, 5, 10, 11])
def test_a_suboption_that_is_too_short_is_nothing(what: int) -> None:
    talk = Talk().says(b"a", sub(what), b"b", sub(1, b"\x00\x00"), b"c")
    assert (talk.data, talk.answer) == (b"abc", b"")


@pytest.mark.parametrize(
    "stray",
    [
        IAC + SE,
        IAC + SB + IAC + SE,
        IAC + SB + COM_PORT + IAC + SE,
        IAC + SB + b"\x18\x01" + IAC + SE,
        IAC + b"\xf1",
        IAC + b"\xf6",
        sub(99, b"what?"),
        sub(12, b"\x09"),
        sub(12),
        sub(8),
        sub(9),
    ],
)
def test_what_means_nothing_here_is_neither_answered_nor_heard(stray: bytes) -> None:
    talk = Talk().says(b"a" + stray + b"b")
    assert (talk.data, talk.answer) == (b"ab", b"")


def test_a_suboption_without_an_end_is_not_kept_for_ever_and_its_end_is_found() -> None:
    talk = Talk().says(b"a" + IAC + SB + COM_PORT + b"\x01")
    for _ in range(1000):
        talk.says(bytes(100), IAC, IAC)
        assert len(talk.telnet._begun) <= LONGEST + 200
    talk.says(IAC, SE, b"b", sub(2, b"\x07"))
    assert talk.data == b"ab"
    assert talk.answer == sub(102, b"\x07")


def test_the_end_of_a_suboption_too_long_may_come_in_two_parts() -> None:
    talk = Talk().says(IAC + SB + bytes(LONGEST + 1) + IAC, SE + b"heard")
    assert talk.data == b"heard"


def test_another_command_cuts_a_suboption_off() -> None:
    nine_thousand_six_hundred = b"\x01\x00\x00\x25\x80"
    talk = Talk().says(IAC + SB + COM_PORT + nine_thousand_six_hundred)
    talk.says(IAC + DO + b"\x05" + b"data")
    assert (talk.data, talk.answer) == (b"data", IAC + WILL_NOT + b"\x05")
    assert talk.telnet.port.baudrate == 38_400


def test_what_was_said_before_a_setting_is_heard_before_it() -> None:
    parities: list[tuple[bytes, str]] = []
    telnet = Telnet(
        38_400, lambda data: parities.append((data, telnet.port.parity)), lambda _: None
    )
    mark, space = sub(3, b"\x04"), sub(3, b"\x05")
    telnet.receive(b"none" + mark + b"head\xff\xff" + space + b"tail")
    assert parities == [(b"none", "N"), (b"head\xff", "M"), (b"tail", "S")]


def test_break_rts_and_dtr_are_kept_and_told() -> None:
    talk = Talk()
    assert talk.says(sub(5, b"\x04"), sub(5, b"\x07"), sub(5, b"\x0a")).answer == (
        sub(105, b"\x06") + sub(105, b"\x08") + sub(105, b"\x0b")
    )
    talk.answers.clear()
    assert talk.says(sub(5, b"\x05"), sub(5, b"\x09"), sub(5, b"\x0c")).answer == (
        sub(105, b"\x05") + sub(105, b"\x09") + sub(105, b"\x0c")
    )
    talk.answers.clear()
    assert talk.says(sub(5, b"\x04"), sub(5, b"\x07"), sub(5, b"\x0a")).answer == (
        sub(105, b"\x05") + sub(105, b"\x09") + sub(105, b"\x0c")
    )


@pytest.mark.parametrize(
    ("wish", "answer"),
    [(0, 1), (1, 1), (3, 3), (13, 14), (14, 14), (15, 14), (16, 14), (17, 1), (18, 14), (19, 1)],
)
def test_every_wish_for_flow_control_is_answered(wish: int, answer: int) -> None:
    assert Talk().says(sub(5, bytes((wish,)))).answer == sub(105, bytes((answer,)))


@pytest.mark.parametrize("which", [1, 2, 3])
def test_a_purge_is_acknowledged(which: int) -> None:
    assert Talk().says(sub(12, bytes((which,)))).answer == sub(112, bytes((which,)))


def test_masks_are_acknowledged_and_the_modem_s_is_obeyed() -> None:
    talk = Talk().says(sub(10, b"\x10"), sub(11, b"\xff"))
    assert talk.answer == sub(110, b"\x10") + sub(111, b"\xff")
    talk.answers.clear()
    assert talk.says(sub(11, b"\x10"), sub(7)).answer == sub(111, b"\x10") + sub(107, b"\x10")


def test_the_line_s_state_and_the_signature_are_told() -> None:
    assert Talk().says(sub(6)).answer == sub(106, b"\x00")
    assert Talk().says(sub(0)).answer == sub(0, b"sacbus")
    assert Talk().says(sub(0, b"a client")).answer == b""


def test_a_rate_with_every_byte_escaped_is_understood() -> None:
    talk = Talk().says(IAC + SB + COM_PORT + b"\x01" + b"\x00\x00" + IAC * 4 + IAC + SE)
    assert talk.telnet.port.baudrate == 0xFFFF
    assert talk.answer == sub(101, b"\x00\x00\xff\xff")
