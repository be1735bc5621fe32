"""A node as a test sees it: what it does now, and what can be done to it.

Owns how a node reads in the text of a failure. Positions in full steps, clockwise up; velocities in
RPM; times in ns of bus time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sacbus.kernel import Ns
from sacbus.mother import Acknowledged
from sacbus.node import Snapshot
from sacbus.panel import Panel

if TYPE_CHECKING:
    from sacbus.testing.bus import VirtualBus
    from sacbus.trace import Track

__all__ = ["VirtualNode", "state_words"]


class VirtualNode:
    """The node that is configured at ``address``, whatever it is called by now.

    ::

        node = bus.node(10)
        node.send("m400v120")
        bus.until(lambda: node.state == "STANDBY", within="5 s")
        assert node.position == 400
    """

    def __init__(self, bus: VirtualBus, address: int, panel: Panel) -> None:
        self.address = address
        self.panel = panel
        self._bus = bus

    @property
    def snapshot(self) -> Snapshot:
        """All that can be seen of it now."""
        return self.panel.snapshot()

    @property
    def position(self) -> float:
        """Where it stands now, in full steps from where it was switched on."""
        return self.snapshot.position_steps

    @property
    def pulses(self) -> int:
        """The same, in pulses."""
        return self.snapshot.position_pulses

    @property
    def velocity(self) -> float:
        """Its velocity now, in RPM."""
        return self.snapshot.rpm

    @property
    def state(self) -> str:
        """STANDBY, ACCEL, CRUISE, DECEL, STOP, SYNC, BOOT or OFF."""
        return self.snapshot.state

    @property
    def track(self) -> Track:
        """Where it has been until now: ``pulses(since, until)`` are times in ns of bus time."""
        return self._bus.track(self.address)

    def send(self, line: str, *, accept_duplicates: bool = False) -> Acknowledged:
        """As ``VirtualBus.send``."""
        return self._bus.send(self.address, line, accept_duplicates=accept_duplicates)

    def level(self, pin: str) -> int:
        """The level of a pin now; xclk: Hz. PinError when it has no such pin."""
        return self.panel.level(pin)

    def drive(self, pin: str, level: int) -> None:
        """Drive an input to a level; xclk: to a frequency in Hz. PinError for what is no input."""
        self.panel.drive(pin, level)

    def edges(self, pin: str) -> list[tuple[Ns, int]]:
        """A list that gets each edge of an output from now on: when, in ns, and to which level."""
        found: list[tuple[Ns, int]] = []

        def edge(named: str, level: int, when: Ns) -> None:
            if named == pin:
                found.append((when, level))

        self.panel.level(pin)  # refuses a pin that is not there
        self.panel.watch(edge)
        return found

    def turn(self, detents: int) -> None:
        """Turn its encoder, clockwise positive."""
        self.panel.turn(detents)

    def power(self, *, on: bool) -> None:
        """Switch it off, or on again for a cold boot."""
        self.panel.power(on=on)

    def type(self, keys: str) -> str:
        """Type at its terminal, CR ends a line; what it has shown since the last time."""
        console = self.panel.console
        if console is None:
            raise LookupError(f"node {self.address} has no terminal port")
        console.listen()
        console.type(keys)
        return console.read()

    def __repr__(self) -> str:
        return f"<{state_words(self.address, self.snapshot)}, at {self._bus.instant}>"


def state_words(address: int, seen: Snapshot) -> str:
    """``node 10: CRUISE at 200, 120 RPM, m400v120``."""
    now_called = "" if seen.address == address else f" (now {seen.address})"
    command = f", {seen.current}" if seen.current else ""
    where = f"{seen.state} at {seen.position_steps:g}, {seen.rpm:g} RPM"
    return f"node {address}{now_called}: {where}{command}"
