"""The two physical ports of a SAC, and what they are used for.

Owns the exchange of their roles. The line of the bus is wired to the software port, and that is the
network's; the terminal is on the hardware port, the one that an outside program opens. With the
parameter ``network`` at 1 it is the other way round from the next boot on: packets are spoken on
the hardware port, and the line has a dumb terminal on it, which takes whatever is said there for
typed lines, and echoes it. That node is lost to the bus until the parameter is 0 again: by packets
through the hardware port, or by a factory restore (manual, "network": "bricked").

Decisions: the wires stay where they are; the far end of the hardware port has the right rate
always, since a pty or a socket has none that it must have.
Source: manual, "Communications", "network"; spec, "Two ports, two manners".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from nodes.sac.network import NetworkPort
from sacbus.kernel import LineRate, Ns
from sacbus.node import Heard

__all__ = ["Exchanged", "HardwarePort", "understand"]

#: Per cent that two rates may differ: a receiver that samples in the middle of the last bit of ten
#: is wrong beyond 5 %, and half of that is what data sheets leave to each side.
TOLERANCE: Final = 2.5


def understand(baud: int, other: int) -> bool:
    """Whether two ends of a line at these rates read each other's bytes."""
    return abs(baud - other) * 100 <= TOLERANCE * other


class _Keyed(Protocol):
    """The node behind the hardware port."""

    def hardware_keys(self, keys: bytes, now: Ns) -> None:
        """Bytes arrive there."""
        ...


class HardwarePort:
    """The hardware port of a node, in the shape of ``sacbus.node.Terminal``."""

    __slots__ = ("_node", "show")

    def __init__(self, node: _Keyed) -> None:
        self._node = node
        #: Takes what the port sends, at once; None while nobody is connected: then it is lost.
        self.show: Callable[[bytes], None] | None = None

    def type(self, keys: bytes, now: Ns) -> None:
        """Bytes arrive. The owner asks the bus to touch the node afterwards (``Bus.touch``)."""
        self._node.hardware_keys(keys, now)


class Exchanged:
    """The exchange while it lasts: packets on the hardware port, a terminal on the line."""

    __slots__ = ("_free", "_line", "_network", "_rate", "_to_line", "hears")

    def __init__(
        self, network: NetworkPort, rate: LineRate, line: LineRate, *, hears: bool
    ) -> None:
        self._network = network
        self._line = line
        #: Whether its terminal is at the line's rate; else it hears nothing, and nobody hears it.
        self.hears = hears
        #: Of the hardware port.
        self._rate = rate
        #: What the terminal has to say on the line, and when it may: not into what it hears.
        self._to_line = bytearray()
        self._free: Ns = 0

    @property
    def due(self) -> Ns | None:
        """When the terminal has something to say on the line; None: it has not."""
        return self._free if self._to_line else None

    def print(self, text: bytes) -> None:
        """What the terminal prints is for the line."""
        if self.hears:
            self._to_line += text

    def keys(self, heard: Heard) -> bytes:
        """What the terminal hears of the line. It answers when whoever talks there has finished."""
        if not self.hears:
            return b""
        data = heard.data
        self._free = max(self._free, heard.ends(len(data) + len(heard.following) - 1))
        return data

    def hear(self, keys: bytes, now: Ns) -> None:
        """Bytes at the hardware port: packets. The last of them has just ended."""
        begun = now - self._rate.span(len(keys))
        self._network.hear(Heard(keys, begun, 0, self._rate, b""))

    def say(self, now: Ns) -> bytes | None:
        """What the terminal says on the line now, if it is time: all that there is."""
        if not self._to_line or now < self._free:
            return None
        said = bytes(self._to_line)
        self._to_line.clear()
        self._free = now + self._line.span(len(said))
        return said
