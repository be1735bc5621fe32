"""The message processor: takes a line apart and sends each part where it belongs.

Owns what a line from the network is: a command, a message for the terminal, something to be sent
on, or nothing that a SAC knows. Motion goes to the command processor. SAC checks nothing and says
nothing; what a line did not achieve is reported out of band.
Source: manual, "Communications"; spec, "Two ports, two manners".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from nodes.sac.command import CommandProcessor, Obeyed
from sacbus.kernel import Ns
from sacbus.language import (
    Empty,
    Forward,
    Message,
    Move,
    Parsed,
    ShowVelocity,
    SoftOp,
    describe,
    parse,
)
from sacbus.node import ReportKind
from sacbus.wire import GENERAL_CALL

__all__ = ["MessageProcessor"]


_SPACE: Final = 0x20


class MessageProcessor:
    """Lines in. ``send(dest, body, not_before)`` sends a line on; ``tell`` takes reports."""

    __slots__ = ("_commands", "_last_source", "_line", "_send", "_tell")

    def __init__(
        self,
        commands: CommandProcessor,
        send: Callable[[int, bytes, Ns], Ns],
        tell: Callable[[ReportKind, str, str, int], None],
    ) -> None:
        self._commands = commands
        self._send = send
        self._tell = tell
        #: Who sent the last packet that was not a general call; ``/`` answers there.
        self._last_source = GENERAL_CALL
        self._line = b""

    @property
    def line(self) -> str:
        """The last line that came, for reports made while it is executed."""
        return self._line.decode("latin-1")

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        """The body of a packet that was accepted at ``now``."""
        self._line = body
        if destination != GENERAL_CALL:
            self._last_source = source
        parsed = parse(body)
        command = parsed.command
        if parsed.remarks:
            self._tell_remarks(parsed)
        if b" " in body and body[0] != _SPACE:
            self._tell_of_rest(body)
        if type(command) is Move:  # nearly all are, and this is much quicker than a match
            self._commands.execute(command, now)
            return
        match command:
            case None | Empty() | SoftOp():
                pass
            case Forward(onward, rest):
                self._send(
                    self._last_source if onward is None else onward, rest.encode("latin-1"), now
                )
            case Message(text):
                self._tell(
                    ReportKind.MESSAGE, f"{source}:{destination}> {text.strip()}", self.line, 0
                )
            case ShowVelocity():
                # It prints on the terminal alone (spec, "Two ports"); the network hears nothing.
                self._tell(
                    ReportKind.IGNORED, "a query is answered on the terminal only", self.line, 0
                )
            case _ if isinstance(command, Obeyed):
                self._commands.execute(command, now)
            case _:
                text = f"not obeyed by this version: {describe(command)}"
                self._tell(ReportKind.REFUSED, text, self.line, 1)

    def _tell_remarks(self, parsed: Parsed) -> None:
        kind = ReportKind.REFUSED if parsed.command is None else ReportKind.WARNING
        for remark in parsed.remarks:
            text = f"expected {remark.expected}, got {remark.got}: {remark.text}"
            self._tell(kind, text, self.line, remark.column)

    def _tell_of_rest(self, body: bytes) -> None:
        """A space ends a command; who wrote more than padding behind it may not know that."""
        command, _, rest = body.partition(b" ")
        if rest.strip(b" ") and not command[:1].isdigit() and command[:1] not in b"/.":
            self._tell(
                ReportKind.IGNORED,
                "a space ends a command: what follows it is ignored",
                self.line,
                len(command) + 1,
            )
