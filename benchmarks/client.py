"""The client of the pty benchmarks: one server process, and exchanges with it."""

from __future__ import annotations

import subprocess
import sys
import time
from types import TracebackType
from typing import Self

import serial

from benchmarks import REQUEST

__all__ = ["Client", "exchange"]


def exchange(port: serial.Serial, times: int) -> float:
    """Requests, each when the one before is answered; seconds of wall time."""
    began = time.perf_counter()
    for _ in range(times):
        port.write(REQUEST)
        answer = port.read(4)
        assert answer == b"\x02\x01\x0a\x06", answer
    return time.perf_counter() - began


class Client:
    """A server of ``benchmarks.server`` and pyserial on its port, for a ``with`` block."""

    def __init__(self, kind: str) -> None:
        self._kind = kind

    def __enter__(self) -> Self:
        self._server = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.server", self._kind],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._port = serial.Serial(self._line(), 38_400, timeout=5)
        self.exchange(20)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._port.close()
        self._server.communicate()

    def exchange(self, times: int) -> float:
        """As :func:`exchange`, with this server."""
        return exchange(self._port, times)

    def server_cpu(self) -> float:
        """Processor seconds that the server has used so far."""
        assert self._server.stdin is not None
        self._server.stdin.write("cpu\n")
        self._server.stdin.flush()
        return float(self._line())

    def _line(self) -> str:
        assert self._server.stdout is not None
        return self._server.stdout.readline().strip()
