"""The terminal port of a SAC: keys in, text out; a dumb terminal, no packets.

Owns the line that is being typed, its echo, the prompt, and which mode the terminal is in. What a
line means is the message processor's business, what a screen shows that of ``queries.py``. Any byte
may come in any chunks; what comes out, and what is done, is the same however they are cut.

Decisions where the manual is silent. CR, LF, and CR LF end a line and are echoed as CR LF. A line
has at most 39 characters, as many as the author's packet firmware takes: what comes beyond is not
echoed, and the line's end is answered ``2big.``. Backspace and DEL take the last character back.
Every other byte is a character of the line. ``+`` and ``-`` act at once at the prompt only. The
prompt is ``SAC>`` in every mode, so that a program knows when a screen is over (the manual's
picture of the configure screen ends with it). What comes from the network, a message or a screen,
stands on lines of its own; the prompt follows with what was typed so far.
Source: manual, "Communications", "Queue", "Configure"; spec, "Two ports, two manners".
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Protocol

from nodes.sac.queries import Query
from sacbus.kernel import Ns
from sacbus.language import Mode
from sacbus.node import ReportKind

__all__ = ["MAX_TYPED", "PROMPT", "TerminalOwner", "TerminalPort"]

PROMPT: Final = b"SAC>"

#: Characters of a line, an address included; the 40th is too many (recorded from the firmware).
MAX_TYPED: Final = 39

_END: Final = b"\r\n"
_CR: Final = 0x0D
_LF: Final = 0x0A
_TAKES_BACK: Final = b"\x08\x7f"
_SIGNS: Final = b"+-"


class TerminalOwner(Protocol):
    """The node behind the port."""

    def tell(self, kind: ReportKind, text: str, line: str = "", column: int = 0) -> None:
        """Something worth a report."""
        ...

    def show(self, text: bytes) -> None:
        """Take what the port prints to wherever its far end is."""
        ...

    def line_typed(self, line: bytes, now: Ns) -> None:
        """A line is whole, without its end; a single ``+`` or ``-`` as soon as it is typed."""
        ...

    def answer(self, query: Query) -> list[str]:
        """What a query shows, line by line."""
        ...


class TerminalPort:
    """A node's terminal, whichever of its ports that is on."""

    __slots__ = (
        "_after_cr",
        "_at_line_start",
        "_executing",
        "_line",
        "_out",
        "_owner",
        "_too_long",
        "mode",
    )

    def __init__(self, owner: TerminalOwner) -> None:
        self._owner = owner
        #: What a line may be.
        self.mode = Mode.PROMPT
        self._line = bytearray()
        self._too_long = False
        #: Whether the last key was a CR: an LF behind it belongs to the same end.
        self._after_cr = False
        self._at_line_start = True
        #: Whether a typed line is being executed: what it prints stands below it.
        self._executing = False
        #: What is to be shown when the keys at hand have been taken; None: nothing is taken now.
        self._out: bytearray | None = None

    def take(self, keys: bytes, now: Ns) -> None:
        """Take keys as a booted node does."""
        self._out = bytearray()
        for key in keys:
            self._take(key, now)
        self.flush()
        self._out = None

    def flush(self) -> None:
        """Show what is to be shown so far, though keys are being taken yet."""
        if self._out:
            out, self._out = self._out, bytearray()
            self._owner.show(bytes(out))

    def _take(self, key: int, now: Ns) -> None:
        if key == _LF and self._after_cr:
            self._after_cr = False
            return
        self._after_cr = key == _CR
        if key in (_CR, _LF):
            self._end_line(now)
        elif key in _TAKES_BACK:
            if self._line and not self._too_long:
                del self._line[-1]
                self._put(b"\b \b")
        elif key in _SIGNS and not self._line and self.mode is Mode.PROMPT:
            self._put(bytes((key,)))
            self._execute(bytes((key,)), now)
        elif len(self._line) < MAX_TYPED:
            self._line.append(key)
            self._put(bytes((key,)))
        else:
            self._too_long = True

    def _end_line(self, now: Ns) -> None:
        self._put(_END)
        line = bytes(self._line)
        self._line.clear()
        if self._too_long:
            self._too_long = False
            self._put(b"2big." + _END)
            self._owner.tell(
                ReportKind.REFUSED,
                f"a typed line of more than {MAX_TYPED} characters is dropped",
                line.decode("latin-1"),
                MAX_TYPED + 1,
            )
        else:
            self._execute(line, now)
        self._put(PROMPT)

    def _execute(self, line: bytes, now: Ns) -> None:
        self._executing = True
        self._owner.line_typed(line, now)
        self._executing = False

    def answer(self, query: Query) -> None:
        """Print what a query shows."""
        self.print(self._owner.answer(query))

    def boot(self, version: str) -> None:
        """A cold boot begins: its line is printed, and no prompt before it is over."""
        self._begin_line()
        self._put(version.encode("ascii") + _END)

    def print(self, lines: Iterable[str]) -> None:
        """Print lines of text, one byte a character (Latin-1)."""
        text = b"".join(line.encode("latin-1") + _END for line in lines)
        if not self._executing:
            self._begin_line()
            text += PROMPT + self._line
        self._put(text)

    def restart(self) -> None:
        """After a boot: what was being typed is dropped, any mode is left, the prompt is shown."""
        self._line.clear()
        self._too_long = False
        self.mode = Mode.PROMPT
        if not self._executing:  # otherwise the prompt follows anyway
            self._begin_line()
            self._put(PROMPT)

    def _begin_line(self) -> None:
        if not self._at_line_start:
            self._put(_END)

    def _put(self, data: bytes | bytearray) -> None:
        if data:
            self._at_line_start = data.endswith(_END)
        if self._out is not None:
            self._out += data
        elif data:
            self._owner.show(bytes(data))
