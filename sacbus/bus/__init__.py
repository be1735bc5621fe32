"""The line itself: transmissions, collisions, nodes and ports. Synchronous, in kernel time."""

from sacbus.bus.bus import Bus
from sacbus.bus.live_port import LivePort
from sacbus.bus.medium import LaneCounters, Listener, Medium
from sacbus.bus.port import FULL, LATENCY, PLAIN_BITS, Port
from sacbus.bus.transmission import Transmission

__all__ = [
    "FULL",
    "LATENCY",
    "PLAIN_BITS",
    "Bus",
    "LaneCounters",
    "Listener",
    "LivePort",
    "Medium",
    "Port",
    "Transmission",
]
