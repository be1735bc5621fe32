"""The SAC command language: text to typed commands, and back.

One grammar for nodes, plan, monitor, mother and dissector. Imports nothing of the project, no
asyncio, no clock, no logging; nothing here raises for what stands on a line.
"""

from .commands import (
    BARE,
    NO_RAMP,
    Acceleration,
    Bare,
    Command,
    Deceleration,
    Empty,
    Forward,
    Message,
    Move,
    Next,
    ReleaseSync,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    Stop,
    Velocity,
)
from .describe import describe
from .grammar import Parsed, parse
from .line import Remark
from .repeat import repeatable
from .session import Defaults, Motion, Session

__all__ = [
    "BARE",
    "NO_RAMP",
    "Acceleration",
    "Bare",
    "Command",
    "Deceleration",
    "Defaults",
    "Empty",
    "Forward",
    "Message",
    "Motion",
    "Move",
    "Next",
    "Parsed",
    "ReleaseSync",
    "Remark",
    "Session",
    "ShowVelocity",
    "SinglePulses",
    "SoftOp",
    "Stop",
    "Velocity",
    "describe",
    "parse",
    "repeatable",
]
