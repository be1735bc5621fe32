"""Every key at once, as a dumb terminal sends it: ``sacbus terminal --raw``.

Owns the keyboard without lines. The node echoes, and nobody edits: what is on the screen is what it
shows, byte for byte.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from sacbus.links import open_line

__all__ = ["type_keys"]

_INTERRUPT: Final = b"\x03"
_END: Final = b"\x04"


async def type_keys(link: str, baud: int) -> None:
    """Pass keys on until Ctrl-D; KeyboardInterrupt at Ctrl-C, as anywhere.

    LinkError when the link cannot be had, ConnectionError when it is lost.
    """
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[None] = loop.create_future()
    keyboard, screen = sys.stdin.fileno(), sys.stdout.fileno()

    def end(fault: BaseException | None) -> None:
        if ended.done():
            return
        if fault is None:
            ended.set_result(None)
        else:
            ended.set_exception(fault)

    def pressed() -> None:
        keys = os.read(keyboard, 1_024)
        before, end_key, _ = keys.partition(_END)
        before, interrupt, _ = before.partition(_INTERRUPT)
        line.send(before)
        if interrupt:
            end(_Interrupted())
        elif end_key or not keys:
            end(None)

    async with open_line(link, baud) as line:
        line.start(lambda data: _write(screen, data), lambda why: end(ConnectionError(why)))
        with _raw(keyboard):
            _write(screen, f"{link}: every key is sent at once; Ctrl-D ends it\r\n".encode())
            loop.add_reader(keyboard, pressed)
            try:
                await ended
            except _Interrupted:
                raise KeyboardInterrupt from None  # whose message begins on a new line
            except ConnectionError:
                _write(screen, b"\r\n")
                raise
            finally:
                loop.remove_reader(keyboard)
            _write(screen, b"\r\n")


class _Interrupted(Exception):
    """Ctrl-C; a future may hold it, as it may not KeyboardInterrupt."""


def _write(screen: int, data: bytes) -> None:
    while data:
        data = data[os.write(screen, data) :]


@contextmanager
def _raw(keyboard: int) -> Iterator[None]:
    """The keyboard gives every key as it is, Ctrl-C too; put back afterwards."""
    before = termios.tcgetattr(keyboard)
    tty.setraw(keyboard, termios.TCSADRAIN)  # and keep what has been typed already
    try:
        yield
    finally:
        with contextlib.suppress(termios.error):  # closed meanwhile
            termios.tcsetattr(keyboard, termios.TCSADRAIN, before)
