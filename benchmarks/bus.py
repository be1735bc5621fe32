"""How fast a whole bus is in virtual time: mother, line, 250 nodes, profiles, ACKs.

Every command is a distinct line that a node parses, plans and runs; every ACK is counted. The
baseline is what the kernel must do at least: five bare heap events an exchange.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import count

from benchmarks.figure import Figure, alternate
from benchmarks.kernel import EVENTS, bare_heap
from nodes.sac import KIND, SacSettings
from sacbus.bus import Bus, Port
from sacbus.kernel import SECOND, Kernel, Ns
from sacbus.mother import Acknowledged, Caller, safe_body
from sacbus.node import Heard
from sacbus.wire import ACK, MOTHER, encode
from sacbus.wire.times import MOTHER_GAP

NODES = 250
FIRST = 6
#: Exchanges in a round; an integer number of rounds over all nodes.
EXCHANGES = 5_000
BROADCASTS = 100


class FullBus:
    """A bus with some nodes that have sharp ramps."""

    def __init__(self, nodes: int, acceleration: int) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, KIND.protocol)
        for address in range(FIRST, FIRST + nodes):
            self.bus.add(KIND.create(address, SacSettings(), self.bus.rate, self.bus.tell))
        self.answers: Counter[int] = Counter()
        self.lines = count()
        with self.mother() as caller:
            for line in (b"a%d" % acceleration, b"d%d" % acceleration):
                caller.broadcast(line, lambda _outcome: None)
            self.kernel.run()

    @contextmanager
    def mother(self) -> Iterator[Caller]:
        """Mother, who listens only while she is needed."""
        port = Port(self.bus.medium, lambda heard, _now: caller.hear(heard.data), latency=0)
        caller = Caller(self.kernel, port.talk)
        yield caller
        port.close()

    def line(self, steps: int) -> bytes:
        """A line unlike the 60 000 before it and more, so that no cache of parsed lines helps.

        ``steps`` to twice as many steps at 250 to 399 RPM, and 0 to 19 pulses more. (The 150 pairs
        of ramps are worked out once: nodes that are alike share them.)
        """
        number = next(self.lines)
        return b"m%dv%du%d" % (
            steps + number // 150 % steps,
            250 + number % 150,
            number // (150 * steps) % 20,
        )

    def packets(self, times: int, addresses: range, steps: int) -> None:
        """``times`` commands as packets, each sent the gap after the ACK of the one before."""
        kernel = self.kernel
        packets = [
            encode(addresses[number % len(addresses)], MOTHER, safe_body(self.line(steps)))
            for number in range(times)
        ]
        packets.reverse()

        def send() -> None:
            port.talk(packets.pop())

        def hear(heard: Heard, now: Ns) -> None:
            dest, source, mark = heard.data[1:]
            assert (dest, mark) == (MOTHER, ACK), heard
            self.answers[source] += 1
            if packets:
                kernel.at(now + MOTHER_GAP, send)

        port = Port(self.bus.medium, hear, latency=0)
        send()
        kernel.run_until(kernel.now + times * SECOND)
        assert not packets, f"{len(packets)} packets were never sent: one was not acknowledged"
        port.close()

    def exchange(self, times: int, addresses: range, steps: int) -> None:
        """The same through mother, who builds, sends, times and counts."""
        answers = self.answers
        left = times

        def done(outcome: object) -> None:
            nonlocal left
            assert isinstance(outcome, Acknowledged), outcome
            answers[outcome.node] += 1
            left -= 1
            if left:
                ask()

        def ask() -> None:
            caller.call(addresses[left % len(addresses)], self.line(steps), done)

        with self.mother() as caller:
            ask()
            self.kernel.run_until(self.kernel.now + times * SECOND)
        assert not left, f"{left} requests are without an answer"

    def broadcast(self, times: int) -> None:
        """``times`` distinct broadcasts, which every node obeys."""
        left = times

        def done(_outcome: object) -> None:
            nonlocal left
            left -= 1

        with self.mother() as caller:
            for _ in range(times):
                caller.broadcast(b"v%d" % (100 + next(self.lines) % 100_000), done)
            self.kernel.run_until(self.kernel.now + times * SECOND)
        assert not left, f"{left} broadcasts are not out"


def figures(rounds: int) -> list[Figure]:
    """Packets per second, with all nodes in use and with most of them idle; broadcasts."""
    found = []
    events = EVENTS / (5 * EXCHANGES)
    many, few = range(FIRST, FIRST + NODES), range(FIRST, FIRST + 10)
    # A node is asked again after 7 ms x the nodes in use: by then it is done with these commands.
    for name, nodes, addresses, acceleration, steps, goal in (
        ("bus, 250 nodes, all of them busy", NODES, many, 10, 200, 150e3),
        ("the same through mother", NODES, many, 10, 200, None),
        ("bus, 250 nodes, 240 of them idle", NODES, few, 400, 20, None),
        ("bus, 10 nodes, none of them idle", 10, few, 400, 20, None),
    ):
        full = FullBus(nodes, acceleration)
        way = full.exchange if "mother" in name else full.packets
        act = partial(way, EXCHANGES, addresses, steps)
        act()
        took, baseline = alternate(act, bare_heap, rounds)
        assert sum(full.answers.values()) == (rounds + 1) * EXCHANGES
        assert not full.bus.medium.counters().collided
        assert not full.bus.report_counts, full.bus.report_counts
        found.append(
            Figure(
                name,
                2 * EXCHANGES / took,
                "packets/s",
                baseline / events / took,
                "5 bare heap events an exchange",
                goal,
                "value, at least" if goal else "",
            )
        )
    full = FullBus(NODES, 10)
    took, baseline = alternate(lambda: full.broadcast(BROADCASTS), bare_heap, rounds)
    found.append(
        Figure(
            "broadcast to 250 nodes, parsed and obeyed",
            BROADCASTS / took,
            "broadcasts/s",
            baseline / EVENTS * NODES * BROADCASTS / took,
            "a bare heap event a node",
        )
    )
    return found
