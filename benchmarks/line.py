"""Whether the line keeps time: exchanges over a real pty against what the figures add up to."""

from __future__ import annotations

import statistics

from benchmarks import REQUEST
from benchmarks.client import Client
from benchmarks.figure import Figure
from sacbus.bus import LATENCY
from sacbus.kernel import SECOND, LineRate
from sacbus.wire.times import ANSWER_BYTES, turnaround

EXCHANGES = 100


def expected() -> float:
    """Seconds of one exchange: packet, turnaround, ACK, and the link's latency before the next."""
    rate = LineRate()
    body = len(REQUEST) - 6
    ns = rate.span(len(REQUEST)) + turnaround(body, nul_follows=True)
    return (ns + rate.span(ANSWER_BYTES) + LATENCY) / SECOND


def figures(rounds: int) -> list[Figure]:
    """Wall time of an exchange, as a ratio to the line's own figures; the goal is 5 %."""
    with Client("bus") as client:
        took = statistics.median(client.exchange(EXCHANGES) for _ in range(min(rounds, 5)))
    per = took / EXCHANGES
    return [
        Figure(
            "exchange of 20-byte packets, real time, pty",
            per * 1e3,
            "ms",
            per / expected(),
            f"{expected() * 1e3:.3f} ms of line time",
            1.05,
            "ratio, at most",
        )
    ]
