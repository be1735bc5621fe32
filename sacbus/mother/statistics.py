"""What mother remembers of each node: counts and round trips."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from statistics import median
from typing import Final

from sacbus.kernel import US, Ns

__all__ = ["NodeStatistics"]

#: Round trips kept per node: enough for a p99 that means something, and bounded.
KEPT: Final = 1_000


@dataclass(slots=True)
class NodeStatistics:
    """Counts since the start, and the last round trips (ns, from the packet's first bit on).

    Once nothing is outstanding, ``sent`` is ``acks`` + ``naks`` + ``timeouts``, but for what was on
    its way when the line was lost; of these, ``retries`` were asked before. Of broadcasts (address
    0) ``sent`` alone says something.
    """

    sent: int = 0
    acks: int = 0
    naks: int = 0
    timeouts: int = 0
    retries: int = 0
    round_trips: deque[Ns] = field(default_factory=lambda: deque(maxlen=KEPT))

    def round_trip_us(self) -> dict[str, float] | None:
        """``min``, ``median`` and ``p99`` of the last round trips in µs; None before the first."""
        if not self.round_trips:
            return None
        ordered = sorted(self.round_trips)
        # Nearest rank: the smallest value that 99 % of all do not exceed.
        p99 = ordered[-(-99 * len(ordered) // 100) - 1]
        return {
            "min": ordered[0] / US,
            "median": median(ordered) / US,
            "p99": p99 / US,
        }

    def as_dict(self) -> dict[str, object]:
        """The counts by name, and ``round_trip_us`` as :meth:`round_trip_us` has it."""
        return {
            "sent": self.sent,
            "acks": self.acks,
            "naks": self.naks,
            "timeouts": self.timeouts,
            "retries": self.retries,
            "round_trip_us": self.round_trip_us(),
        }
