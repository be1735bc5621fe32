"""What a request and its ACK cost the server over a pty, beside a bare echo server.

Processor time of the server process alone; the same client and the same bytes for both.
"""

from __future__ import annotations

import statistics

from benchmarks.client import Client
from benchmarks.figure import Figure

EXCHANGES = 2_000


def figures(rounds: int) -> list[Figure]:
    """Server CPU per exchange without pacing; the goal is three times the bare echo's."""
    bus: list[float] = []
    echo: list[float] = []
    with Client("unpaced") as ours, Client("echo") as bare:
        for _ in range(rounds):
            for client, costs in ((ours, bus), (bare, echo)):
                before = client.server_cpu()
                client.exchange(EXCHANGES)
                costs.append((client.server_cpu() - before) / EXCHANGES)
    took, baseline = statistics.median(bus), statistics.median(echo)
    return [
        Figure(
            "server CPU per request and ACK, pty, unpaced",
            took * 1e6,
            "us",
            took / baseline,
            f"an add_reader echo ({baseline * 1e6:.1f} us)",
            3.0,
            "ratio, at most",
        )
    ]
