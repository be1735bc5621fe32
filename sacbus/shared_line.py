"""A wire that goes to the same pin of several nodes: a shared sync line, a common clock.

Owns that all of them see an edge in the same instant of bus time, in real time too. What a pin does
is the node's affair.
Source: manual, "SAC in a multi-axis environment", "sync"; spec, mother ("Groups").
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from sacbus.host import Host
from sacbus.panel import Panel

__all__ = ["SharedLine"]


class SharedLine:
    """One pin of several nodes, joined by a wire.

    ::

        sync = bus.shared_line("sync", [10, 11])
        sync.pull()                                  # what they hold starts, in the same instant
        bus.shared_line("xclk", [10, 11]).drive(1_000_000)   # they count the same clock
    """

    def __init__(self, pin: str, panels: Iterable[Panel], host: Host) -> None:
        """PinError, by :meth:`drive`, for a pin that a node does not have."""
        self.pin: Final = pin
        self._panels = tuple(panels)
        self._host = host

    def drive(self, level: int) -> None:
        """Drive it to a level now; xclk: to a frequency in Hz. PinError for what is no input."""
        for panel in self._panels:
            panel.check(self.pin, level)
        self._host.arrive(self._drive, level)

    def pull(self) -> None:
        """Pull it low and let go: an edge, as which a release by sync is given."""
        self.drive(0)
        self.drive(1)

    def _drive(self, level: int) -> None:
        # Within one arrival bus time stands still, so no node is later than another.
        for panel in self._panels:
            panel.drive(self.pin, level)
