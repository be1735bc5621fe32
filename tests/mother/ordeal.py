"""Mother on a line with bit errors, lost bytes and nodes that die and return, and what it all did.

Everything that is asked for is unlike everything else that is, so that whatever a node accepts, or
is seen to run, tells what it came of. Beside mother's outcomes stand two other accounts: what each
node says that it accepted, and what the recording shows, read back from its file.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from random import Random
from typing import Final

from nodes.sac import SacNode, SacSettings
from nodes.sac.board import SacBoard
from nodes.sac.protocol import SAC_PROTOCOL
from sacbus.bus import Bus, Dead, Fault, FaultOn, Port
from sacbus.configuration import Configuration, NodeAt
from sacbus.host import VirtualHost
from sacbus.hosted import HostedBus
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.mother import Acknowledged, Caller, MotherError, Sent, safe_body
from sacbus.node import BOOT, OFF
from sacbus.trace import Recorder, read
from sacbus.trace.records import Moved
from sacbus.trace.records import Sent as OnTheLine
from sacbus.wire import ACK, MOTHER, ack

Outcome = Acknowledged | Sent | MotherError

#: Neighbours in every sense: most have one that differs in a single bit, 8 and 16 are one from 0.
ADDRESSES: Final = range(8, 28)

#: Those that lose their power now and then, and their transceiver.
UNPOWERED: Final = 10
DEAF: Final = 21

#: Ramps so sharp that each motion is over before its ACK is: a node that still moves when mother
#: asks for the next thing runs what nobody has asked for.
ACC: Final = 99_900
#: How recorded commands end, therefore.
RAMPS: Final = "a999d999"

#: Bytes of a packet before its body: STX, destination, source; and behind: ETX, CRC, NUL.
HEADER: Final = 3
TRAILER: Final = 3

#: No answer to one of these packets begins later after it began.
ANSWERED: Final[Ns] = 8 * MS


@dataclass(slots=True)
class Asked:
    """A request: to ``node`` (0: all), and what became of it."""

    node: int
    line: bytes
    accept_duplicates: bool
    outcome: Outcome | None = None

    @property
    def moves(self) -> bool:
        """Whether it is a motion; an edit of a queue position is not."""
        return self.line.startswith(b"m")


@dataclass(frozen=True, slots=True)
class Run:
    """By the recording: ``node`` began to run ``command``; ``packet`` was mother's last until then.

    As text it is a line of the list of what was run wrongly.
    """

    when: Ns
    node: int
    command: str
    packet: OnTheLine

    @property
    def asked_for(self) -> bool:
        """Whether that packet asks this node, or everybody, for this."""
        line = self.packet.data[HEADER:-TRAILER].decode("latin-1").rstrip()
        return self.packet.data[1] in (0, self.node) and line == self.command

    def __str__(self) -> str:
        return (
            f"{self.when} ns: node {self.node} ran {self.command!r}, sent "
            f"{self.packet.data.hex(' ')}, arrived {self.packet.arrived.hex(' ')}"
        )


class Witness(SacBoard):
    """The parts of a SAC, which keeps account of what it accepts from the line: when, who, what."""

    __slots__ = ("account",)

    account: list[tuple[Ns, int, bytes]]

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        self.account.append((now, self.network.address, body))
        super().network_line(body, source, destination, now)


class Ordeal:
    """``count`` requests in a row on a line with these faults; recorded."""

    def __init__(self, count: int, faults: Sequence[Fault], seed: int) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, SAC_PROTOCOL, seed=seed)
        #: What nodes say that they accepted.
        self.account: list[tuple[Ns, int, bytes]] = []
        self.asked: list[Asked] = []
        self.ended = 0
        self._random = Random(seed)
        self._requests = self._lines(count)
        for address in ADDRESSES:
            made = address, SacSettings(acc=ACC, dec=ACC), self.bus.rate, self.bus.tell
            node = SacNode(*made)
            node.board = witness = Witness(*made)
            witness.account = self.account
            self.bus.add(node)
        port = Port(self.bus.medium, lambda heard, _: self.caller.hear(heard.data), latency=0)
        port.name = "mother"
        self.caller = Caller(self.kernel, port.talk, unsent=lambda: port.unsent)
        nodes = tuple(NodeAt(address, "sac", {"acc": ACC, "dec": ACC}) for address in ADDRESSES)
        self._hosted = HostedBus(
            Configuration(nodes=nodes, seed=seed), self.bus, VirtualHost(self.kernel)
        )
        self._deaf: FaultOn | None = None
        file = BytesIO()
        with Recorder(self._hosted, file):
            self.faults = [self.bus.medium.add_fault(fault) for fault in faults]
            self._next()
            # Far more than any of it takes: what is not over by then never will be.
            self.kernel.run_until(count * SECOND // 5)
        #: Mother's own account, as it was then.
        self.statistics = {node: replace(one) for node, one in self.caller.statistics.items()}
        self.strays = self.caller.strays
        #: What was recorded, read back.
        self.records = list(read(file))
        self.packets = [
            one for one in self.records if type(one) is OnTheLine and one.sender == "mother"
        ]
        self.runs = self._recorded_runs()

    def _lines(self, count: int) -> Iterator[Asked]:
        for number in range(count):
            node = self._random.choice(ADDRESSES)
            motion = b"m%dv%d" % (1 + number // 9_000, 1_000 + number % 9_000)
            match self._random.randrange(20):
                case 0 if self._random.random() < 0.5:
                    yield Asked(0, motion, accept_duplicates=False)
                case 1 | 2:
                    yield Asked(node, motion, accept_duplicates=True)
                case 3 | 4 | 5 | 6 | 7:
                    yield Asked(node, b"q7" + motion, accept_duplicates=False)
                case _:
                    yield Asked(node, motion, accept_duplicates=False)

    def _next(self) -> None:
        """Ask for the next thing, once whoever runs what nobody asked for has been stopped."""
        self._dies_and_returns(len(self.asked))
        now = self.kernel.now
        for node in self.bus.nodes:
            if node.state(now) not in ("STANDBY", BOOT, OFF):
                panel = self._hosted.panel(node.address)
                panel.drive("estop", 0)
                panel.drive("estop", 1)
        request = next(self._requests, None)
        if request is None:
            return
        self.asked.append(request)

        def done(outcome: Outcome) -> None:
            assert request.outcome is None
            request.outcome = outcome
            self.ended += 1
            self._next()

        if request.node == 0:
            self.caller.broadcast(request.line, done)
        else:
            self.caller.call(
                request.node, request.line, done, accept_duplicates=request.accept_duplicates
            )

    def _dies_and_returns(self, number: int) -> None:
        """One node has no power for 300 requests of 1000, another one no transceiver."""
        match number % 1_000:
            case 100:
                self._hosted.panel(UNPOWERED).power(on=False)
            case 400:
                self._hosted.panel(UNPOWERED).power(on=True)
            case 500:
                self._deaf = self.bus.medium.add_fault(Dead(DEAF))
            case 800 if self._deaf is not None:
                self._deaf.off()

    # ---- what nodes say ----

    def wrongly_accepted(self) -> list[tuple[Ns, int, bytes]]:
        """When who says that it accepted what was not asked of it: when, who, what."""
        wanted = {
            (node, safe_body(one.line))
            for one in self.asked
            for node in (ADDRESSES if one.node == 0 else (one.node,))
        }
        return [one for one in self.account if one[1:] not in wanted]

    # ---- what the recording shows ----

    def _recorded_runs(self) -> list[Run]:
        """Every command that a node began to run, with the packet of mother's before it."""
        starts = [packet.start for packet in self.packets]
        runs = []
        before: dict[int, str] = {}
        for record in self.records:
            if type(record) is Moved:
                command = record.segment.command
                if command and command != before.get(record.node):
                    packet = self.packets[bisect(starts, record.when) - 1]
                    name = command.removesuffix(RAMPS)
                    runs.append(Run(record.when, record.node, name, packet))
                before[record.node] = command
        return runs

    def falsely_acknowledged(self, request: Asked) -> list[str]:
        """How the recording explains an ACK to ``request`` that its node had no reason for.

        Another node's ACK arrived with this one's address; or it is this node's own, to a line that
        was damaged on the way and still accepted.
        """
        starts = [one.start for one in self.packets if request.line in one.data]
        found = []
        for one in self.records:
            if type(one) is not OnTheLine or not isinstance(one.sender, int):
                continue
            slot = max((start for start in starts if start < one.start), default=None)
            if slot is None or one.start > slot + ANSWERED or one.data[-1] != ACK:
                continue
            packet = next(packet for packet in self.packets if packet.start == slot)
            if one.arrived == ack(MOTHER, request.node) and packet.arrived != packet.data:
                who = "another node" if one.sender != request.node else "a damaged line"
                found.append(f"{who}: {packet.arrived.hex(' ')} answered by {one.sender}")
        return found
