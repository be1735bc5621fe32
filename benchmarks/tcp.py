"""What a request and its ACK cost the server over TCP and over a serial port, beside bare echoes.

Processor time of the server process alone; the same client and the same bytes for both. With one
request outstanding the bus is as it comes. With more of them, which a line of two wires has no use
for (answers would collide with requests), it has a lane each way, and a node for each request.
"""

from __future__ import annotations

import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import cycle, islice
from pathlib import Path
from urllib.parse import urlsplit

from benchmarks import REQUEST
from benchmarks.client import Client, Server, cpu_each
from benchmarks.figure import Figure
from benchmarks.server import MANY
from sacbus.wire import encode

EXCHANGES = 2_000
#: Over a serial port everything takes the line's time, so fewer do.
SERIAL_EXCHANGES = 100
SERIAL_ROUNDS = 5
#: Seconds between an answer and the next request. A cable of socat's takes no time, but what comes
#: in is taken to have taken it: a packet of 5.2 ms, behind an answer of 1 ms and a gap of 1 ms.
PAUSE = 0.008
OUTSTANDING = (1, 8, 64)
ANSWER_BYTES = 4


def figures(rounds: int) -> list[Figure]:
    """Server CPU per exchange; the goal is three times the bare echo's."""
    found = [_tcp(outstanding, rounds) for outstanding in OUTSTANDING]
    if shutil.which("socat"):
        found.append(_serial(rounds))
    return found


def _tcp(outstanding: int, rounds: int) -> Figure:
    """So many requests on their way at a time, over one connection."""
    kind, packets = "tcp", [REQUEST]
    if outstanding > 1:
        kind, packets = "tcp-many", [encode(node, 1, b"v100".ljust(14)) for node in MANY]
    with _tcp_client(kind, packets) as ours, _tcp_client("tcp-echo", packets) as bare:
        sides = [(server, partial(act, outstanding)) for server, act in (ours, bare)]
        took, baseline = cpu_each(sides, EXCHANGES, rounds)
    return Figure(
        f"server CPU per request and ACK, TCP, {outstanding} out",
        took * 1e6,
        "us",
        took / baseline,
        f"a BufferedProtocol echo ({baseline * 1e6:.1f} us)",
        3.0,
        "ratio, at most",
    )


@contextmanager
def _tcp_client(
    kind: str, packets: list[bytes]
) -> Iterator[tuple[Server, Callable[[int, int], None]]]:
    with Server(kind) as server:
        url = urlsplit(server.where)
        assert url.hostname is not None
        assert url.port is not None
        with socket.create_connection((url.hostname, url.port), timeout=5) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            act = partial(_exchange, connection, packets)
            act(1, 20)
            yield server, act


def _exchange(
    connection: socket.socket, packets: list[bytes], outstanding: int, times: int
) -> None:
    """So many requests, each sent when the one ``outstanding`` before it is answered."""
    requests = islice(cycle(packets), times)
    connection.sendall(b"".join(islice(requests, outstanding)))
    got = 0
    while got < times * ANSWER_BYTES:
        data = connection.recv(65_536)
        assert data, "the server has hung up"
        answered, got = got // ANSWER_BYTES, got + len(data)
        if fresh := b"".join(islice(requests, got // ANSWER_BYTES - answered)):
            connection.sendall(fresh)


def _serial(rounds: int) -> Figure:
    """The bus on a real port, as far as socat's are, beside pyserial-asyncio's echo."""
    with (
        _cable() as (ours_here, ours_there),
        _cable() as (bare_here, bare_there),
        Client("adapter", ours_here, port=ours_there, pause=PAUSE) as ours,
        Client("serial-echo", bare_here, port=bare_there, pause=PAUSE) as bare,
    ):
        sides = [(client.server, client.exchange) for client in (ours, bare)]
        took, baseline = cpu_each(sides, SERIAL_EXCHANGES, min(rounds, SERIAL_ROUNDS))
    return Figure(
        "server CPU per request and ACK, serial port",
        took * 1e6,
        "us",
        took / baseline,
        f"a pyserial-asyncio echo ({baseline * 1e6:.1f} us)",
        3.0,
        "ratio, at most",
    )


@contextmanager
def _cable() -> Iterator[tuple[str, str]]:
    """Two serial ports, joined."""
    with tempfile.TemporaryDirectory() as place:
        ends = [Path(place) / name for name in ("here", "there")]
        ptys = (f"PTY,raw,echo=0,link={end}" for end in ends)
        cable = subprocess.Popen(["socat", *ptys])  # noqa: S607 (wherever it is)
        with cable:
            while not all(end.exists() for end in ends):
                assert cable.poll() is None, "socat has ended"
                time.sleep(0.01)
            try:
                yield str(ends[0]), str(ends[1])
            finally:
                cable.terminate()
