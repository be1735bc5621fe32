"""The robust receiver's laws: against a machine that reads byte by byte, and on their own."""

from itertools import pairwise

from hypothesis import example, given
from hypothesis import strategies as st

from sacbus.wire import (
    ACK,
    ETX,
    MAX_FRAME,
    NAK,
    NUL,
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
# The longest body that fits a frame with its CRC, and whose CRC is 02.
LONG_CRC_02 = next(
    body for body in (b"x" * 248 + bytes((last,)) for last in range(4, 256)) if crc8(body) == STX
)


def heard(data: bytes) -> list[Heard]:
    return PacketReceiver().receive(data)


# ---- the machine that reads byte by byte --------------------------------------------------------


class ByteMachine:
    """The rules of the robust receiver, one byte at a time."""

    def __init__(self) -> None:
        self.noise = b""
        self.frame = b""
        self.etx = 0  # where the ETX stands in the frame, 0 before there is one
        self.endings: list[bytes] = []
        self.ending = b""

    @property
    def pending(self) -> bytes:
        return self.noise + self.frame + self.ending

    def feed_all(self, data: bytes) -> list[Heard]:
        return [event for byte in data for event in self.feed(byte)]

    def feed(self, byte: int) -> list[Heard]:
        if self.endings:
            return self.after_an_event(byte)
        if self.frame:
            return self.in_a_frame(byte)
        if byte == STX:
            events = [LineFault(Fault.NOISE, self.noise)] if self.noise else []
            self.noise, self.frame, self.etx = b"", b"\2", 0
            return [*events]
        self.noise += bytes((byte,))
        if len(self.noise) == MAX_FRAME:
            full, self.noise = self.noise, b""
            return [LineFault(Fault.NOISE, full)]
        return []

    def after_an_event(self, byte: int) -> list[Heard]:
        self.ending += bytes((byte,))
        if not any(ending.startswith(self.ending) for ending in self.endings):
            stray, self.ending, self.endings = self.ending, b"", []
            return self.feed_all(stray)
        if self.ending in self.endings:
            self.ending, self.endings = b"", []
        return []

    def in_a_frame(self, byte: int) -> list[Heard]:
        place = len(self.frame)
        if self.etx and place == self.etx + 1:
            return self.in_the_crc_place(byte)
        if self.etx:
            return self.in_the_nul_place(byte)
        if byte == STX:
            return [self.restart()]
        if place == 3 and byte in (ACK, NAK):
            answer = Answer(self.frame[1], self.frame[2], byte == ACK)
            self.frame = b""
            self.endings = [b"\3\0", bytes((ETX, crc8(bytes((byte,))), NUL))]
            return [answer]
        if place >= 3 and byte == ETX:
            self.etx = place
        return self.append(byte)

    def in_the_crc_place(self, byte: int) -> list[Heard]:
        right_crc = crc8(self.frame[3 : self.etx])
        if byte == NUL:
            if right_crc == NUL:
                packet = self.packet(Verdict.RIGHT)
                self.endings = [b"\0"]
                return [packet]
            return [self.packet(Verdict.UNCHECKED)]
        room_for_nul = len(self.frame) + 2 <= MAX_FRAME
        if byte == STX and not (right_crc == STX and room_for_nul):
            return [self.restart()]
        return self.append(byte)

    def in_the_nul_place(self, byte: int) -> list[Heard]:
        check = self.frame[-1]
        is_right = check == crc8(self.frame[3 : self.etx])
        if is_right and byte == NUL:
            return [self.packet(Verdict.RIGHT)]
        if check == STX:
            self.frame = self.frame[:-1]
            return [self.restart(), *self.feed(byte)]
        fault = LineFault(Fault.NO_NUL if is_right else Fault.BAD_CRC, self.frame)
        self.frame = b""
        if byte == NUL:
            fault.data += b"\0"
            return [fault]
        return [fault, *self.feed(byte)]

    def append(self, byte: int) -> list[Heard]:
        self.frame += bytes((byte,))
        if len(self.frame) < MAX_FRAME:
            return []
        fault = LineFault(Fault.TOO_LONG, self.frame)
        self.frame = b""
        return [fault]

    def restart(self) -> LineFault:
        fault = LineFault(Fault.CUT_SHORT, self.frame)
        self.frame, self.etx = b"\2", 0
        return fault

    def packet(self, verdict: Verdict) -> Packet:
        frame, self.frame = self.frame, b""
        return Packet(frame[1], frame[2], frame[3 : self.etx], verdict)


addresses = st.sampled_from([0, 1, 2, 3, 6, 0x15, 82]) | st.integers(0, 255)
trap_bytes = st.sampled_from([0, 2, 3, 6, 0x15, 0xDD, 0xA2, ord("m")])
bodies = st.one_of(
    st.sampled_from([b"", b"m13", b"m132", b"m349", b"+", b"\x06", b"\x15", LONG_CRC_02]),
    st.binary(max_size=40),
    st.lists(trap_bytes, max_size=8).map(bytes),
    st.integers(244, 256).map(lambda n: b"x" * n),
)
frames = st.builds(encode, addresses, addresses, bodies)
pieces = st.one_of(
    frames,
    st.builds(lambda d, s, b: encode(d, s, b, crc=False), addresses, addresses, bodies),
    st.builds(ack, addresses, addresses),
    st.builds(nak, addresses, addresses),
    st.builds(lambda f, n: f[: -1 - n], frames, st.integers(0, 5)),
    st.lists(trap_bytes, max_size=12).map(bytes),
    st.binary(max_size=12),
    st.integers(250, 260).map(lambda n: b"\xff" * n),
)
streams = st.lists(pieces, max_size=8).map(b"".join)


@st.composite
def streams_in_pieces(draw: st.DrawFn) -> list[bytes]:
    data = draw(streams)
    cuts = sorted(draw(st.lists(st.integers(0, len(data)), max_size=8)))
    return [data[a:b] for a, b in pairwise([0, *cuts, len(data)])]


@given(streams_in_pieces())
def test_the_receiver_agrees_with_the_machine_on_any_bytes_in_any_pieces(
    chunks: list[bytes],
) -> None:
    machine = ByteMachine()
    receiver = PacketReceiver()
    for chunk in chunks:
        assert receiver.receive(chunk) == machine.feed_all(chunk)
        assert receiver.pending == machine.pending
        assert len(receiver.pending) < MAX_FRAME


@given(streams)
def test_byte_by_byte_is_heard_as_the_whole(data: bytes) -> None:
    receiver = PacketReceiver()
    one_by_one = [event for byte in data for event in receiver.receive(bytes((byte,)))]
    assert one_by_one == heard(data)


# ---- no byte is lost or told twice --------------------------------------------------------------


def forms(event: Heard) -> list[bytes]:
    """The bytes that an event may stand for, the longest form first."""
    match event:
        case LineFault():
            return [event.data]
        case Answer():
            mark = bytes((ACK if event.accepted else NAK,))
            long = [encode(event.dest, event.src, mark, crc=crc) for crc in (True, False)]
            return [*long, bytes((STX, event.dest, event.src)) + mark]
        case Packet(verdict=Verdict.UNCHECKED):
            assert crc8(event.body) != 0
            return [encode(event.dest, event.src, event.body, crc=False)]
        case Packet():
            assert event.verdict is Verdict.RIGHT
            with_crc = encode(event.dest, event.src, event.body)
            # With the CRC 00 its NUL may be missing.
            return [with_crc, with_crc[:-1]] if crc8(event.body) == 0 else [with_crc]


@given(streams)
@example(b"\xff" * 1000)
@example(b"\x02" * 300)
@example(encode(1, 82, b"\x06")[:-1])
def test_every_byte_is_in_one_event_or_pending(data: bytes) -> None:
    receiver = PacketReceiver()
    rest = data
    for event in receiver.receive(data):
        form = next((form for form in forms(event) if rest.startswith(form)), None)
        assert form is not None, f"{event} does not stand at {rest!r}"
        assert len(form) <= MAX_FRAME + 1  # a body of 250 with the CRC 00 ends at the first NUL
        rest = rest[len(form) :]
    assert rest == receiver.pending


# ---- where events stand -------------------------------------------------------------------------


@given(streams_in_pieces())
@example([b"\x02\x52\x01m13\x03\x00", b"\x00" + M7])
@example([encode(1, 82, b"\x06")[:-1], b"\x00", M7])
def test_located_events_are_those_received(chunks: list[bytes]) -> None:
    receiver, other = PacketReceiver(), PacketReceiver()
    for chunk in chunks:
        located = other.locate(chunk)
        assert [event for event, _, _ in located] == receiver.receive(chunk)
        assert other.pending == receiver.pending


@given(streams)
@example(encode(1, 82, b"\x06") + M7)
@example(encode(82, 1, b"m13") + M7)
def test_an_event_stands_at_its_own_bytes_and_all_others_are_pending(data: bytes) -> None:
    receiver = PacketReceiver()
    at = 0
    for event, begin, end in receiver.locate(data):
        assert begin == at
        assert data[begin:end] in forms(event)
        at = end
    assert data[at:] == receiver.pending


@given(streams, st.integers(0, 300))
def test_places_count_from_the_first_byte_given_over_all_splits(data: bytes, cut: int) -> None:
    cut = min(cut, len(data))
    receiver = PacketReceiver()
    before = receiver.locate(data[:cut])
    behind = [(event, cut + a, cut + b) for event, a, b in receiver.locate(data[cut:])]
    whole = PacketReceiver().locate(data)
    assert [(event, a) for event, a, _ in before + behind] == [(event, a) for event, a, _ in whole]
    # An ending that the cut has parted from its event is all that may differ.
    assert all(b <= c for (_, _, b), (_, _, c) in zip(before + behind, whole, strict=True))


# ---- what is sent is heard ----------------------------------------------------------------------

good_addresses = st.integers(0, 255).filter(lambda address: address not in (STX, ETX))
good_bodies = st.binary(max_size=46).map(
    lambda body: body.replace(b"\2", b"").replace(b"\3", b"").lstrip(b"\x06\x15")
)


@given(st.lists(st.tuples(good_addresses, good_addresses, good_bodies, st.booleans()), max_size=5))
def test_packets_sent_back_to_back_are_heard(
    sent: list[tuple[int, int, bytes, bool]],
) -> None:
    data = b"".join(encode(dest, src, body, crc=crc) for dest, src, body, crc in sent)
    assert heard(data) == [
        # A body with the CRC 00 looks the same with and without it.
        Packet(d, s, body, Verdict.RIGHT if crc or crc8(body) == 0 else Verdict.UNCHECKED)
        for d, s, body, crc in sent
    ]


@given(good_addresses, good_addresses, st.booleans())
def test_answers_are_heard_between_packets(dest: int, src: int, accepted: bool) -> None:
    answer = ack(dest, src) if accepted else nak(dest, src)
    assert heard(M7 + answer + M7) == [HEARD_M7, Answer(dest, src, accepted), HEARD_M7]
    assert heard(answer) == [Answer(dest, src, accepted)]


@given(streams)
def test_a_packet_to_a_node_is_heard_behind_any_stream(data: bytes) -> None:
    assert heard(data + M7)[-1] == HEARD_M7


@given(streams)
@example(encode(82, 1, b"m132")[:-2])
def test_of_two_general_calls_the_second_is_heard_behind_any_stream(data: bytes) -> None:
    # The first may not be: behind a body with the CRC 02, cut at its ETX, its STX and its
    # destination pass for "CRC NUL".
    assert heard(data + encode(0, 1, b"S") * 2)[-1] == Packet(0, 1, b"S", Verdict.RIGHT)
