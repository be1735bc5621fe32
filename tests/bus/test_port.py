"""Outside bytes: when they get on the line, and who gets them."""

from __future__ import annotations

from itertools import pairwise

from sacbus.bus import LATENCY, Bus, Port, Transmission
from sacbus.kernel import MS, SECOND, US, Kernel, LineRate, Ns
from sacbus.node import Heard
from tests.nodes.sac.bench import NODE, Bench, packet

ACK = bytes((2, 1, NODE, 6))


class Desk:
    """A port of its own on a bench's line, what it heard, and all that went over the line."""

    def __init__(self, bench: Bench, *, latency: Ns = LATENCY, echo: bool = False) -> None:
        self.heard: list[tuple[Ns, bytes]] = []
        self.port = Port(bench.bus.medium, self._hear, latency=latency, echo=echo)
        self.sent: list[Transmission] = []
        bench.bus.medium.watchers.append(self._watch)

    def _hear(self, heard: Heard, now: Ns) -> None:
        self.heard.append((now, heard.data))

    def _watch(self, sent: Transmission) -> None:
        if sent.sender is self.port:
            self.sent.append(sent)

    @property
    def data(self) -> bytes:
        return b"".join(data for _, data in self.heard)

    @property
    def starts(self) -> list[Ns]:
        return [sent.start for sent in self.sent]


def test_on_an_idle_line_bytes_start_at_once() -> None:
    bench = Bench()
    desk = Desk(bench)
    bench.kernel.run_until(3 * MS)
    desk.port.talk(packet("v100"))
    assert desk.port.unsent == 0
    bench.run()
    assert desk.starts == [3 * MS]
    assert desk.data == ACK


def test_whoever_reuses_a_buffer_once_it_is_said_changes_nothing_on_the_line() -> None:
    bench = Bench()
    desk = Desk(bench)
    said = bytearray(packet("v100"))
    desk.port.talk(said)
    said.clear()
    bench.run()
    assert desk.data == ACK


def test_saying_nothing_is_no_transmission() -> None:
    bench = Bench()
    desk = Desk(bench)
    desk.port.talk(b"")
    bench.run()
    assert bench.bus.medium.counters().transmissions == 0


def test_what_comes_in_while_the_port_sends_follows_without_a_pause() -> None:
    bench = Bench()
    desk = Desk(bench)
    desk.port.talk(b"\x02ABC")
    bench.kernel.run_until(500 * US)
    desk.port.talk(b"DE")
    desk.port.talk(b"F")
    assert desk.port.unsent == 3
    bench.run()
    assert [sent.data for sent in desk.sent] == [b"\x02ABC", b"DEF"]
    assert desk.starts == [0, bench.span(4)]
    assert bench.bus.medium.counters().collided == 0


def test_what_comes_in_as_the_last_byte_ends_follows_without_a_pause_too() -> None:
    bench = Bench()
    desk = Desk(bench)
    desk.port.talk(b"\x02ABC")
    bench.kernel.at(bench.span(4), desk.port.talk, b"D")
    bench.run()
    assert desk.starts == [0, bench.span(4)]


def test_after_an_answer_a_port_starts_no_sooner_than_its_latency() -> None:
    bench = Bench()
    desk = Desk(bench)
    desk.port.talk(packet("v100"))
    # As a quick program would: the next request in the very moment of the answer.
    answered: list[Ns] = []

    def reply(sent: Transmission) -> None:
        if sent.sender is not desk.port and len(answered) < 3:
            answered.append(sent.end)
            desk.port.talk(packet("v100"))

    bench.bus.medium.watchers.append(reply)
    bench.run()
    assert desk.starts[1:] == [end + 1 * MS for end in answered]
    assert desk.data == ACK * 4
    assert bench.bus.medium.counters().collided == 0


def test_with_another_latency_the_pause_is_another() -> None:
    bench = Bench()
    desk = Desk(bench, latency=123 * US)
    bench.sends(b"\x02A", at=0)
    desk.port.talk(b"\x02B")
    bench.run()
    assert desk.starts == [bench.span(2) + 123 * US]


