"""Who hears what: dead nodes, cut lines, wrong rates, late adapters and drivers, echoes, babble."""

from __future__ import annotations

import pytest

from nodes.sac import SacSettings
from nodes.sac.node import SacNode
from sacbus.bus import (
    EVERY_LINK,
    Babble,
    BitErrors,
    Bus,
    Cut,
    Dead,
    Echo,
    FaultError,
    LateDirection,
    Latency,
    LivePort,
    NoiseBursts,
    Passage,
    Port,
    Transmission,
    WrongBaud,
)
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.node import Heard
from sacbus.wire import GENERAL_CALL, MOTHER, ack
from tests.bus.test_bus import Everybody
from tests.nodes.sac.bench import Bench, packet

MOVE, MOVED = "m200v900a1d1", 200


def bench_of(*addresses: int, lanes: int = 1) -> tuple[Bench, list[Transmission]]:
    bench = Bench(*addresses, lanes=lanes)
    bench.outside = True
    seen: list[Transmission] = []
    bench.bus.medium.watchers.append(seen.append)
    return bench, seen


def say(bench: Bench, to: int, line: str = MOVE) -> None:
    """A packet of mother's, and all that follows from it."""
    bench.port.talk(packet(line, to))
    bench.kernel.run_until(bench.kernel.now + 5 * SECOND)


def moved(bench: Bench) -> list[int]:
    return [node.snapshot(bench.kernel.now).position_pulses for node in bench.nodes.values()]


def passage(sent: Transmission) -> Passage:
    assert sent.passage is not None
    return sent.passage


# ---- dead and cut -------------------------------------------------------------------------------


def test_a_dead_node_misses_broadcasts_and_its_own_packets_and_says_nothing() -> None:
    bench, seen = bench_of(10, 11)
    on = bench.bus.medium.add_fault(Dead(10))
    say(bench, GENERAL_CALL)
    say(bench, 10)
    say(bench, 11)
    assert moved(bench) == [0, 2 * MOVED]
    assert bench.answers == [ack(MOTHER, 11)]
    assert on.count == 2
    assert [list(passage(sent).missed) for sent in seen] == [[10], [10], [], []]
    assert passage(seen[0]).heard_by(10, 0) == b""
    assert passage(seen[0]).heard_by(11, 0) == passage(seen[0]).heard_by(EVERY_LINK, 0)
    assert passage(seen[0]).heard_by(11, 0) == seen[0].data
    on.off()
    say(bench, 10)
    assert moved(bench) == [MOVED, 2 * MOVED]


def test_what_a_dead_node_would_have_said_is_told_as_never_having_been_on_the_line() -> None:
    bench, seen = bench_of(10)
    bench.port.talk(packet(MOVE, 10))
    bench.kernel.run_until(bench.span(18) + 100_000)
    bench.bus.medium.add_fault(Dead(10))
    bench.run()
    assert moved(bench) == [MOVED]
    assert bench.heard == []
    assert (seen[-1].data, seen[-1].outcome(0)) == (ack(MOTHER, 10), b"")
    assert passage(seen[-1]).silent
    assert bench.bus.medium.counters().transmissions == 1


def test_beyond_a_cut_nodes_hear_each_other_and_nobody_else() -> None:
    bench, seen = bench_of(10, 11, 12)
    bench.bus.medium.add_fault(Cut(frozenset({11, 12})))
    say(bench, GENERAL_CALL)
    assert moved(bench) == [MOVED, 0, 0]
    assert list(passage(seen[0]).missed) == [11, 12]
    bench.nodes[11].board.network.send(12, MOVE.encode(), bench.kernel.now)
    bench.bus.touch(bench.nodes[11])
    bench.run()
    assert moved(bench) == [MOVED, 0, MOVED]
    assert bench.heard == []
    assert EVERY_LINK in passage(seen[1]).missed


