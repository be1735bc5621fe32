"""A bus in kernel time with real nodes, mother's transactions on it, and bad weather on demand."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from nodes.sac import KIND, SacSettings
from sacbus.bus import Bus, Port, Transmission
from sacbus.kernel import Kernel, Ns
from sacbus.mother import Acknowledged, Caller, MotherError, Sent
from sacbus.wire.times import turnaround

Outcome = Acknowledged | Sent | MotherError

#: What happens to one attempt of mother's: its bytes are out, at this moment.
Weather = Callable[["Rig", bytes], None]


class Rig:
    """Nodes at ``addresses``, and mother with no distance to the line.

    ``weather`` holds what happens to her next packets, one entry each; when it is used up, the line
    is good. Whatever disturbs is a second talker on the medium, so bytes are spoilt as on a bus.
    """

    def __init__(
        self, *addresses: int, settings: SacSettings | None = None, echo: bool = False
    ) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, KIND.protocol, seed=1)
        self.rate = self.bus.rate
        for address in addresses:
            self.bus.add(KIND.create(address, settings or SacSettings(), self.rate, self.bus.tell))
        self.port = Port(
            self.bus.medium, lambda heard, _now: self.caller.hear(heard.data), latency=0, echo=echo
        )
        self.caller = Caller(self.kernel, self._send)
        self.weather: deque[Weather | None] = deque()
        self.sent: list[bytes] = []
        #: All transmissions that are over, and those of nodes among them.
        self.line: list[Transmission] = []
        self.bus.medium.watchers.append(self.line.append)

    def _send(self, data: bytes) -> None:
        self.sent.append(data)
        self.port.talk(data)
        change = self.weather.popleft() if self.weather else None
        if change is not None:
            change(self, data)

    @property
    def answers(self) -> list[bytes]:
        return [one.data for one in self.line if one.sender in list(self.bus.nodes)]

    def interrupt(self, when: Ns, data: bytes = b"\x55") -> None:
        """Have a stranger talk, whoever else may be talking then."""
        self.kernel.at(when, lambda: self.bus.medium.transmit("stranger", data, 0))

    def call(self, node: int, line: bytes, *, accept_duplicates: bool = False) -> list[Outcome]:
        """Ask; the list will hold what became of it."""
        outcomes: list[Outcome] = []
        self.caller.call(node, line, outcomes.append, accept_duplicates=accept_duplicates)
        return outcomes

    def ask(self, node: int, line: bytes, *, accept_duplicates: bool = False) -> Outcome:
        """Ask, and run until all is quiet, motors included."""
        outcomes = self.call(node, line, accept_duplicates=accept_duplicates)
        self.kernel.run()
        (outcome,) = outcomes
        return outcome

    def steps(self, address: int) -> float:
        return self.bus.node(address).snapshot(self.kernel.now).position_steps

    def expect(self, weather: Iterable[Weather | None]) -> None:
        self.weather.extend(weather)


def body_spoilt(rig: Rig, data: bytes) -> None:
    """A byte of the body arrives as another: the node says NAK."""
    rig.interrupt(rig.kernel.now + rig.rate.span(4))


def packet_lost(rig: Rig, data: bytes) -> None:
    """The STX arrives as another byte: for the node there was no packet."""
    rig.interrupt(rig.kernel.now)


def answer_lost(rig: Rig, data: bytes) -> None:
    """The node has the packet and answers, but the answer's STX does not come through."""
    end = rig.kernel.now + rig.rate.span(len(data))
    rig.interrupt(end + turnaround(len(data) - 6, nul_follows=True))