def test_two_programs_that_are_paced_do_not_run_into_each_other() -> None:
    bench = Bench()
    first, second = Desk(bench), Desk(bench)
    first.port.talk(packet("v100"))
    bench.kernel.run_until(100 * US)
    second.port.talk(packet("v200"))
    bench.run()
    # The second one waits through the first one's answer as well.
    assert second.starts[0] >= first.sent[0].end + LATENCY
    assert bench.bus.medium.counters().collided == 0
    assert first.data == ACK + packet("v200") + ACK


def test_a_long_stream_goes_out_without_a_pause_and_takes_its_line_time() -> None:
    bench = Bench(lanes=2)
    desk = Desk(bench)
    data = bytes(range(0x40, 0x60)) * 1_000
    desk.port.talk(data)
    bench.run()
    assert b"".join(sent.data for sent in desk.sent) == data
    assert all(one.end == other.start for one, other in pairwise(desk.sent))
    # Each piece is truncated to the ns.
    assert 0 <= len(data) * 10 * SECOND // 38_400 - bench.kernel.now < len(desk.sent)


def test_a_port_hears_its_own_bytes_only_with_echo() -> None:
    for echo in (False, True):
        bench = Bench()
        desk = Desk(bench, echo=echo)
        assert desk.port.echo is echo
        desk.port.talk(packet("v100"))
        bench.run()
        assert desk.data == (packet("v100") if echo else b"") + ACK


def test_on_two_lanes_nobody_hears_the_programs_bytes() -> None:
    bench = Bench(lanes=2)
    speaker, other = Desk(bench, echo=True), Desk(bench)
    speaker.port.talk(packet("v100"))
    bench.run()
    assert speaker.data == other.data == ACK


def test_a_closed_port_finishes_what_it_sends_and_hears_no_more() -> None:
    bench = Bench()
    desk = Desk(bench)
    desk.port.talk(packet("v100"))
    desk.port.talk(packet("v200"))
    desk.port.close()
    desk.port.close()
    bench.run()
    assert [sent.data for sent in desk.sent] == [packet("v100")]
    assert desk.heard == []
    assert bench.answers == [packet("v100"), ACK]


def test_ports_on_lines_without_nodes_need_nothing_else() -> None:
    kernel = Kernel()
    heard: list[bytes] = []
    bus = Bus(kernel, Bench().bus.protocol)
    one = Port(bus.medium, lambda piece, now: heard.append(piece.data))
    Port(bus.medium, lambda piece, now: heard.append(piece.data))
    one.talk(b"\x02A")
    kernel.run()
    assert heard == [b"\x02A"]


def test_who_leaves_hears_no_more_but_what_it_had_said_is_sent_to_the_end() -> None:
    bench = Bench()
    desk = Desk(bench)
    desk.port.talk(packet("v100"))
    desk.port.talk(packet("v200"))
    desk.port.leave()
    bench.run()
    assert [sent.data for sent in desk.sent] == [packet("v100"), packet("v200")]
    assert desk.heard == []


def test_what_is_dropped_is_never_sent_and_who_was_held_may_go_on() -> None:
    bench = Bench()
    asked: list[bool] = []
    port = Port(bench.bus.medium, lambda _heard, _now: None, hold=asked.append)
    for _ in range(10):
        port.talk(b"U" * 4_000)
    port.drop()
    assert (port.unsent, asked) == (0, [True, False])
    bench.run()
    # What was being sent is sent to its end.
    assert bench.bus.medium.counters().bytes == 4_000
    port.talk(b"U")
    bench.run()
    assert bench.bus.medium.counters().bytes == 4_001


NINE_BITS = LineRate(9_600, bits=11)


class NinthBits:
    """A listener that keeps what it hears with the ninth bits."""

    def __init__(self) -> None:
        self.heard: list[tuple[bytes, bytes | None]] = []

    def hear(self, heard: Heard, now: Ns) -> None:
        self.heard.append((heard.data, heard.ninth))


