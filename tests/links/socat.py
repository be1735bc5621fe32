"""An adapter that can be pulled out: two ptys that socat joins, one the device, one its line."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import termios
from pathlib import Path
from typing import Final

import pytest

from tests.serving import PATIENCE, until

__all__ = ["SOCAT", "Wire", "needs_socat"]

SOCAT: Final = shutil.which("socat")

needs_socat = pytest.mark.skipif(SOCAT is None, reason="socat is not installed")


class Wire:
    """``near`` is the adapter's path, ``far`` what hangs on its line; both are there while plugged.

    socat holds both ptys open itself, so programs may come and go at either end. Skips the test
    that makes one where there is no socat.
    """

    def __init__(self) -> None:
        if SOCAT is None:
            pytest.skip("socat is not installed")
        self.directory = Path(tempfile.mkdtemp(prefix="sacbus-wire-"))
        self.near = str(self.directory / "near")
        self.far = str(self.directory / "far")
        self._process: subprocess.Popen[bytes] | None = None

    def plug(self) -> None:
        """Put it in, and wait until it is there."""
        assert self._process is None
        assert SOCAT is not None
        self._process = subprocess.Popen(
            [SOCAT, *(f"pty,raw,echo=0,link={end}" for end in (self.near, self.far))],
            stdin=subprocess.DEVNULL,
        )
        until(lambda: _is_raw(self.near) and _is_raw(self.far))

    def unplug(self) -> None:
        """Pull it out: the system hangs up on both ends, and socat takes its symlinks away."""
        if self._process is not None:
            process, self._process = self._process, None
            process.terminate()
            process.wait(PATIENCE)

    def close(self) -> None:
        self.unplug()
        shutil.rmtree(self.directory)


def _is_raw(path: str) -> bool:
    """Whether the pty is there, and as it is to be: socat names it first and sets it after that."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except FileNotFoundError:
        return False
    try:
        _, oflag, _, lflag, _, _, _ = termios.tcgetattr(descriptor)
    finally:
        os.close(descriptor)
    return not oflag & termios.OPOST and not lflag & (termios.ECHO | termios.ICANON)
