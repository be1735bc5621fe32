"""Where the line goes on outside: bytes pass at once, both ways, and spoil nothing."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import SacSettings
from sacbus.bus import LivePort, Port
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.node import Heard
from sacbus.wire.times import turnaround
from tests.nodes.sac.bench import Bench, packet

ACK_82 = bytes((2, 1, 82, 6))
ACK_90 = bytes((2, 1, 90, 6))


class Outside:
    """A live port of a bench, and what it has passed on, with the times."""

    def __init__(self, bench: Bench) -> None:
        self.passed: list[tuple[Ns, bytes]] = []
        self._kernel = bench.kernel
        bench.outside = True
        self.port = LivePort(bench.bus.medium, self._send, name="/dev/ttyUSB0")

    def _send(self, data: bytes) -> None:
        self.passed.append((self._kernel.now, data))


def joined(a: Bench, b: Bench, span: Callable[[int], Ns]) -> None:
    """Two lines become one: what begins on either reaches the other ``span(bytes)`` later."""
    kernel = a.kernel

    def to_a(data: bytes) -> None:
        kernel.at(kernel.now + span(len(data)), port_a.talk, data)

    def to_b(data: bytes) -> None:
        kernel.at(kernel.now + span(len(data)), port_b.talk, data)

    port_a, port_b = LivePort(a.bus.medium, to_b), LivePort(b.bus.medium, to_a)


def test_what_begins_on_the_line_is_passed_on_at_that_instant() -> None:
    bench = Bench()
    outside = Outside(bench)
    asked = packet("v100")
    bench.sends(asked, at=5 * MS)
    bench.run()
    (begun, data), (answered, ack) = outside.passed
    assert (begun, data) == (5 * MS, asked)
    assert ack == ACK_82
    assert answered == bench.heard[-1].at


def test_bytes_from_outside_have_taken_their_time_and_are_heard_at_once() -> None:
    bench = Bench()
    outside = Outside(bench)
    asked = packet("v100")
    bench.kernel.run_until(50 * MS)
    outside.port.talk(asked)
    bench.run()
    # The ACK's time counts from the end of the packet, which was when its bytes were handed over.
    assert outside.passed == [(50 * MS + turnaround(4, nul_follows=True), ACK_82)]
    span = bench.bus.rate.span
    assert bench.bus.medium.counters().busy == span(len(asked)) + span(len(ACK_82))


def test_saying_nothing_from_outside_is_no_transmission() -> None:
    bench = Bench()
    Outside(bench).port.talk(b"")
    bench.run()
    assert bench.bus.medium.counters().transmissions == 0


def test_a_packet_in_the_first_instant_of_all_is_heard() -> None:
    bench = Bench()
    outside = Outside(bench)
    outside.port.talk(packet("v100"))
    bench.run()
    assert [data for _, data in outside.passed] == [ACK_82]


@given(st.lists(st.integers(1, 30), max_size=12), st.integers(0, 3))
def test_a_packet_is_the_same_however_an_adapter_cuts_it_up(sizes: list[int], gap: int) -> None:
    bench = Bench()
    outside = Outside(bench)
    rest = packet("m400v120a1d1")
    now = 10 * MS
    for size in [*sizes, len(rest)]:
        chunk, rest = rest[:size], rest[size:]
        # An adapter hands bytes over when they have come, or later.
        now += bench.bus.rate.span(len(chunk)) + gap * MS
        bench.kernel.at(now, outside.port.talk, chunk)
    bench.run()
    assert [data for _, data in outside.passed] == [ACK_82]
    assert bench.bus.medium.counters().collided == 0


def test_what_comes_late_from_outside_follows_what_is_on_the_line_and_spoils_nothing() -> None:
    # The NUL of a packet, held back in the adapter until the ACK is on its way.
    bench = Bench()
    outside = Outside(bench)
    asked = packet("v100")
    bench.kernel.at(20 * MS, outside.port.talk, asked[:-1])
    bench.kernel.at(20 * MS + 700_000, outside.port.talk, asked[-1:])
    bench.run()
    assert [one.data for one in bench.heard if one.data != asked[:-1]] == [ACK_82, asked[-1:]]
    assert bench.bus.medium.counters().collided == 0


def test_a_program_on_a_port_waits_until_the_outside_has_done() -> None:
    bench = Bench()
    outside = Outside(bench)
    heard: list[bytes] = []

    def hear(one: Heard, _now: Ns) -> None:
        heard.append(one.data)

    port = Port(bench.bus.medium, hear)
    bench.kernel.run_until(20 * MS)
    outside.port.talk(packet("v100", 90))
    port.talk(packet("v200"))
    bench.run()
    (begun, _), _ack = outside.passed
    assert begun == 21 * MS
    assert heard == [packet("v100", 90), ACK_82]


@pytest.mark.parametrize("immediate", [False, True], ids=["a wire's pace", "no pace at all"])
def test_mother_on_one_line_reaches_the_nodes_of_both(immediate: bool) -> None:
    # No pace: a pseudo-terminal between two programs, where bytes arrive before they can have.
    kernel = Kernel()
    here = Bench(82, kernel=kernel)
    there = Bench(90, kernel=kernel)
    joined(here, there, (lambda _: 0) if immediate else here.bus.rate.span)
    for number, node in enumerate((82, 90, 82, 90)):
        here.port.talk(packet(f"v1{number}", node))
        kernel.run()
    heard = b"".join(one.data for one in here.heard)
    assert heard == (ACK_82 + ACK_90) * 2
    assert here.bus.medium.counters().collided == there.bus.medium.counters().collided == 0


def test_a_closed_live_port_passes_nothing_on() -> None:
    bench = Bench(settings=SacSettings())
    outside = Outside(bench)
    outside.port.close()
    bench.sends(packet("v100"), at=MS)
    bench.run()
    assert outside.passed == []


def test_an_adapter_that_brings_more_than_the_line_takes_is_held_back() -> None:
    bench = Bench()
    held: list[bool] = []
    port = LivePort(bench.bus.medium, lambda _: None, hold=held.append)
    for _ in range(20):
        port.talk(bytes(1_000))
    assert held == [True]
    bench.kernel.run_until(20 * SECOND)
    assert held == [True, False]
