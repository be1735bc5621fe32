"""The operator of a machine: shown how far its program is, told what it says, asked at M0.

Owns the terminal's last line, and the Enter that a program waits for.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING, Final, Self

import click

from sacbus.cli.options import WrongInput

if TYPE_CHECKING:
    from sacbus.machining import Told

__all__ = ["Operator", "ask", "check_somebody_there", "go_on"]

#: Seconds from one word about how far it is to the next.
OFTEN: Final = 0.2


class Operator:
    """Sees how far a program is, on a terminal's last line; that is gone when it is over."""

    def __init__(self, name: str, lines: int) -> None:
        self._name = name
        self._lines = max(lines, 1)
        self._next = time.monotonic() + 1
        self._shown = False
        self._terminal = sys.stderr.isatty()
        self._line = 0

    def come_to(self, line: int) -> None:
        """It has come to this line of the program."""
        self._line = line or self._line
        if self._terminal and time.monotonic() >= self._next:
            self._next = time.monotonic() + OFTEN
            self._shown = True
            part = min(self._line / self._lines, 1)
            bar = "#" * round(30 * part)
            click.echo(
                f"\r\x1b[K{self._name} [{bar:<30}] {100 * part:.0f} %, line {self._line}",
                nl=False,
                err=True,
            )

    def told(self, halt: Callable[[Callable[[str], object], str, bool], Awaitable[None]]) -> Told:
        """Who is told what on the way."""
        from sacbus.machining import Told

        return Told(
            self.come_to,
            partial(halt, self.say),
            lambda streamed: self.say(f"stopped: {streamed.where()}"),
        )

    def say(self, text: str) -> None:
        """What the program tells somebody."""
        self._wipe()
        click.echo(f"{self._name}: {text}", err=True)

    def _wipe(self) -> None:
        if self._shown:
            click.echo("\r\x1b[K", nl=False, err=True)
            self._shown = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._wipe()


async def go_on(say: Callable[[str], object], text: str, waits: bool) -> None:
    """What a halt is in a simulation: nobody is waited for."""
    say(f"{text}, would wait" if waits else text)


async def ask(say: Callable[[str], object], text: str, waits: bool) -> None:
    """What a halt is on a line: the operator reads it, and presses Enter if the program waits."""
    say(f"{text}, press Enter to go on" if waits else text)
    if waits:
        await _key()


def check_somebody_there() -> None:
    """WrongInput when there is no terminal at which somebody could press Enter."""
    os.close(_terminal())


def _terminal() -> int:
    """A descriptor of the terminal, whatever standard input is."""
    try:
        return os.open("/dev/tty", os.O_RDONLY | os.O_NOCTTY)
    except OSError as fault:
        raise WrongInput(
            "M0 waits for somebody, and there is no terminal, run it at one"
        ) from fault


async def _key() -> None:
    """Wait until somebody at the terminal presses Enter."""
    terminal = _terminal()
    loop = asyncio.get_running_loop()
    pressed = loop.create_future()

    def read() -> None:
        if pressed.done():
            return
        try:
            if os.read(terminal, 1024):  # Ctrl-D is no Enter
                pressed.set_result(None)
        except OSError as fault:
            gone = WrongInput("M0 waits for somebody, and the terminal is gone, run it at one")
            gone.__cause__ = fault
            pressed.set_exception(gone)

    loop.add_reader(terminal, read)
    try:
        await pressed
    finally:
        loop.remove_reader(terminal)
        os.close(terminal)