def test_talk_on_the_two_sides_of_a_cut_neither_meets_nor_waits() -> None:
    bench, seen = bench_of(10, 11)
    medium = bench.bus.medium
    medium.add_fault(Cut(frozenset({11})))
    medium.transmit(bench.nodes[11], b"A" * 1_000, 0)
    say(bench, 10)
    assert moved(bench) == [MOVED, 0]
    assert bench.answers == [ack(MOTHER, 10)]
    assert medium.counters().collided == 0
    assert len(seen) == 3
    # On one side they meet as ever.
    medium.transmit(bench.nodes[11], b"A" * 100, 0)
    medium.transmit("somebody", b"B" * 100, 0)
    medium.transmit("another", b"C" * 100, 0)
    bench.run()
    assert medium.counters().collided == 2


# ---- wrong rates --------------------------------------------------------------------------------


@pytest.mark.parametrize("baud", [9_600, 19_200, 57_600, 115_200])
def test_a_node_at_another_rate_obeys_nothing_and_disturbs_nobody_who_waits_for_his_turn(
    baud: int,
) -> None:
    bench, seen = bench_of(10, 11)
    on = bench.bus.medium.add_fault(WrongBaud(10, baud))
    for _ in range(3):
        say(bench, 10)
        say(bench, 11)
    assert moved(bench) == [0, 3 * MOVED]
    assert bench.answers == [ack(MOTHER, 11)] * 3
    assert on.count == 3
    assert len(seen) == 9
    heard = passage(seen[0]).heard_by(10, 0)
    assert heard != seen[0].data
    assert heard
    assert passage(seen[0]).heard_by(11, 0) == seen[0].data


class Listening(SacNode):
    """A SAC that keeps what it hears."""

    __slots__ = ("heard",)

    def hear(self, heard: Heard, now: Ns) -> None:
        self.heard = getattr(self, "heard", b"") + heard.data
        super().hear(heard, now)


def test_what_is_told_that_a_node_heard_at_its_rate_is_what_came_to_it_through_collisions() -> None:
    kernel, seen = Kernel(), list[Transmission]()
    bus = Bus(kernel, Everybody())
    node = Listening(11, SacSettings(), bus.rate, bus.tell)
    bus.add(node)
    medium = bus.medium
    medium.watchers.append(seen.append)
    medium.add_fault(WrongBaud(11, 9_600))
    medium.add_fault(NoiseBursts(60, 4))
    port = Port(medium, lambda _heard, _now: None)
    for number in range(400):
        kernel.at(number * 50 * MS, port.talk, packet(MOVE, GENERAL_CALL))
    kernel.run_until(21 * SECOND)
    told = [passage(sent).heard_by(11, medium.seed) for sent in seen if sent.sender is not node]
    # Where they overlap, one's bytes are heard between another's.
    assert sorted(node.heard) == sorted(b"".join(told))
    assert medium.counters().collided > 20


def test_a_node_whose_rate_is_a_little_off_gets_by() -> None:
    bench, _ = bench_of(10)
    bench.bus.medium.add_fault(WrongBaud(10, 38_000))
    say(bench, 10)
    assert moved(bench) == [MOVED]
    assert b"".join(bench.answers) == ack(MOTHER, 10)


def test_what_a_node_says_at_another_rate_takes_its_time_and_is_read_bit_by_bit() -> None:
    bench, seen = bench_of(10)
    medium = bench.bus.medium
    medium.add_fault(WrongBaud(10, 19_200))
    sent = medium.transmit(bench.node, b"\x55", 0)
    bench.run()
    # Twice as long, and what is read of it ends a little later yet.
    assert 10 * SECOND // 19_200 <= sent.end <= 11 * SECOND // 19_200
    assert seen[0].outcome(0) == b"\x66\xe6"
    assert b"".join(bench.answers) == b"\x66\xe6"


# ---- links --------------------------------------------------------------------------------------


def listener(bench: Bench, name: str, times: list[Ns]) -> Port:
    """A program on the line, and when it hears something."""
    return Port(bench.bus.medium, lambda _heard, now: times.append(now), name=name)


