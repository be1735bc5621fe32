"""A real ``sacbus serve``: started, spoken to, and ended again. For all tests that need a process.

Everything here waits for a condition; the time-out exists only to fail.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import serial

__all__ = ["PATIENCE", "Sacbus", "client", "served", "started", "until"]

PATIENCE: Final = 30.0


class Sacbus:
    """A running ``python -m sacbus``, and what it has written so far."""

    def __init__(self, process: subprocess.Popen[bytes], output: int) -> None:
        self.process = process
        self._output = output
        self.text = ""
        self.ready: dict[str, Any] = {}

    @property
    def link(self) -> str:
        path = self.ready["links"][0]["path"]
        assert isinstance(path, str)
        return path

    def read_until(self, condition: Callable[[str], object]) -> str:
        """Read output until ``condition(all of it so far)`` holds."""
        deadline = time.monotonic() + PATIENCE
        while not condition(self.text):
            readable, _, _ = select.select([self._output], [], [], deadline - time.monotonic())
            assert readable, f"waited in vain, got {self.text!r}"
            more = self._read()
            assert more, f"the output ended, got {self.text!r}"
        return self.text

    def read_event(self, event: str) -> dict[str, Any]:
        """The first whole JSON line of that event."""

        def found(text: str) -> list[dict[str, Any]]:
            lines = text.split("\n")[:-1]
            return [one for line in lines if (one := json.loads(line))["event"] == event]

        return found(self.read_until(found))[0]

    def send_signal(self, number: signal.Signals) -> int:
        """Signal it; its exit status."""
        self.process.send_signal(number)
        return self.wait()

    def wait(self) -> int:
        """Its exit status, and all output read."""
        # Read on while waiting: a full pipe would keep it from ending.
        while self._read():
            pass
        return self.process.wait(PATIENCE)

    def errors(self) -> str:
        assert self.process.stderr is not None
        return self.process.stderr.read().decode()

    def _read(self) -> str:
        try:
            more = os.read(self._output, 65_536).decode()
        except OSError:  # a terminal whose last program has ended
            more = ""
        self.text += more
        return more


@contextmanager
def started(*arguments: str, **environment: str) -> Iterator[Sacbus]:
    """``python -m sacbus ARGUMENTS``; killed at the end if it still runs."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sacbus", *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, **environment},
    )
    assert process.stdout is not None
    with process:
        try:
            yield Sacbus(process, process.stdout.fileno())
        finally:
            process.kill()


@contextmanager
def served(*arguments: str, **environment: str) -> Iterator[Sacbus]:
    """``sacbus serve --json ARGUMENTS`` that has said that it is ready."""
    with started("serve", "--json", *arguments, **environment) as sacbus:
        sacbus.ready = sacbus.read_event("ready")
        yield sacbus


@contextmanager
def client(link: str) -> Iterator[serial.Serial]:
    """A program's serial port; a read that waits in vain comes back short."""
    with serial.Serial(link, 38_400, timeout=PATIENCE, exclusive=True) as port:
        yield port


def until(condition: Callable[[], object]) -> None:
    """Look until it holds."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.001)
