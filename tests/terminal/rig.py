"""The far ends of terminal ports and of people: a device on a real pty, and a keyboard with screen.

Everything here waits for a condition; the time-out exists only to fail.
"""

from __future__ import annotations

import os
import select
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

__all__ = ["PROMPT", "Device", "Person", "device", "person"]

PATIENCE: Final = 30.0
PROMPT: Final = b"SAC>"

#: ``python -m sacbus``, with its standard input as the terminal that interrupts it at Ctrl-C.
ON_ITS_TERMINAL: Final = """
import fcntl, runpy, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
runpy.run_module("sacbus", run_name="__main__", alter_sys=True)
"""


class Device(threading.Thread):
    """A terminal port: it echoes, answers each line, and shows its prompt."""

    def __init__(self, answer: Callable[[bytes], bytes | None], *, echo: bool) -> None:
        super().__init__(daemon=True)
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._answer = answer
        self._echo = echo
        self.heard: list[bytes] = []
        self._woken, self._wake = os.pipe()

    def run(self) -> None:
        line = b""
        while True:
            ready, _, _ = select.select([self.master, self._woken], [], [])
            if self._woken in ready:
                return
            for key in os.read(self.master, 4_096):
                if key != 0x0D:
                    line += bytes((key,))
                    self._say(bytes((key,)) if self._echo else b"")
                    continue
                self.heard.append(line)
                answer, line = self._answer(line), b""
                if answer is not None:
                    self._say((b"\r\n" if self._echo else b"") + answer)

    def say(self, data: bytes) -> None:
        """Show something unasked."""
        self._say(data)

    def _say(self, data: bytes) -> None:
        while data:
            data = data[os.write(self.master, data) :]

    def unplug(self) -> None:
        """Nobody is at this end any more."""
        self._end()
        os.close(self.master)
        self.master = -1

    def close(self) -> None:
        self._end()
        if self.master >= 0:
            os.close(self.master)
        for descriptor in (self._slave, self._woken, self._wake):
            os.close(descriptor)

    def _end(self) -> None:
        if self.is_alive():
            os.write(self._wake, b"x")
            self.join(PATIENCE)
            assert not self.is_alive()


@contextmanager
def device(
    answer: Callable[[bytes], bytes | None] = lambda _: PROMPT, *, echo: bool = True
) -> Iterator[Device]:
    """``answer(line)`` is what the device shows upon a line; None: nothing at all."""
    made = Device(answer, echo=echo)
    made.start()
    try:
        yield made
    finally:
        made.close()


class Person:
    """Who sits at a terminal that a real ``sacbus`` has been started on."""

    def __init__(self, process: subprocess.Popen[bytes], keyboard: int) -> None:
        self.process = process
        self._keyboard = keyboard
        self.seen = ""

    def types(self, keys: str) -> None:
        os.write(self._keyboard, keys.encode())

    def sees(self, condition: Callable[[str], object]) -> str:
        """Look until ``condition(all that was on the screen so far)`` holds."""
        deadline = time.monotonic() + PATIENCE
        while not condition(self.seen):
            assert self._ready(deadline)
            assert self._look(), f"the program ended, saw {self.seen!r}"
        return self.seen

    def leaves(self, upon: str = "") -> int:
        """Look on until the program has ended; its status.

        ``upon`` is pressed each second until it does: a signal that comes just before readline
        begins to wait is seen by Python at the next key only.
        """
        deadline = time.monotonic() + PATIENCE
        while True:
            if upon and not select.select([self._keyboard], [], [], 1)[0]:
                self._ready(deadline, at_once=True)
                self.types(upon)
            elif not (self._ready(deadline) and self._look()):
                return self.process.wait(PATIENCE)

    def _ready(self, deadline: float, *, at_once: bool = False) -> bool:
        patience = deadline - time.monotonic()
        ready = patience > 0 and (
            at_once or select.select([self._keyboard], [], [], patience)[0] != []
        )
        assert ready, f"waited in vain, saw {self.seen!r}"
        return True

    def errors(self) -> str:
        assert self.process.stderr is not None
        return self.process.stderr.read().decode()

    def _look(self) -> str:
        try:
            more = os.read(self._keyboard, 65_536).decode("latin-1")
        except OSError:  # the last program on it has ended
            more = ""
        self.seen += more
        return more


@contextmanager
def person(*arguments: str, **environment: str) -> Iterator[Person]:
    """``python -m sacbus ARGUMENTS`` with keyboard and screen on a terminal."""
    master, slave = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", ON_ITS_TERMINAL, *arguments],
        stdin=slave,
        stdout=slave,
        stderr=subprocess.PIPE,
        env={**os.environ, "TERM": "xterm", "INPUTRC": "/dev/null", **environment},
        start_new_session=True,
    )
    os.close(slave)
    with process:
        try:
            yield Person(process, master)
        finally:
            process.kill()
            os.close(master)
