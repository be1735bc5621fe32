"""A bench for nodes: a kernel, a bus, nodes, and a port that writes down what it hears.

Everything on it is the real thing; only the hand that holds the sender is ours. Times are ns of
bus time. A line is *heard* at the end of its trigger byte, the one after ETX: then a node acts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from nodes.sac import KIND, SacNode, SacSettings
from sacbus.bus import Bus, Port, Transmission
from sacbus.kernel import Kernel, LineRate, Ns
from sacbus.node import Heard, Report, ReportKind, Snapshot
from sacbus.wire import ETX, MOTHER, NUL, STX, crc8, encode

__all__ = ["EVEN", "LOAD", "LOAD_ACC", "NODE", "Bench", "Said", "packet"]

#: The address of the node that most tests speak to.
NODE = 82

#: From the end of the trigger byte to the first pulse; the longer when acceleration changes.
LOAD: Ns = 16_000
LOAD_ACC: Ns = 40_000

#: A byte takes 250 us to the ns, so that runs of bytes take the same time however they are cut up.
EVEN = LineRate(40_000)


@dataclass(frozen=True, slots=True)
class Said:
    """Bytes that came over the line in one go, and when their first bit did."""

    at: Ns
    data: bytes


def packet(line: str | bytes, to: int = NODE, src: int = MOTHER, *, crc: bool = True) -> bytes:
    """A line as a packet of mother's."""
    return encode(to, src, line.encode("latin-1") if isinstance(line, str) else line, crc=crc)


class Bench:
    """A bus of SACs, by default one at NODE, with everything switched on as on the device.

    ``settings`` are those of all nodes that it starts with, ``memory`` is what they have stored.
    """

    def __init__(
        self,
        *addresses: int,
        lanes: int = 1,
        seed: int = 0,
        settings: SacSettings | None = None,
        kernel: Kernel | None = None,
        rate: LineRate | None = None,
        memory: Mapping[str, object] | None = None,
    ) -> None:
        self.kernel = kernel or Kernel()
        self.bus = Bus(self.kernel, KIND.protocol, rate=rate, lanes=lanes, seed=seed)
        self.nodes: dict[int, SacNode] = {}
        for address in addresses or (NODE,):
            self.add(address, settings or SacSettings(), memory)
        #: Whether bytes may come from outside, which have ended before anybody hears them.
        self.outside = False
        #: What mother's side of the line hears, in order.
        self.heard: list[Said] = []
        self.port = Port(self.bus.medium, self._take, latency=0)

    def add(
        self, address: int, settings: SacSettings, memory: Mapping[str, object] | None = None
    ) -> SacNode:
        node = KIND.create(address, settings, self.bus.rate, self.bus.tell, memory)
        self.bus.add(node)
        self.nodes[address] = node
        return node

    def _take(self, heard: Heard, now: Ns) -> None:
        ended = heard.ends(len(heard.data) - 1)
        assert now == ended or (self.outside and now > ended)
        self.heard.append(Said(heard.begins(0), heard.data))

    # ---- speaking ----

    def sends(self, data: bytes, *, at: Ns, sender: object = None) -> Transmission:
        """Bytes begin on the line at ``at``, whatever else is on it."""
        assert at >= self.kernel.now, f"too late: it is {self.kernel.now}"
        self.kernel.run_until(at)
        medium = self.bus.medium
        return medium.transmit(sender or self.port, data, medium.master_lane)

    def hears(self, line: str | bytes, *, at: Ns, to: int = NODE) -> None:
        """A line in a packet of mother's whose trigger byte ends at ``at``.

        As mother does, with a space behind it where the device would lose it or not check it.
        """
        body = line.encode("latin-1") if isinstance(line, str) else line
        while crc8(body) in (NUL, STX, ETX):
            body += b" "
        data = packet(body, to)
        self.sends(data, at=at - self.span(len(data) - 1))
        self.kernel.run_until(at)

    def span(self, count: int) -> Ns:
        """Line time of some bytes."""
        return self.bus.rate.span(count)

    def run(self) -> None:
        """Until nothing is due any more."""
        self.kernel.run()

    # ---- looking ----

    @property
    def node(self) -> SacNode:
        """The node that was put on the bench first."""
        return next(iter(self.nodes.values()))

    @property
    def answers(self) -> list[bytes]:
        """What was heard, without its times."""
        return [said.data for said in self.heard]

    def snapshot(self, at: Ns, address: int | None = None) -> Snapshot:
        """A node once the bus has run to ``at``."""
        self.kernel.run_until(at)
        return (self.node if address is None else self.nodes[address]).snapshot(at)

    def position(self, at: Ns, address: int | None = None) -> int:
        """Pulses from where the node was switched on, clockwise up."""
        return self.snapshot(at, address).position_pulses

    def pulses(self, since: Ns, until: Ns, step: Ns) -> list[int]:
        """Positions from ``since`` to ``until``, ``step`` apart."""
        return [self.position(at) for at in range(since, until + 1, step)]

    def told(self, kind: ReportKind | None = None) -> list[Report]:
        """What was reported out of band, all of it or of one kind."""
        return [report for report in self.bus.reports if kind in (None, report.kind)]

    def transcript(self) -> list[object]:
        """All that the bench can see of a run: what was said when, reported, moved, and counted."""
        now = self.kernel.now
        return [
            now,
            *self.heard,
            *self.bus.reports,
            *(node.snapshot(now) for node in self.nodes.values()),
            *(replace(self.bus.medium.counters(lane)) for lane in range(self.bus.medium.lanes)),
        ]
