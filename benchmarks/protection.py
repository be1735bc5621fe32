"""What the SAC protocol protects: a line with bit errors, and what nodes executed wrongly on it.

``python -m benchmarks.protection [--packets N] [--rate P] [--seed S]``. Mother sends motion
commands to 252 nodes, every address that a SAC can have; nodes tell what they accepted; where their
motors stand in the end says whether that is what they did. What was not as sent is looked up in the
trace of the line, which shows what was sent and what arrived, and is counted by what was damaged.
Beside it stands what ``benchmarks.prediction`` says. Same arguments, same output.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Iterator
from random import Random

from benchmarks.prediction import Predicted, bound
from nodes.sac import SacNode, SacSettings
from nodes.sac.protocol import SAC_PROTOCOL
from sacbus.bus import BitErrors, Bus, Port, Transmission
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.mother import safe_body
from sacbus.wire import GENERAL_CALL, MOTHER, ack, encode, nak

#: All that a SAC can have: 0 is everybody, 1 mother, 2 and 3 are STX and ETX.
ADDRESSES = range(4, 256)

#: From packet to packet: the packet takes 3.6 ms, its answer 1.5 ms, its motion less than 6 ms; and
#: half the rounds' worth of packets before another is for a node whose address differs in one bit.
SLOT: Ns = 12 * MS
#: Coprime to 252.
STRIDE = 107

#: Steps and RPM of the motions: together 1600 lines, whose CRCs are any byte.
STEPS = range(4, 20)
SPEEDS = range(900, 1_000)

#: A line of mother's.
MOVE = re.compile(rb"m(\d{1,2})v9\d\d ?")

#: Bytes before a packet's body: STX, destination, source.
HEADER = 3


class Telling(SacNode):
    """A SAC that tells what it accepts from the line, as (its address, destination, line)."""

    __slots__ = ("account", "executed")

    #: Set by whoever listens, before the line is used.
    account: list[tuple[int, int, bytes]]
    executed: list[bytes]

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        self.account.append((self.address, destination, body))
        self.executed.append(body)
        super().network_line(body, source, destination, now)


class Study:
    """A run over ``packets`` packets with bit errors at ``rate``; the counts are its attributes."""

    def __init__(self, packets: int, rate: float, seed: int) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, SAC_PROTOCOL, seed=seed)
        #: What nodes have accepted, and mother has heard, since the last packet.
        self.account: list[tuple[int, int, bytes]] = []
        self.heard = b""
        #: The trace: what was on the line since the last packet.
        self.trace: list[Transmission] = []
        self.nodes: dict[int, Telling] = {}
        self._random = Random(seed)
        for address in ADDRESSES:
            node = Telling(address, SacSettings(), self.bus.rate, self.bus.tell)
            node.account, node.executed = self.account, []
            self.nodes[address] = node
            self.bus.add(node)
        self._port = Port(self.bus.medium, lambda heard, _now: self._hear(heard.data), latency=0)
        self.sent: Counter[tuple[int, bytes]] = Counter()
        #: Counts of packets by what became of them, and of executions by nodes not meant.
        self.counts: Counter[str] = Counter()
        #: Every execution that was not as sent: what was sent, what arrived, who did what.
        self.wrong: list[str] = []
        self._prepare()
        self.fault = self.bus.medium.add_fault(BitErrors(rate))
        self.bus.medium.watchers.append(self.trace.append)
        for address, line in self._commands(packets):
            self._packet(address, line)
        self.fault.off()

    def _prepare(self) -> None:
        """Ramps so sharp that every motion is over before the next packet."""
        for line in (b"a999999", b"d999999"):
            self._port.talk(encode(GENERAL_CALL, MOTHER, safe_body(line)))
            self.kernel.run_until(self.kernel.now + SECOND)
        for node in self.nodes.values():
            node.executed.clear()
        self.account.clear()

    def _commands(self, packets: int) -> Iterator[tuple[int, bytes]]:
        choose, count = self._random.choice, len(ADDRESSES)
        for number in range(packets):
            address = ADDRESSES[number * STRIDE % count]
            yield address, safe_body(b"m%dv%d" % (choose(STEPS), choose(SPEEDS)))

    def _hear(self, data: bytes) -> None:
        self.heard += data

    def _packet(self, node: int, line: bytes) -> None:
        """Send one, wait until nothing can follow from it, and count what did."""
        self.sent[node, line] += 1
        self._port.talk(encode(node, MOTHER, line))
        kernel = self.kernel
        kernel.run_until(kernel.now + SLOT)
        if self.account == [(node, node, line)] and not self.trace[0].faults:
            self.counts["as sent"] += 1
            if self.heard != ack(MOTHER, node):
                self.counts["unknown"] += 1
        else:
            self._judge(node, line)
        self.account.clear()
        self.trace.clear()
        self.heard = b""

    def _judge(self, node: int, line: bytes) -> None:
        """What became of a packet that did not arrive as sent, by what the nodes tell."""
        counts = self.counts
        # Somebody who took the noise before it for a packet may have begun to answer first.
        sent = next(one for one in self.trace if one.sender is self._port)
        if not self.account:
            counts["refused" if self.heard == nak(MOTHER, node) else "lost"] += 1
            return
        arrived = sent.outcome(self.bus.medium.seed)
        kind, part = self._kind(node, line, arrived)
        counts[kind] += 1
        if part is None:
            counts["unknown"] += self.heard != ack(MOTHER, node)
            return
        counts["by others"] += sum(address != node for address, _, _ in self.account)
        counts["visible"] += arrived != sent.data
        counts["there"] += arrived[part] != sent.data[part]
        self.wrong.append(
            f"{kind}: sent {sent.data.hex(' ')}, arrived {arrived.hex(' ')}, "
            f"{len(self.account)} x {self.account[0][2]!r}"
        )

    def _kind(self, node: int, line: bytes, arrived: bytes) -> tuple[str, slice | None]:
        """The class of what nodes executed, and the part of the packet that the trace must show."""
        behind = HEADER + len(line)
        addressed = {destination for _, destination, _ in self.account}
        if addressed != {node}:
            return "everybody" if GENERAL_CALL in addressed else "other node", slice(1, 2)
        right = all(done == line for _, _, done in self.account)
        if arrived[behind + 1 : behind + 2] in (b"\x00", b"\x03"):
            if right:
                return "unchecked", slice(behind + 1, behind + 2)
            return "unchecked wrong", slice(HEADER, behind)
        return ("as sent", None) if right else ("undetected", slice(HEADER, behind))

    def motors(self) -> tuple[int, int, int]:
        """Nodes whose motor stands where the lines that they accepted bring it; where it does not;
        and those that accepted a line that is none of mother's, which are not judged.
        """
        stand: Counter[bool | None] = Counter()
        self.kernel.run()
        for node in self.nodes.values():
            moves = [MOVE.fullmatch(line) for line in node.executed]
            steps = sum(int(move[1]) for move in moves if move)
            where = node.snapshot(self.kernel.now).position_pulses
            stand[where == steps if all(moves) else None] += 1
        return stand[True], stand[False], stand[None]


ROWS = (
    ("as sent", "executed by its node as sent", "as_sent"),
    ("unknown", "  of these, mother hears no ACK", "unknown"),
    ("other node", "header: executed by another node", "other_node"),
    ("everybody", "header: executed by everybody", "everybody"),
    ("undetected", "body damaged and CRC right", "undetected"),
    ("unchecked", "verdict 00 or 03, line as sent", "unchecked"),
    ("unchecked wrong", "verdict 00 or 03, line damaged", "unchecked_wrong"),
)
"""What is counted, in words, and where the prediction has it."""


def table(study: Study, rate: float) -> list[str]:
    """Measured beside predicted, as lines of text."""
    predicted = Predicted(study.sent, ADDRESSES, rate)
    found = [f"{'':<36}{'measured':>10}{'predicted':>14}  {'bound, 1e-3 each side'}"]
    for name, words, attribute in ROWS:
        expected = getattr(predicted, attribute)
        # Of what nearly always happens, it is the exceptions that are few and independent.
        low, high = bound(expected)
        if name == "as sent":
            fewest, most = bound(predicted.packets - expected)
            low, high = predicted.packets - most, predicted.packets - fewest
        count = study.counts[name]
        verdict = "within" if low <= count <= high else "OUTSIDE"
        found.append(f"{words:<36}{count:>10}{expected:>14,.6g}  {low} to {high}: {verdict}")
    return found


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="What nodes execute wrongly on a bad line.")
    parser.add_argument("--packets", type=int, default=1_000_000)
    parser.add_argument("--rate", type=float, default=1e-4, help="probability per data bit")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="every wrong execution, line by line")
    options = parser.parse_args(argv)
    study = Study(options.packets, options.rate, options.seed)
    print(
        f"{options.packets} packets to {len(ADDRESSES)} nodes, bit errors at {options.rate:g}, "
        f"seed {options.seed}: {study.fault.count} bits inverted"
    )
    for line in table(study, options.rate):
        print(line)
    counts = study.counts
    print(f"refused with NAK {counts['refused']}, lost in silence {counts['lost']}")
    print(f"executions by nodes that were not meant {counts['by others']}")
    print(
        f"wrong or unchecked {len(study.wrong)}, damage visible in the trace {counts['visible']}, "
        f"where the class says {counts['there']}"
    )
    right, wrong, strange = study.motors()
    print(
        f"motors that stand where the lines bring them {right}, elsewhere {wrong}, "
        f"not judged {strange}"
    )
    if options.list:
        print("\n".join(study.wrong))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
