"""What a request and its ACK cost the server over a pty, beside a bare echo server.

Processor time of the server process alone; the same client and the same bytes for both.
"""

from __future__ import annotations

from benchmarks.client import Client, cpu_each
from benchmarks.figure import Figure

EXCHANGES = 2_000


def figures(rounds: int) -> list[Figure]:
    """Server CPU per exchange without pacing; the goal is three times the bare echo's."""
    with Client("bus-unpaced") as ours, Client("pty-echo") as bare:
        sides = [(client.server, client.exchange) for client in (ours, bare)]
        took, baseline = cpu_each(sides, EXCHANGES, rounds)
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
