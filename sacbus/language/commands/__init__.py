"""The SAC commands as values: what a line says, before any default is filled in.

Owns the types and how each prints back in the manual's shortest form, a file for each noun. Knows
no grammar (that is ``grammar.py``), no session, no bytes. Imports nothing of the project.

Two rules for whoever edits this package: a field that is ``None`` was not given on the line, which
is not the same as zero; and ``parse(command.text())`` gives the command back, whatever its fields.
What is typed in a mode of the terminal has an ``entry()`` besides, its text in that mode.
Source: manual, "Command Detail" and Appendix C; spec, commands.
"""

from __future__ import annotations

from .loops import (
    MAX_LOOPS,
    MAX_REFERENCE,
    EndLoop,
    LoopCommand,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    ProgramReferences,
    RunPosition,
    RunReferences,
    SetReference,
    ShowReferences,
)
from .modes import Leave, Mode
from .motion import Edit, Move, ThrowAway
from .operation import (
    OperationCommand,
    ShowConfiguration,
    ShowSession,
    ToggleDebug,
    ToggleGap,
    Undo,
)
from .parameters import Beyond, Parameter
from .quantities import BARE, NO_RAMP, Bare
from .queue import (
    QUEUE_LENGTH,
    ClearQueue,
    EditQueue,
    ProgramQueue,
    QueueCommand,
    RestoreQueue,
    SaveQueue,
    ShowQueue,
)
from .system import (
    Configure,
    MapPins,
    Ramp,
    Reboot,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    ShowMemory,
    StepMode,
    SystemCommand,
    ToggleEncoder,
    ToggleStepMode,
)
from .traffic import Empty, Forward, Message, SoftOp, TrafficCommand
from .unary import (
    Acceleration,
    Deceleration,
    Next,
    ReleaseSync,
    ShowVelocity,
    SinglePulses,
    Stop,
    UnaryCommand,
    Velocity,
)

__all__ = [
    "BARE",
    "MAX_LOOPS",
    "MAX_REFERENCE",
    "NO_RAMP",
    "QUEUE_LENGTH",
    "Acceleration",
    "Bare",
    "Beyond",
    "ClearQueue",
    "Command",
    "Configure",
    "Deceleration",
    "Edit",
    "EditQueue",
    "Empty",
    "EndLoop",
    "Forward",
    "Leave",
    "LoopCommand",
    "LoopCount",
    "LoopFinish",
    "LoopQueue",
    "LoopStart",
    "MapPins",
    "Message",
    "Mode",
    "Move",
    "Next",
    "OperationCommand",
    "Parameter",
    "ProgramQueue",
    "ProgramReferences",
    "QueueCommand",
    "Ramp",
    "Reboot",
    "ReleaseSync",
    "RestoreQueue",
    "RunPosition",
    "RunReferences",
    "SaveQueue",
    "SendAcks",
    "SendCrcs",
    "SendSoftOps",
    "SetParameter",
    "SetReference",
    "ShowConfiguration",
    "ShowMemory",
    "ShowQueue",
    "ShowReferences",
    "ShowSession",
    "ShowVelocity",
    "SinglePulses",
    "SoftOp",
    "StepMode",
    "Stop",
    "SystemCommand",
    "ThrowAway",
    "ToggleDebug",
    "ToggleEncoder",
    "ToggleGap",
    "ToggleStepMode",
    "TrafficCommand",
    "UnaryCommand",
    "Undo",
    "Velocity",
]

Command = (
    Move
    | ThrowAway
    | UnaryCommand
    | QueueCommand
    | LoopCommand
    | OperationCommand
    | SystemCommand
    | TrafficCommand
    | Leave
)
"""Every command of a SAC; ``match`` on it ends in ``assert_never``.

The unions it is made of can be asked for with ``isinstance``. :class:`Leave` comes from a mode of a
terminal alone.
"""
