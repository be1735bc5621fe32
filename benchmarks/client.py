"""The client's side: a server process, what it has used, and exchanges over its serial port."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

import serial

from benchmarks import REQUEST

__all__ = ["Client", "Server", "cpu_each", "exchange"]


def exchange(port: serial.Serial, times: int, pause: float = 0.0) -> float:
    """Requests, each ``pause`` seconds after the one before is answered; seconds of wall time."""
    began = time.perf_counter()
    for _ in range(times):
        if pause:
            time.sleep(pause)
        port.write(REQUEST)
        answer = port.read(4)
        assert answer == b"\x02\x01\x0a\x06", answer
    return time.perf_counter() - began


class Server:
    """A process of ``benchmarks.server``, for a ``with`` block."""

    def __init__(self, *arguments: str) -> None:
        self._arguments = arguments

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.server", *self._arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        #: Where to connect.
        self.where = self._line()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.communicate()

    def cpu(self) -> float:
        """Processor seconds used so far."""
        assert self._process.stdin is not None
        self._process.stdin.write("cpu\n")
        self._process.stdin.flush()
        return float(self._line())

    def end(self) -> str:
        """End it; what it prints then."""
        return self._process.communicate()[0]

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()


class Client:
    """A server and pyserial on its port, for a ``with`` block."""

    def __init__(self, *arguments: str, port: str | None = None, pause: float = 0.0) -> None:
        """``port``: where to connect instead of where the server says. ``pause``: as above."""
        self.server = Server(*arguments)
        self._where = port
        self._pause = pause

    def __enter__(self) -> Self:
        self.server.__enter__()
        self._port = serial.Serial(self._where or self.server.where, 38_400, timeout=5)
        self.exchange(20)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._port.close()
        self.server.__exit__(kind, error, trace)

    def exchange(self, times: int) -> float:
        """As :func:`exchange`, with this server."""
        return exchange(self._port, times, self._pause)


def cpu_each(
    sides: Sequence[tuple[Server, Callable[[int], object]]], exchanges: int, rounds: int
) -> list[float]:
    """Processor seconds that an exchange costs each server, medians of rounds taken in turns.

    With each server comes what has so many exchanges with it.
    """
    costs: list[list[float]] = [[] for _ in sides]
    for _ in range(rounds):
        for (server, act), found in zip(sides, costs, strict=True):
            before = server.cpu()
            act(exchanges)
            found.append((server.cpu() - before) / exchanges)
    return [statistics.median(found) for found in costs]
