"""The watchdog: nodes that move are stopped when the link of who talked to them goes away.

Owns when that is, and what is done then. Which nodes can be stopped, and how, their kinds know
(``sacbus.node.Node.stop``); it is not said over the line, which may be the thing that is broken,
and on which real nodes may hang that are not ours to stop.

A program that has only listened may come and go. One that has talked is taken to be a master, and a
master that goes leaves machines moving that nobody minds: whatever of its words is still to be sent
is dropped, and all nodes are stopped, at once, and again when what was on the line is over: the
last packet may have set something moving.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.bus import Bus, LivePort, Port
from sacbus.host import Host
from sacbus.kernel import MS, Ns
from sacbus.links import Link
from sacbus.node import BOOT, OFF, STANDBY, Node

__all__ = ["Watchdog"]

#: The states of a node that moves nothing, and holds no command that would.
AT_REST: Final = frozenset((STANDBY, BOOT, OFF))

#: How long after the end of a packet a node has surely acted on it: at once, by the byte.
ACTED: Final[Ns] = 1 * MS

#: Addresses that a report names.
TOLD: Final = 10


class Watchdog:
    """Minds the links of one bus; ``tell`` is given a line for people when nodes were stopped."""

    def __init__(self, bus: Bus, host: Host, tell: Callable[[str], object]) -> None:
        self._bus = bus
        self._host = host
        self._tell = tell
        self._ended = False

    def end(self) -> None:
        """Mind nothing any more: the bus is taken down, and nobody is to blame."""
        self._ended = True

    def minds(self, link: Link, port: Port | LivePort) -> Callable[[], None]:
        """What is to be called each time that the programs of ``link`` have left, or it is lost."""
        heard = 0

        def left() -> None:
            nonlocal heard
            before, heard = heard, link.counters.bytes_in
            if heard == before or self._ended:
                return  # whoever it was has only listened
            if isinstance(port, Port):
                port.drop()
            self._host.arrive(self._left, link.where)

        return left

    def _left(self, where: str) -> None:
        kernel, medium = self._bus.kernel, self._bus.medium
        self._stop(where)
        free_at = medium.free_at(medium.master_lane)
        if free_at is not None and free_at > kernel.now - ACTED:
            kernel.at(free_at + ACTED, self._stop, where)

    def _stop(self, where: str) -> None:
        now = self._bus.kernel.now
        stopped = []
        # All of them: what a node keeps, until a pin is let go, may not be seen from outside.
        for node in self._bus.nodes:
            if node.state(now) not in AT_REST:
                stopped.append(node)
            node.stop(now)
            self._bus.touch(node)
        if stopped:
            self._tell(f"watchdog: {where} is gone, stopped {_named(stopped)}")


def _named(nodes: list[Node]) -> str:
    shown = ", ".join(str(node.address) for node in nodes[:TOLD])
    more = f" and {len(nodes) - TOLD} more" if len(nodes) > TOLD else ""
    return f"{'node' if len(nodes) == 1 else 'nodes'} {shown}{more}"
