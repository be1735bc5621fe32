"""What the SAC protocol protects: a line with bit errors, and what nodes executed wrongly on it.

``python -m benchmarks.protection [--packets N] [--rate P] [--seed S] [--record FILE] [--list]``.
Mother sends motion commands to 252 nodes, every address that a SAC can have, and all of it is
recorded. What was not as sent is counted from the recording alone, by what was damaged; what the
nodes say that they accepted, and where their motors stand, must agree with it. Beside it stands
what ``benchmarks.prediction`` says. Same arguments, same output.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from random import Random
from typing import BinaryIO

from benchmarks.executions import Executions
from benchmarks.prediction import Predicted, bound
from nodes.sac import SacNode, SacSettings
from nodes.sac.board import SacBoard
from nodes.sac.protocol import SAC_PROTOCOL
from sacbus.bus import BitErrors, Bus, Port
from sacbus.configuration import Configuration
from sacbus.host import VirtualHost
from sacbus.hosted import HostedBus
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.mother import safe_body
from sacbus.trace import Recorder, read
from sacbus.wire import GENERAL_CALL, MOTHER, ack, encode

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


class Telling(SacBoard):
    """The parts of a SAC, which tells what it accepts from the line, as (its address, line)."""

    __slots__ = ("account", "executed")

    #: Set by whoever listens, before the line is used.
    account: list[tuple[int, bytes]]
    executed: list[bytes]

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        self.account.append((self.network.address, body))
        self.executed.append(body)
        super().network_line(body, source, destination, now)


class Study:
    """A run over ``packets`` packets with bit errors at ``rate``, recorded into ``file``.

    ``found`` is what the recording says.
    """

    def __init__(self, packets: int, rate: float, seed: int, file: BinaryIO) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, SAC_PROTOCOL, seed=seed)
        #: What nodes have accepted, and mother has heard, since the last packet.
        self.account: list[tuple[int, bytes]] = []
        self.heard = b""
        #: Executions as the nodes tell of them, in the words of ``Executions.by_node``; and
        #: packets that mother knows to be executed.
        self.by_node: Counter[tuple[int, bool, bool]] = Counter()
        self.known = 0
        self.nodes: dict[int, Telling] = {}
        self._random = Random(seed)
        for address in ADDRESSES:
            made = address, SacSettings(), self.bus.rate, self.bus.tell
            node = SacNode(*made)
            node.board = telling = Telling(*made)
            telling.account, telling.executed = self.account, []
            self.nodes[address] = telling
            self.bus.add(node)
        self._port = Port(
            self.bus.medium, lambda heard, _now: self._hear(heard.data), latency=0, name="mother"
        )
        self._prepare()
        configuration = Configuration(nodes=tuple(ADDRESSES), seed=seed)
        hosted = HostedBus(configuration, self.bus, VirtualHost(self.kernel))
        with Recorder(hosted, file):
            self.fault = self.bus.medium.add_fault(BitErrors(rate))
            for address, line in self._commands(packets):
                self._packet(address, line)
            self.fault.off()
            self.kernel.run()
        self.found = Executions(read(file))

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
        """Send one, wait until nothing can follow from it, and note what the nodes tell of it."""
        self._port.talk(encode(node, MOTHER, line))
        kernel = self.kernel
        kernel.run_until(kernel.now + SLOT)
        for address, accepted in self.account:
            self.by_node[address, address == node, accepted == line] += 1
        self.known += self.heard == ack(MOTHER, node)
        self.account.clear()
        self.heard = b""

    def agrees(self) -> bool:
        """Whether nodes and mother tell the same as the recording, node by node."""
        return self.by_node == self.found.by_node and self.known == self.found.counts["heard"]

    def motors(self) -> tuple[int, int, int]:
        """Nodes whose motor stands where the recording says, and the lines that they accepted bring
        it; where it does not; and those that accepted a line that is none of mother's, which are
        not judged.
        """
        stand: Counter[bool | None] = Counter()
        for address, node in self.nodes.items():
            moves = [MOVE.fullmatch(line) for line in node.executed]
            steps = sum(int(move[1]) for move in moves if move)
            where, _, _ = node.engine.where(self.kernel.now)
            stands = where == steps == self.found.position(address)
            stand[stands if all(moves) else None] += 1
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
    predicted = Predicted(study.found.sent, ADDRESSES, rate)
    found = [f"{'':<36}{'measured':>10}{'predicted':>14}  {'bound, 1e-3 each side'}"]
    for name, words, attribute in ROWS:
        expected = getattr(predicted, attribute)
        # Of what nearly always happens, it is the exceptions that are few and independent.
        low, high = bound(expected)
        if name == "as sent":
            fewest, most = bound(predicted.packets - expected)
            low, high = predicted.packets - most, predicted.packets - fewest
        count = study.found.counts[name]
        verdict = "within" if low <= count <= high else "OUTSIDE"
        found.append(f"{words:<36}{count:>10}{expected:>14,.6g}  {low} to {high}: {verdict}")
    return found


def _file(kept: Path | None) -> AbstractContextManager[BinaryIO]:
    """An empty one for the recording; without a name one that is gone when it is closed."""
    return tempfile.TemporaryFile() if kept is None else kept.open("w+b")


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="What nodes execute wrongly on a bad line.")
    parser.add_argument("--packets", type=int, default=1_000_000)
    parser.add_argument("--rate", type=float, default=1e-4, help="probability per data bit")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--record", type=Path, metavar="FILE", help="keep the recording there")
    parser.add_argument("--list", action="store_true", help="every wrong execution, line by line")
    options = parser.parse_args(argv)
    with _file(options.record) as file:
        study = Study(options.packets, options.rate, options.seed, file)
    print(
        f"{options.packets} packets to {len(ADDRESSES)} nodes, bit errors at {options.rate:g}, "
        f"seed {options.seed}: {study.fault.count} bits inverted"
    )
    for line in table(study, options.rate):
        print(line)
    found, counts = study.found, study.found.counts
    print(f"refused with NAK {counts['refused']}, lost in silence {counts['lost']}")
    print(f"executions by nodes that were not meant {counts['by others']}")
    print(
        f"wrong or unchecked {len(found.wrong)}, "
        f"damage visible in the recording {counts['visible']}, "
        f"where the class says {counts['there']}"
    )
    right, wrong, strange = study.motors()
    print(
        f"motors that stand where the lines bring them {right}, elsewhere {wrong}, "
        f"not judged {strange}"
    )
    print(
        f"what nodes and mother tell agrees with the recording: {'yes' if study.agrees() else 'NO'}"
    )
    if options.list:
        print("\n".join(found.wrong))
    return 0 if study.agrees() else 1


if __name__ == "__main__":
    raise SystemExit(main())
