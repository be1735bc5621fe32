"""A bus in kernel time that a monitor's core looks on at, as through its feed."""

from __future__ import annotations

from nodes.sac import KIND, SacSettings
from sacbus.bus import Bus, Port
from sacbus.feed.server import sent_line
from sacbus.kernel import MS, Kernel, Ns
from sacbus.watch.entries import Collision, Entry, Reported, Spoken, Unanswered
from sacbus.watch.watch import Watch
from sacbus.wire import encode

__all__ = ["LINK", "M400", "Rig", "told"]

#: The name of the port at which the program talks.
LINK = "/run/sac"

M400 = encode(10, 1, b"m400")


class Rig:
    """Nodes at ``addresses``, a program at a port, and all that the monitor tells of them."""

    def __init__(self, *addresses: int, lanes: int = 1) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, KIND.protocol, lanes=lanes)
        for address in addresses:
            self.bus.add(KIND.create(address, SacSettings(), self.bus.rate, self.bus.tell))
        self.port = Port(self.bus.medium, lambda _heard, _now: None, latency=0, name=LINK)
        self.watch = Watch(KIND.protocol, self.bus.rate, lanes=lanes)
        self.entries: list[Entry] = []
        self.bus.medium.watchers.append(
            lambda sent: self.entries.extend(self.watch.sent(sent_line(sent, self.bus)))
        )
        self.bus.report_watchers.append(
            lambda report: self.entries.extend(self.watch.reported(report))
        )

    def says(self, data: bytes, at: Ns) -> None:
        """The program writes at that time."""
        self.kernel.at(at, self.port.talk, data)

    def stranger_says(self, data: bytes, at: Ns) -> None:
        """Somebody talks at that time, whoever else does."""
        self.kernel.at(at, self.bus.medium.transmit, "stranger", data, 0)

    def run(self, until: Ns = 100 * MS) -> list[Entry]:
        """Let it all happen, and time be known to have come so far."""
        self.kernel.run_until(until)
        self.entries += self.watch.wake(until)
        return self.entries


def told(entries: list[Entry]) -> list[str]:
    """Each entry in a word or two, for looking at what comes in which order."""
    return [_told(entry) for entry in entries]


def _told(entry: Entry) -> str:
    match entry:
        case Spoken(said=said):
            way = "" if said.source is None else f" {said.source}>{said.destination}"
            return f"{said.kind}{way}"
        case Unanswered(request=request):
            return f"no answer {request.said.source}>{request.said.destination}"
        case Collision(parts=parts):
            return "collision " + " ".join(part.sender for part in parts)
        case Reported(report):
            return f"report {report.address}"
        case _:
            return type(entry).__name__
