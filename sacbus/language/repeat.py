"""Which lines may reach a node twice without harm.

Owns mother's list. SAC has no sequence numbers, so a lost ACK leaves open whether a command was
obeyed; sending again is safe only for what does the same the second time. The list is a list of
leave: whatever is not on it, unknown lines too, may not be repeated.
Source: spec, "Mother", Transactions.
"""

from __future__ import annotations

from typing import Final

from .commands import (
    Acceleration,
    ClearQueue,
    Deceleration,
    EditQueue,
    Empty,
    LoopCount,
    LoopFinish,
    LoopStart,
    MapPins,
    Ramp,
    ReleaseSync,
    RestoreQueue,
    SaveQueue,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    ShowVelocity,
    StepMode,
    Stop,
    Velocity,
)
from .grammar import parse

__all__ = ["repeatable"]

_REPEATABLE: Final = (
    EditQueue,
    SaveQueue,
    RestoreQueue,
    ClearQueue,
    Velocity,
    ShowVelocity,
    Acceleration,
    Deceleration,
    SetParameter,
    MapPins,
    SendCrcs,
    SendAcks,
    Ramp,
    SendSoftOps,
    StepMode,
    Stop,
    ReleaseSync,
    LoopStart,
    LoopFinish,
    LoopCount,
    Empty,
)
"""In the order of the spec, and the empty line with which mother scans."""


def repeatable(line: bytes) -> bool:
    """Whether a node that gets this line twice ends up as if it came once.

    line: a packet's body. The empty body, with which mother scans, is repeatable as well.
    """
    return isinstance(parse(line).command, _REPEATABLE)