def test_ninth_bits_arrive_with_their_bytes() -> None:
    bus = Bus(Kernel(), Bench().bus.protocol, rate=NINE_BITS)
    port, ear = Port(bus.medium, lambda _heard, _now: None), NinthBits()
    bus.medium.listen(0, ear, None)
    port.talk(b"\x51", 1)
    port.talk(b"\x01\x02\x04")
    bus.kernel.run()
    assert ear.heard == [(b"\x51", b"\x01"), (b"\x01\x02\x04", b"\x00\x00\x00")]
    assert bus.kernel.now == NINE_BITS.span(1) + NINE_BITS.span(3)
    port.talk(b"\x51", 1)
    port.talk(b"\x52", 1)
    port.close()
    port.talk(b"\x53")
    bus.kernel.run()
    assert ear.heard[2:] == [(b"\x51", b"\x01"), (b"\x53", b"\x00")]


def test_each_byte_may_have_a_ninth_bit_of_its_own() -> None:
    bus = Bus(Kernel(), Bench().bus.protocol, rate=NINE_BITS)
    port, ear = Port(bus.medium, lambda _heard, _now: None), NinthBits()
    bus.medium.listen(0, ear, None)
    port.talk(b"\x51\x01\x02", b"\x01\x00\x01")
    bus.kernel.run()
    assert ear.heard == [(b"\x51\x01\x02", b"\x01\x00\x01")]
    # A line without ninth bits leaves them out.
    plain = Bus(Kernel(), Bench().bus.protocol)
    port, ear = Port(plain.medium, lambda _heard, _now: None), NinthBits()
    plain.medium.listen(0, ear, None)
    port.talk(b"\x51\x01", b"\x01\x00")
    plain.kernel.run()
    assert ear.heard == [(b"\x51\x01", None)]


def test_ninth_bits_of_a_long_run_stay_with_their_bytes() -> None:
    bus = Bus(Kernel(), Bench().bus.protocol, rate=NINE_BITS)
    port, ear = Port(bus.medium, lambda _heard, _now: None), NinthBits()
    bus.medium.listen(0, ear, None)
    port.talk(b"A")
    port.talk(b"B" * 5_000, 1)
    port.talk(b"C" * 5_000)
    bus.kernel.run()
    data = b"".join(data for data, _ in ear.heard)
    ninth = b"".join(bits or b"" for _, bits in ear.heard)
    assert data == b"A" + b"B" * 5_000 + b"C" * 5_000
    assert ninth == b"\x00" + b"\x01" * 5_000 + b"\x00" * 5_000


def test_the_ninth_bits_of_overlapped_bytes_may_be_wrong_and_those_of_others_never() -> None:
    bus = Bus(Kernel(), Bench().bus.protocol, rate=NINE_BITS, seed=3)
    ear = NinthBits()
    bus.medium.listen(0, ear, None)
    bus.medium.transmit("one", b"A" * 40, 0, b"\x01" * 40)
    bus.kernel.at(NINE_BITS.span(20), bus.medium.transmit, "two", b"B" * 40, 0, b"\x01" * 40)
    bus.kernel.run()
    first = b"".join(bits or b"" for _, bits in ear.heard[:-1])[:40]
    assert first[:20] == b"\x01" * 20
    assert set(first[20:]) == {0, 1}


def test_on_a_line_without_ninth_bits_nobody_hears_any() -> None:
    bus = Bus(Kernel(), Bench().bus.protocol)
    port, ear = Port(bus.medium, lambda _heard, _now: None), NinthBits()
    bus.medium.listen(0, ear, None)
    port.talk(b"\x51", 1)
    bus.kernel.run()
    assert ear.heard == [(b"\x51", None)]


def test_who_says_more_than_the_line_can_take_is_asked_to_hold_back_until_there_is_room() -> None:
    bench = Bench()
    asked: list[bool] = []
    unsent: list[int] = []

    def hold(held: bool) -> None:
        asked.append(held)
        unsent.append(port.unsent)

    port = Port(bench.bus.medium, lambda _heard, _now: None, hold=hold)
    for _ in range(10):
        port.talk(b"U" * 4_000)
    assert asked == [True]
    bench.run()
    assert asked == [True, False]
    assert 16_384 < unsent[0] <= 16_384 + 4_000
    assert 0 < unsent[1] <= 4_096
    assert bench.bus.medium.counters().bytes == 40_000
