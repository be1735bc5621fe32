"""What it all came to: counts, delays and load, for the monitor's last line.

Owns the figures of everything that was on the line, whatever of it was shown.
"""

from __future__ import annotations

from collections import deque
from statistics import median
from typing import Final

from sacbus.kernel import US, Ns
from sacbus.watch.entries import Collision, Entry, Lost, Reported, Spoken, Unanswered

__all__ = ["Summary"]

#: The median is that of the last so many ACKs: enough to be steady, little enough to be kept.
DELAYS_KEPT: Final = 10_000


class Summary:
    """Counts of entries, and the line's load."""

    def __init__(self) -> None:
        self.packets = 0
        self.wrong = 0  #: of the packets: with a check that is not right
        self.acks = 0
        self.naks = 0
        self.unanswered = 0
        self.garbage = 0
        self.collisions = 0
        self.reports = 0
        self.missed = 0
        self.busy: Ns = 0
        self.elapsed: Ns = 0
        self._delays: deque[Ns] = deque(maxlen=DELAYS_KEPT)

    @property
    def ack_delay(self) -> Ns | None:
        """The median from a request's end to its ACK's first bit; None when none is known."""
        return int(median(self._delays)) if self._delays else None

    @property
    def load(self) -> float:
        """The part of the time for which somebody was talking, 0 to 1."""
        return min(self.busy / self.elapsed, 1) if self.elapsed > 0 else 0

    def count(self, entry: Entry) -> None:
        """One more."""
        match entry:
            case Spoken(said=said, delay=delay):
                match said.kind:
                    case "packet":
                        self.packets += 1
                        self.wrong += said.verdict not in ("", "right", "unchecked")
                    case "ack":
                        self.acks += 1
                        if delay is not None:
                            self._delays.append(delay)
                    case "nak":
                        self.naks += 1
                    case _:
                        self.garbage += 1
            case Unanswered():
                self.unanswered += 1
            case Collision():
                self.collisions += 1
            case Reported():
                self.reports += 1
            case Lost(lines):
                self.missed += lines

    def as_fields(self) -> dict[str, object]:
        """For JSON."""
        return {
            "packets": self.packets,
            "wrong": self.wrong,
            "acks": self.acks,
            "naks": self.naks,
            "unanswered": self.unanswered,
            "garbage": self.garbage,
            "collisions": self.collisions,
            "reports": self.reports,
            "missed": self.missed,
            "ack_delay_ns": self.ack_delay,
            "load": round(self.load, 6),
            "elapsed_ns": self.elapsed,
        }

    def as_text(self) -> str:
        """In one line."""
        told = [
            f"{self.packets} packets" + (f" ({self.wrong} wrong)" if self.wrong else ""),
            f"{self.acks} ACK",
            f"{self.naks} NAK",
            f"{self.unanswered} unanswered",
            f"{self.garbage} garbage",
            f"{self.collisions} collisions",
        ]
        if self.reports:
            told.append(f"{self.reports} reports")
        if self.missed:
            told.append(f"{self.missed} lines missed")
        if self.ack_delay is not None:
            told.append(f"ACK after {self.ack_delay // US} us (median)")
        told.append(f"line {self.load:.1%} busy")
        return ", ".join(told)
