"""How late the line runs, beside a loop of bare ``select`` calls that serves the same exchanges.

Both are processes of their own behind a pty, with the same client. The bare server reads requests,
sleeps until each event of the exchange is due, and answers: what it is late by is the machine's
doing. What ``sacbus serve`` is late by it tells itself when it ends, from a terminal of 120 columns
and 50 lines, with and without its live table, all its nodes in motion.
"""

from __future__ import annotations

import os
import re
import signal
import statistics
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import serial

from benchmarks.client import Server, exchange
from benchmarks.figure import Figure
from sacbus.wire import encode

EXCHANGES = 120
ROUNDS = 3

#: Every node turns for longer than any round, without ramps: each row of the table changes.
MOVE = encode(0, 1, b"m1000000v30")

#: (nodes, precise, table)
CASES = [
    (nodes, precise, table)
    for precise in (False, True)
    for nodes in ("10-12", "6-255")
    for table in (False, True)
]


@dataclass(slots=True)
class Late:
    """Quantiles of a server's lateness, round by round, us."""

    p50: list[float] = field(default_factory=list)
    p99: list[float] = field(default_factory=list)

    def add(self, quantiles: tuple[float, float]) -> None:
        self.p50.append(quantiles[0])
        self.p99.append(quantiles[1])


def figures(rounds: int) -> list[Figure]:
    """p50 and p99 of ``serve``, less the bare loop's; the goal for p50 is 0.1 ms."""
    late = {case: Late() for case in CASES}
    bare = {case: Late() for case in CASES}
    for _ in range(min(rounds, ROUNDS)):
        for case in CASES:
            bare[case].add(_bare())
            late[case].add(_served(*case))
    found: list[Figure] = []
    for case in CASES:
        nodes, precise, table = case
        count = 3 if nodes == "10-12" else 250
        name = f"{count} nodes{', table' if table else ''}{', precise' if precise else ''}"
        for quantile in ("p50", "p99"):
            ours, base = getattr(late[case], quantile), getattr(bare[case], quantile)
            baseline = statistics.median(base)
            difference = statistics.median(
                one - other for one, other in zip(ours, base, strict=True)
            )
            found.append(
                Figure(
                    f"extra lateness {quantile}, {name}",
                    difference,
                    "us",
                    statistics.median(ours) / baseline,
                    f"a bare select loop ({baseline:.0f} us)",
                    100 if quantile == "p50" else None,
                    "value, at most" if quantile == "p50" else "",
                )
            )
    return found


def _bare() -> tuple[float, float]:
    with Server("select") as server:
        with serial.Serial(server.where, 38_400, timeout=5) as port:
            exchange(port, EXCHANGES)
        p50, p99 = map(float, server.end().split())
    return p50, p99


def _served(nodes: str, precise: bool, table: bool) -> tuple[float, float]:
    options = ["--ephemeral", "--nodes", nodes]
    options += ["--precise"] * precise + ["--no-table"] * (not table)
    with _on_a_terminal(*options) as (process, terminal):
        link = terminal.find(r"connect to (\S+)")[0]
        with serial.Serial(link, 38_400, timeout=5) as port:
            port.write(MOVE)
            time.sleep(0.1)  # a packet right behind another is lost on the device
            exchange(port, EXCHANGES)
        process.send_signal(signal.SIGTERM)
        p50, p99 = terminal.find(r"late by (\d+) us \(p50\), (\d+) us")
        assert process.wait(10) == 0
    return float(p50), float(p99)


class _Terminal:
    """What a process writes to its terminal, read at once, as a terminal does."""

    def __init__(self, master: int) -> None:
        self._master = master
        self._text = b""
        self._more = threading.Condition()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def find(self, pattern: str) -> tuple[str, ...]:
        """The groups of the first match, waited for."""
        deadline = time.monotonic() + 20
        with self._more:
            while not (found := re.search(pattern.encode(), self._text)):
                assert self._more.wait(deadline - time.monotonic()), self._text[-1_000:]
        return tuple(group.decode() for group in found.groups())

    def close(self) -> None:
        self._reader.join()
        os.close(self._master)

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._master, 65_536)
            except OSError:  # the process has ended
                return
            with self._more:
                # Of the table only the end is kept: to look through all of it would take our time.
                self._text = (self._text + data)[-4_096:]
                self._more.notify()


@contextmanager
def _on_a_terminal(*options: str) -> Iterator[tuple[subprocess.Popen[bytes], _Terminal]]:
    master, slave = os.openpty()
    termios.tcsetwinsize(slave, (50, 120))
    process = subprocess.Popen(
        [sys.executable, "-m", "sacbus", "serve", *options],
        stdin=subprocess.DEVNULL,
        stdout=slave,
        stderr=slave,
    )
    os.close(slave)
    terminal = _Terminal(master)
    try:
        yield process, terminal
    finally:
        process.kill()
        process.wait()
        terminal.close()
