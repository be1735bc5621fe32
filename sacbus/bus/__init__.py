"""The line itself: transmissions, collisions, faults, nodes, ports. Synchronous, in kernel time."""

from sacbus.bus.around import Listener
from sacbus.bus.bus import Bus, NoSuchNode
from sacbus.bus.damage import BitErrors, Delay, Drop, Duplicate, SwappedReply
from sacbus.bus.disturbers import Babble, NoiseBursts
from sacbus.bus.fault import Fault, FaultError, FaultOn
from sacbus.bus.faults import FAULTS, fault_from
from sacbus.bus.hearing import Cut, Dead, Echo, LateDirection, Latency, WrongBaud
from sacbus.bus.live_port import LivePort
from sacbus.bus.medium import LaneCounters, Medium
from sacbus.bus.passage import EVERY_LINK, Passage
from sacbus.bus.port import FULL, LATENCY, Port
from sacbus.bus.transmission import Transmission
from sacbus.kernel import NINE_BITS

__all__ = [
    "EVERY_LINK",
    "FAULTS",
    "FULL",
    "LATENCY",
    "NINE_BITS",
    "Babble",
    "BitErrors",
    "Bus",
    "Cut",
    "Dead",
    "Delay",
    "Drop",
    "Duplicate",
    "Echo",
    "Fault",
    "FaultError",
    "FaultOn",
    "LaneCounters",
    "LateDirection",
    "Latency",
    "Listener",
    "LivePort",
    "Medium",
    "NoSuchNode",
    "NoiseBursts",
    "Passage",
    "Port",
    "SwappedReply",
    "Transmission",
    "WrongBaud",
    "fault_from",
]
