"""A dialog with a SAC's terminal port: a line is sent, what is shown upon it comes back.

Owns when an answer is complete, and what is none. A SAC ends what it says with its prompt; its
program modes (``QP``, ``XP``, ``$C``) have others, so silence after an answer ends it as well.

Opening a serial port resets many a board, and for a second after a reset a SAC takes any key for
the wish to have its factory settings back (manual, "Factory Restore"). So nothing is sent to a
port that may be a board's before its boot is certainly over.
"""

from __future__ import annotations

import asyncio
import os
import re
from collections.abc import Callable
from typing import Final

from sacbus.links import Line, LinkError
from sacbus.terminal.echo import LineEcho

__all__ = ["PROMPT", "Dialog", "NoAnswer", "Untypable"]

#: What a SAC shows when it waits for a line (manual, "Terminal").
PROMPT: Final = "SAC>"

#: Seconds of silence upon a line after which nobody is there; a screen of some 2 kB takes less at
#: 9600 baud.
PATIENCE: Final = 3.0

#: Seconds of silence after which an answer that does not end in a prompt is complete.
PAUSE: Final = 0.5

#: Seconds in which more may follow a prompt: what a key did at once has shown one of its own.
BREATH: Final = 0.03

#: Seconds of silence after a port was opened that no boot contains: a boot loader takes up to two
#: before a SAC shows its version, and after that it shows its prompt within one.
BOOT: Final = 2.5

_PROMPTED: Final = re.compile(rb"[\r\n]SAC>\s*$")

#: As many of the last bytes as a prompt is looked for in; blanks behind it leave room for more.
_TAIL: Final = 64

#: Where a pty stands on Linux and the BSDs, and on macOS; a serial port has a name there.
_PTY: Final = re.compile(r"/dev/(pts/|ttys)\d+")


class NoAnswer(LinkError, TimeoutError):
    """Nobody shows anything upon a line."""

    def __init__(self, where: str) -> None:
        super().__init__(
            f"no answer within {PATIENCE:g} s, expected the prompt {PROMPT}",
            where,
            "check that it is a terminal port and not the network's, the baud rate, and that no "
            "other program reads it",
        )


class Untypable(ValueError):
    """A line that no keyboard of a terminal types. column: from 1; got: the character there."""

    def __init__(self, column: int, got: str) -> None:
        super().__init__(
            f"this cannot be typed, column {column}, expected printable ASCII, got {got!r}"
        )
        self.column, self.got = column, got


class Dialog:
    """The talk on one open line, which ends with it.

    ``show`` gets all that is shown but the echo of lines, as it comes, without CR; ``lose`` is told
    when the line is gone. Raises ConnectionError once it is.
    """

    def __init__(
        self,
        line: Line,
        where: str,
        show: Callable[[str], object] = lambda _: None,
        lose: Callable[[], object] = lambda: None,
    ) -> None:
        self._line = line
        self._where = where
        self._show = show
        self._tell = lose
        self._echo = LineEcho(b"")
        self._echo.over = True
        #: Whether anything has come since the last line was sent, and the end of that, which begins
        #: where a line does.
        self._answered = False
        self._tail = b"\n"
        #: What has come since, without the echo, for who waits for it; nobody keeps the rest.
        self._shown: list[str] | None = []
        self._news = asyncio.Event()
        self._lost: str | None = None
        line.start(self._hear, self._lose)

    async def begin(self) -> str:
        """Have a prompt before the first line; what is shown until then. :class:`NoAnswer`."""
        if not _is_pty(self._where):
            await self._hear_out(BOOT, BOOT)
        before = self._text()
        if _PROMPTED.search(self._tail):
            self._shown = None
            return before
        shown = await self.ask("")
        if not shown.strip():  # a loop of wire gives back as much
            raise NoAnswer(self._where)
        return before + shown

    async def ask(self, line: str) -> str:
        """Send a line and CR; what is shown upon it, the prompt included.

        :class:`Untypable` if nothing was sent, :class:`NoAnswer` for silence.
        """
        for column, one in enumerate(line, start=1):
            if not (one.isascii() and one.isprintable()):
                raise Untypable(column, one)
        data = line.encode("ascii")
        self._echo = LineEcho(data)
        self._answered, self._tail = False, b"\n"
        self._shown = []
        self._line.send(data + b"\r")
        try:
            await self._hear_out(PATIENCE, PAUSE)
            if not self._answered:
                raise NoAnswer(self._where)
            return self._text()
        finally:
            self._shown = None

    def _text(self) -> str:
        return "".join(self._shown or ())

    async def _hear_out(self, patience: float, pause: float) -> None:
        """Wait until a prompt has come, or silence: seconds before an answer, and behind one."""
        while True:
            if self._lost is not None:
                raise ConnectionError(self._lost)
            if _PROMPTED.search(self._tail):
                wait = BREATH
            elif self._answered and self._echo.over:
                wait = pause
            else:
                wait = patience
            self._news.clear()
            try:
                async with asyncio.timeout(wait):
                    await self._news.wait()
            except TimeoutError:
                if not self._echo.over:
                    self._take(self._echo.settle())
                return

    def _hear(self, data: bytes) -> None:
        self._answered = True
        self._tail = (self._tail + data)[-_TAIL:]
        self._take(self._echo.strip(data))
        self._news.set()

    def _take(self, data: bytes) -> None:
        if data:
            text = data.replace(b"\r", b"").decode("latin-1")
            if self._shown is not None:
                self._shown.append(text)
            self._show(text)

    def _lose(self, why: str) -> None:
        self._lost = why
        self._news.set()
        self._tell()


def _is_pty(link: str) -> bool:
    """Whether nothing is reset when the link is opened, since it is no adapter's port."""
    return _PTY.fullmatch(os.path.realpath(link)) is not None
