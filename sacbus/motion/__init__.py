"""Motion: from a command to the exact time of every pulse.

Owns profiles and everything that is counted in ticks (0.5 us of a node's own oscillator). Imports
only the command types of `language`, and numpy; no asyncio, no clock, no bytes.
"""

from sacbus.motion.drive import NO_RAMP, TICKS_PER_US, Drive, PullOut, Rpm
from sacbus.motion.gap import gap_passes, load_ticks
from sacbus.motion.legs import State
from sacbus.motion.limits import Caution, Limit
from sacbus.motion.motor import Entry, Slip, lost, slips
from sacbus.motion.planner import plan
from sacbus.motion.profile import Profile
from sacbus.motion.sequence import REST, Beginning, Left, begin, release
from sacbus.motion.timebase import FACTORY_XFREQ, Timebase
from sacbus.motion.transition import transition_warnings

__all__ = [
    "FACTORY_XFREQ",
    "NO_RAMP",
    "REST",
    "TICKS_PER_US",
    "Beginning",
    "Caution",
    "Drive",
    "Entry",
    "Left",
    "Limit",
    "Profile",
    "PullOut",
    "Rpm",
    "Slip",
    "State",
    "Timebase",
    "begin",
    "gap_passes",
    "load_ticks",
    "lost",
    "plan",
    "release",
    "slips",
    "transition_warnings",
]
