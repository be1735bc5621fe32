"""One lane's bytes with their times, and the events that stand in them.

Owns the way from a decoder's places back to times: every stretch of bytes is kept until the decoder
has decided all of it. A decoder holds a bounded number of bytes, so few are kept.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from sacbus.kernel import LineRate, Ns
from sacbus.node import Protocol, Said

__all__ = ["Event", "Stream", "Stretch"]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Bytes that followed each other without a pause, from ``start`` to ``end``.

    ``hits``: from when to when others talked over them. ``squeezed``: they came in less time than
    the line takes for them, so they had waited somewhere, and may have begun before ``start``.
    ``ninth``: a 0 or 1 for each of them, where that is known.
    """

    start: Ns
    end: Ns
    data: bytes
    sender: str | None = None
    hits: Sequence[tuple[Ns, Ns]] = ()
    squeezed: bool = False
    ninth: bytes | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """What bytes say, and when they were said, by whom.

    ``spoilt``: others talked over some of them, and all of them were in such a transmission.
    ``began_in``, ``ended_in``: the stretches of its first and its last byte.
    """

    said: Said
    start: Ns
    end: Ns
    raw: bytes
    sender: str | None
    spoilt: bool
    began_in: Stretch
    ended_in: Stretch


class Stream:
    """A lane as its listener hears it."""

    def __init__(self, protocol: Protocol, rate: LineRate, lane: int = 0) -> None:
        self._protocol = protocol
        self._rate = rate
        self._lane = lane
        self._decoder = protocol.decoder(lane)
        #: Stretches with the number of their first byte, counted from the lane's first.
        self._kept: deque[tuple[int, Stretch]] = deque()
        self._count = 0

    @property
    def pending(self) -> bytes:
        """Bytes that are not decided yet."""
        return self._decoder.pending

    @property
    def unfinished(self) -> bool:
        """Whether these may yet become a packet."""
        return self._decoder.unfinished

    def hear(self, stretch: Stretch) -> list[Event]:
        """What these bytes complete."""
        first = self._count
        self._kept.append((first, stretch))
        self._count += len(stretch.data)
        tell = self._protocol.tell
        events = [
            self._event(tell(event), first + begin, first + end)
            for event, begin, end in self._decoder.locate(stretch.data, stretch.ninth)
        ]
        undecided = self._count - len(self._decoder.pending)
        kept = self._kept
        while kept and kept[0][0] + len(kept[0][1].data) <= undecided:
            kept.popleft()
        return events

    def give_up(self, words: str) -> Event | None:
        """What is pending, as garbage in these words: nothing more of it will come."""
        pending = self._decoder.pending
        event = None
        if pending:
            said = Said("garbage", None, None, pending, words, "", len(pending))
            event = self._event(said, self._count - len(pending), self._count)
        self.forget()
        return event

    def forget(self) -> None:
        """Begin anew: what comes next does not follow what came before."""
        self._decoder = self._protocol.decoder(self._lane)
        self._kept.clear()

    def _event(self, said: Said, begin: int, end: int) -> Event:
        parts = [
            (stretch, max(begin - first, 0), min(end - first, len(stretch.data)))
            for first, stretch in self._kept
            if first < end and begin < first + len(stretch.data)
        ]
        head, low, _ = parts[0]
        tail, _, high = parts[-1]
        return Event(
            said,
            self._time(head, low),
            self._time(tail, high),
            b"".join(stretch.data[a:b] for stretch, a, b in parts),
            head.sender,
            all(stretch.hits for stretch, _, _ in parts)
            and any(self._is_hit(stretch, a, b) for stretch, a, b in parts),
            head,
            tail,
        )

    def _is_hit(self, stretch: Stretch, low: int, high: int) -> bool:
        begin, end = self._time(stretch, low), self._time(stretch, high)
        return any(a < end and begin < b for a, b in stretch.hits)

    def _time(self, stretch: Stretch, index: int) -> Ns:
        """When byte ``index`` began, and the one before it had ended."""
        span = self._rate.span
        size = len(stretch.data)
        if span(size) == stretch.end - stretch.start:
            return stretch.start + span(index)
        # Squeezed: evenly, for want of anything better.
        return stretch.start + (stretch.end - stretch.start) * index // size
