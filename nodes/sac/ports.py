"""The two physical ports of a SAC, and what they are used for.

Owns the terminal's part of a node, once somebody asks for it, and the exchange of the two roles.
The line of the bus is wired to the software port, and that is the network's; the terminal is on the
hardware port, the one that an outside program opens. With the parameter ``network`` at 1 it is the
other way round from the next boot on: packets are spoken on the hardware port, and the line has a
dumb terminal on it, which takes whatever is said there for typed lines, and echoes it. That node is
lost to the bus until the parameter is 0 again: by packets through the hardware port, or by a
factory restore (manual, "network": "bricked").

Decisions: the wires stay where they are; the far end of the hardware port has the right rate
always, since a pty or a socket has none that it must have.
Source: manual, "Communications", "network"; spec, "Two ports, two manners".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from nodes.sac.terminal import TerminalOwner, TerminalPort
from sacbus.kernel import LineRate, Ns
from sacbus.node import Heard

__all__ = ["HardwarePort", "PortUser", "Ports", "understand"]

#: Per cent that two rates may differ: a receiver that samples in the middle of the last bit of ten
#: is wrong beyond 5 %, and half of that is what data sheets leave to each side.
TOLERANCE: Final = 2.5


def understand(baud: int, other: int) -> bool:
    """Whether two ends of a line at these rates read each other's bytes."""
    return abs(baud - other) * 100 <= TOLERANCE * other


class PortUser(TerminalOwner, Protocol):
    """The node behind the ports."""

    def hardware_keys(self, keys: bytes, now: Ns) -> None:
        """Bytes arrive at the hardware port."""
        ...


class HardwarePort:
    """The hardware port of a node, in the shape of ``sacbus.node.Terminal``."""

    __slots__ = ("_node", "show")

    def __init__(self, node: PortUser) -> None:
        self._node = node
        #: Takes what the port sends, at once; None while nobody is connected: then it is lost.
        self.show: Callable[[bytes], None] | None = None

    def type(self, keys: bytes, now: Ns) -> None:
        """Bytes arrive. The owner asks the bus to touch the node afterwards (``Bus.touch``)."""
        self._node.hardware_keys(keys, now)


class _Exchanged:
    """The exchange while it lasts: packets on the hardware port, a terminal on the line."""

    __slots__ = ("_free", "_line", "_to_line", "hears", "rate")

    def __init__(self, line: LineRate) -> None:
        self._line = line
        #: Of the hardware port.
        self.rate = line
        #: Whether its terminal is at the line's rate; else it hears nothing, and nobody hears it.
        self.hears = True
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

    def say(self, now: Ns) -> bytes | None:
        """What the terminal says on the line now, if it is time: all that there is."""
        if not self._to_line or now < self._free:
            return None
        said = bytes(self._to_line)
        self._to_line.clear()
        self._free = now + self._line.span(len(said))
        return said


class Ports:
    """The hardware port and the terminal of a node, and which of its ports has which role."""

    __slots__ = ("_exchanged", "hardware", "terminal")

    def __init__(self, node: PortUser) -> None:
        self.hardware = HardwarePort(node)
        self.terminal = TerminalPort(node)
        #: While the two ports have each other's role.
        self._exchanged: _Exchanged | None = None

    @property
    def exchanged(self) -> bool:
        """Whether the terminal is on the line, and the network on the hardware port."""
        return self._exchanged is not None

    @property
    def watched(self) -> bool:
        """Whether anybody is at the far end of the terminal."""
        if self._exchanged is not None:
            return self._exchanged.hears
        return self.hardware.show is not None

    def exchange(self, rate: LineRate, line: LineRate, *, hears: bool) -> None:
        """Put the network on the hardware port, at ``rate``, and the terminal on the line.

        ``hears``: the terminal is at the line's rate.
        """
        self.terminal.flush()
        if self._exchanged is None:
            self._exchanged = _Exchanged(line)
        self._exchanged.rate = rate
        self._exchanged.hears = hears

    def put_back(self) -> None:
        """Each port has its own role."""
        self.terminal.flush()
        self._exchanged = None

    def due(self, network: Ns | None) -> Ns | None:
        """When something is to be said at either port, if the network's part is due then."""
        says = None if self._exchanged is None else self._exchanged.due
        if says is None or network is None:
            return network if says is None else says
        return min(network, says)

    def keys(self, heard: Heard) -> bytes | None:
        """What of the line is for the terminal; None: the line is the network's."""
        return None if self._exchanged is None else self._exchanged.keys(heard)

    def packets(self, keys: bytes, now: Ns) -> Heard | None:
        """What came to the hardware port, as the network hears it; None: it is the terminal's.

        The last of it has just ended.
        """
        if self._exchanged is None:
            return None
        rate = self._exchanged.rate
        return Heard(keys, now - rate.span(len(keys)), 0, rate, b"")

    def say(self, network: bytes | None, now: Ns) -> bytes | None:
        """What goes out on the line now; ``network`` is what the network says."""
        if self._exchanged is None:
            return network
        if network and self.hardware.show is not None:
            self.hardware.show(network)
        return self._exchanged.say(now)

    def show(self, text: bytes) -> None:
        """What the terminal prints goes to its far end, if there is one."""
        if self._exchanged is not None:
            self._exchanged.print(text)
        elif self.hardware.show is not None:
            self.hardware.show(text)
