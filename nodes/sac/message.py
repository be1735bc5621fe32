"""The message processor: takes a line apart and sends each part where it belongs.

Owns what a line from either port is: a command, a message for the terminal, something to be sent
on, or nothing that a SAC knows; and what a mode of the terminal makes of it. Motion goes to the
command processor, what is to be shown to the terminal, whoever asked. SAC checks nothing and says
nothing; what a line did not achieve is reported out of band.

Decisions where the manual is silent: what is sent on is printed as ``85> m3000``, as the author's
packet firmware does, whichever port it came from; text that is typed without an address goes
nowhere; in debug mode the timing is printed after typed commands that are loaded into the queue.
Source: manual, "Communications", "Queue", "xRef"; spec, "Two ports, two manners".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, assert_never

from nodes.sac import screens
from nodes.sac.command import CommandProcessor, Obeyed
from nodes.sac.queries import Query
from nodes.sac.system import Board, SystemLine, obey
from nodes.sac.terminal import TerminalPort
from sacbus.kernel import Ns
from sacbus.language import (
    Command,
    Configure,
    Edit,
    EditQueue,
    Empty,
    Forward,
    Leave,
    MapPins,
    Message,
    Mode,
    Move,
    Parsed,
    ProgramQueue,
    ProgramReferences,
    SetParameter,
    SetReference,
    ShowConfiguration,
    ShowMemory,
    ShowQueue,
    ShowReferences,
    SoftOp,
    ThrowAway,
    parse,
    parse_in,
)
from sacbus.motion import TICKS_PER_US, load_ticks
from sacbus.node import ReportKind
from sacbus.wire import GENERAL_CALL

__all__ = ["MessageProcessor"]


_SPACE: Final = 0x20

_OpensMode = ProgramQueue | ProgramReferences | Configure
_OfBothPorts = Obeyed | Query | SystemLine | Forward | Empty | SoftOp | Leave
_Entry = EditQueue | SetReference | SetParameter | MapPins
"""What is entered in a mode; the mode's screen is shown again after it."""

_SCREENS: Final[Mapping[Mode, Query]] = {
    Mode.QUEUE: ShowQueue(),
    Mode.REFERENCES: ShowReferences(),
    Mode.CONFIGURE: ShowConfiguration(),
}
"""What a mode shows when it is entered, and after every entry."""


class MessageProcessor:
    """Lines in; ``board`` is what they reach of a node."""

    __slots__ = ("_board", "_commands", "_line", "last_source")

    def __init__(self, commands: CommandProcessor, board: Board) -> None:
        self._board = board
        self._commands = commands
        #: Who sent the last packet that was not a general call; ``/`` answers there.
        self.last_source = GENERAL_CALL
        self._line = b""

    @property
    def line(self) -> str:
        """The last line that came, for reports made while it is executed."""
        return self._line.decode("latin-1")

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        """The body of a packet that was accepted at ``now``."""
        self._line = body
        if destination != GENERAL_CALL:
            self.last_source = source
        parsed = parse(body)
        command = parsed.command
        if parsed.remarks:
            self._tell_remarks(parsed)
        if b" " in body and body[0] != _SPACE:
            self._tell_of_rest(body)
        if isinstance(command, Obeyed):  # nearly all are; a union is asked type by type
            self._commands.execute(command, now)
        elif isinstance(command, Message):
            self._show_message(f"{source}:{destination}> {command.body.strip()}")
        elif isinstance(command, _OpensMode):
            self._ignored(f"{command.text()} opens a screen: that is the terminal's business alone")
        elif command is not None:
            self._obey(command, now)

    def terminal_line(self, line: bytes, terminal: TerminalPort, now: Ns) -> None:
        """A line that was typed in whatever mode the terminal is in, without its end."""
        self._line = line
        mode = terminal.mode
        parsed = parse_in(mode, line)
        command = parsed.command
        if parsed.remarks:
            self._tell_remarks(parsed)
        if b" " in line and line[0] != _SPACE:
            self._tell_of_rest(line)
        if command is None:
            return
        if isinstance(command, Message):
            self._ignored("text without an address goes nowhere: put a node's number before it")
        elif isinstance(command, _OpensMode):
            if isinstance(command, Configure):
                obey(command, self._board, now)
            terminal.mode = Mode(command.text())
            terminal.answer(_SCREENS[terminal.mode])
        elif isinstance(command, Leave):
            terminal.mode = Mode.PROMPT
        else:
            self._obey(command, now)
            if mode in _SCREENS and isinstance(command, _Entry):
                terminal.answer(_SCREENS[mode])
            if self._commands.debug:
                self._print_timing(command, terminal)

    def _obey(self, command: _OfBothPorts, now: Ns) -> None:
        """Do what a line says that means the same on both ports."""
        if isinstance(command, Obeyed):
            self._commands.execute(command, now)
        elif isinstance(command, Forward):
            self._send_on(command, now)
        elif isinstance(command, Query):
            if isinstance(command, ShowMemory):
                obey(command, self._board, now)
            self._answer(command)
        elif isinstance(command, SystemLine):
            obey(command, self._board, now)
        elif not isinstance(command, Empty | SoftOp | Leave):  # these do nothing
            assert_never(command)

    def _send_on(self, forward: Forward, now: Ns) -> None:
        to = self.last_source if forward.destination is None else forward.destination
        self._board.network.send(to, forward.rest.encode("latin-1"), now)
        terminal = self._board.terminal_port
        if terminal is not None:
            terminal.print((f"{to}> {forward.rest}",))

    def _show_message(self, text: str) -> None:
        self._board.tell(ReportKind.MESSAGE, text, self.line, 0)
        terminal = self._board.terminal_port
        if terminal is not None:
            terminal.print((text,))

    def _answer(self, query: Query) -> None:
        """It prints on the terminal alone (spec, "Two ports"); the network hears nothing."""
        terminal = self._board.terminal_port
        if terminal is None or not self._board.watched:
            self._ignored("a query is answered on the terminal only, and nobody is there")
        else:
            terminal.answer(query)

    def _print_timing(self, command: Command, terminal: TerminalPort) -> None:
        """What was loaded into the queue, and whether its ramps were named, decide on the time."""
        loaded: Move | Edit
        match command:
            case Move():
                loaded = command
            case ThrowAway(move):
                loaded = move
            case EditQueue(_, edit):
                loaded = edit
            case _:
                return
        ramps = (loaded.acc100, loaded.dec100, loaded.linear)
        load = load_ticks(ramps != (None, None, None)) // TICKS_PER_US
        terminal.print(screens.timing(len(self._line) + 1, load))

    def _ignored(self, text: str) -> None:
        self._board.tell(ReportKind.IGNORED, text, self.line, 0)

    def _tell_remarks(self, parsed: Parsed) -> None:
        kind = ReportKind.REFUSED if parsed.command is None else ReportKind.WARNING
        for remark in parsed.remarks:
            text = f"expected {remark.expected}, got {remark.got}: {remark.text}"
            self._board.tell(kind, text, self.line, remark.column)

    def _tell_of_rest(self, body: bytes) -> None:
        """A space ends a command; who wrote more than padding behind it may not know that."""
        command, _, rest = body.partition(b" ")
        if rest.strip(b" ") and not command[:1].isdigit() and command[:1] not in b"/.":
            self._board.tell(
                ReportKind.IGNORED,
                "a space ends a command: what follows it is ignored",
                self.line,
                len(command) + 1,
            )
