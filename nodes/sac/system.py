"""The system commands of a SAC, and the saving of its queue: all that reaches the EEPROM.

Owns what each ``$`` command does to the session or to the memory, and QS and QR. A parameter is
written to the EEPROM at once and obeyed after the next boot; the settings of the session are obeyed
at once and gone after it. Every ``$`` command ends all motion first, also one that only shows
something, which is the terminal's business then. Port and terminal alike may give them.
Source: manual, "System Commands", "Configure", "Miscellaneous", Appendix C; spec, commands.
"""

from __future__ import annotations

from typing import Protocol, assert_never

from nodes.sac.command import CommandProcessor
from nodes.sac.memory import Memory
from nodes.sac.network import NetworkPort
from nodes.sac.terminal import TerminalPort
from sacbus.kernel import Ns
from sacbus.language import (
    QUEUE_LENGTH,
    Configure,
    MapPins,
    Ramp,
    Reboot,
    RestoreQueue,
    SaveQueue,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    ShowMemory,
    StepMode,
    Stop,
    SystemCommand,
    ToggleEncoder,
    ToggleStepMode,
    seeded_row,
)
from sacbus.node import ReportKind

__all__ = ["Board", "SystemLine", "obey"]

#: What is obeyed here.
SystemLine = SystemCommand | SaveQueue | RestoreQueue


class Board(Protocol):
    """What lines reach of a node."""

    #: Whether the encoder turns the speed of continuous motion (EnT), or steps the motor (EnF).
    throttles: bool

    @property
    def commands(self) -> CommandProcessor:
        """Its command processor."""
        ...

    @property
    def network(self) -> NetworkPort:
        """Its network port."""
        ...

    @property
    def terminal_port(self) -> TerminalPort | None:
        """Its terminal; None as long as nobody has asked for it."""
        ...

    @property
    def watched(self) -> bool:
        """Whether anybody is at the far end of its terminal."""
        ...

    @property
    def eeprom(self) -> Memory:
        """What its EEPROM holds now; obeyed after the next boot."""
        ...

    def write(self, memory: Memory) -> None:
        """Put this into the EEPROM."""
        ...

    def send_soft_ops(self, *, on: bool) -> None:
        """Tell the network of the starts and ends of commands, or no longer."""
        ...

    def reboot(self, now: Ns) -> None:
        """A warm boot."""
        ...

    def tell(self, kind: ReportKind, text: str, line: str = "", column: int = 0) -> None:
        """Something worth a report, about a line or none, and where in it (0: the whole)."""
        ...


def obey(line: SystemLine, board: Board, now: Ns) -> None:
    """Do what a system command, QS or QR says, at ``now``."""
    match line:
        case SaveQueue():
            board.write(board.eeprom.with_queue(board.commands.queue.rows()))
        case RestoreQueue():
            # The last snapshot, says the manual's text, the system defaults, says its Appendix C:
            # both, in this order (decision).
            commands = board.commands
            seeded = (seeded_row(commands.session.defaults),) * QUEUE_LENGTH
            commands.queue.load(board.eeprom.queue or seeded)
        case _:
            board.commands.execute(Stop(grace=False), now)
            _obey_system(line, board, now)


def _obey_system(command: SystemCommand, board: Board, now: Ns) -> None:
    commands = board.commands
    session = commands.session
    match command:
        case SetParameter(parameter, value):
            board.write(board.eeprom.with_values({parameter: value}))
        case MapPins(exponent, pins):
            board.write(board.eeprom.with_pins(exponent, pins))
        case StepMode(full_step):
            commands.session = session.with_full_step(full_step=full_step)
        case ToggleStepMode():
            commands.session = session.with_full_step(full_step=not session.full_step)
        case SendCrcs(on):
            board.network.crc = on
        case SendAcks(on):
            board.network.ack = on
        case Ramp(linear):
            commands.session = session.with_ramp(linear=linear)
        case ToggleEncoder():
            board.throttles = not board.throttles
        case SendSoftOps(on):
            board.send_soft_ops(on=on)
        case Reboot():
            board.reboot(now)
        case Configure() | ShowMemory():
            pass  # a screen: the terminal shows it
        case _:
            assert_never(command)