def test_only_the_link_that_is_named_hears_late() -> None:
    bench, _ = bench_of(10)
    medium = bench.bus.medium
    heard: dict[str, list[Ns]] = {"a": [], "b": []}
    for name, times in heard.items():
        listener(bench, name, times)
    on = medium.add_fault(Latency(16 * MS, "a"))
    sent = medium.transmit("somebody", b"A", 0)
    bench.run()
    assert heard == {"a": [sent.end + 16 * MS], "b": [sent.end]}
    assert on.count == 1
    left = Port(medium, lambda _heard, _now: pytest.fail("it has left"), name="a")
    medium.transmit("somebody", b"A", 0)
    bench.kernel.run_until(bench.kernel.now + MS)
    left.close()
    bench.run()
    medium.add_fault(Latency(MS))
    sent = medium.transmit("somebody", b"A", 0)
    bench.run()
    assert [times[2] - sent.end for times in heard.values()] == [17 * MS, MS]


def test_only_the_link_that_is_named_hears_itself() -> None:
    bench, _ = bench_of(10)
    medium = bench.bus.medium
    heard: dict[str, bytes] = {"a": b"", "b": b""}

    def port(name: str) -> Port:
        def hear(part: Heard, _now: Ns) -> None:
            heard[name] += part.data

        return Port(medium, hear, name=name, latency=0)

    ports = [port(name) for name in heard]
    for fault in (Echo("b"), Echo()):
        heard.update(a=b"", b=b"")
        on = medium.add_fault(fault)
        for one, said in zip(ports, (b"A", b"B"), strict=True):
            one.talk(said)
            bench.run()
        on.off()
        assert heard == {"a": b"B" if fault.link else b"AB", "b": b"AB"}


def test_a_driver_that_stays_on_spoils_who_talks_in_that_time_and_nobody_later() -> None:
    bench, seen = bench_of(10, 11)
    on = bench.bus.medium.add_fault(LateDirection(2 * MS, node=10))
    medium = bench.bus.medium
    first = medium.transmit(bench.nodes[10], b"A" * 4, 0)
    bench.kernel.run_until(first.end + MS)
    spoilt = medium.transmit("somebody", b"B" * 10, 0)
    bench.kernel.run_until(spoilt.end + 5 * MS)
    medium.transmit("somebody", b"C" * 4, 0)
    bench.run()
    arrived = [sent.outcome(0) for sent in seen]
    assert arrived[0] == b"AAAA"
    # 1 ms of overlap: four bytes of 260 us.
    assert [one == ord("B") for one in arrived[1]] == [False] * 4 + [True] * 6
    assert arrived[2] == b"CCCC"
    assert on.count == 1
    assert [sent.faults for sent in seen] == [(), ("late_direction",), ()]


# ---- talkers, and the real line -----------------------------------------------------------------


def test_a_node_that_babbles_does_not_hear_itself_and_one_that_is_not_there_cannot() -> None:
    bench, _ = bench_of(10, 11)
    on = bench.bus.medium.add_fault(Babble(packet("m1", 10), 100 * MS, node=10))
    bench.kernel.run_until(SECOND)
    on.off()
    bench.run()
    assert moved(bench) == [0, 0]
    assert on.count == 11
    with pytest.raises(FaultError, match="fault 'babble': expected the address of a node on this"):
        bench.bus.medium.add_fault(Babble(b"A", MS, node=12))
    assert bench.bus.medium.faults == []


def test_who_babbles_without_a_pause_leaves_none() -> None:
    bench, seen = bench_of(10)
    on = bench.bus.medium.add_fault(Babble(b"A" * 10, 1))
    bench.kernel.run_until(SECOND)
    on.off()
    assert on.count == SECOND // bench.span(10) + 1
    assert not any(sent.collided for sent in seen)


def test_what_comes_over_a_real_line_and_goes_out_to_it_is_struck_as_well() -> None:
    bench, seen = bench_of(10)
    outside: list[bytes] = []
    port = LivePort(bench.bus.medium, outside.append)
    on = bench.bus.medium.add_fault(BitErrors(1))
    bench.kernel.run_until(SECOND)
    port.talk(b"\x0f\xff")
    bench.run()
    assert b"".join(bench.answers) == b"\xf0\x00"
    bench.bus.medium.transmit("somebody", b"\x55", 0)
    bench.run()
    assert outside == [b"\xaa"]
    assert on.count == 24
    assert [sent.data for sent in seen] == [b"\x0f\xff", b"\x55"]
