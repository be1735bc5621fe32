"""Where one node was, at any instant of a recording.

Owns the joints between its segments. A segment counts from its ``since`` on; what happens at the
very instant at which the next one begins belongs to both, and is counted once: the pulses of a
segment are those after its ``since``, up to and with the instant of the next. A difference of the
two positions at that instant is what came of nothing that went before: the first pulse of a command
that follows without a gap, or single pulses.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.kernel import US, Ns
from sacbus.movement import Segment
from sacbus.trace.records import NodeOf

if TYPE_CHECKING:
    from sacbus.movement import Times

__all__ = ["Track"]

_SINCE: Final = attrgetter("since")

#: Later than every instant.
FOR_EVER: Final[Ns] = 1 << 62


class Track:
    """The segments of a node, and what follows from them; in the order of time.

    What is asked about instants before the first segment is answered as for its beginning.
    """

    def __init__(self, node: NodeOf) -> None:
        self.node = node
        self.segments: list[Segment] = []

    def segment(self, at: Ns) -> Segment:
        """How it moved at an instant; of several that began then the last. IndexError: never."""
        return self.segments[max(bisect_right(self.segments, at, key=_SINCE) - 1, 0)]

    def position(self, at: Ns) -> int:
        """Pulses from where the node was switched on, all those issued until ``at`` included."""
        return self.segment(at).position(at)

    def steps(self, at: Ns) -> float:
        """The same in full steps."""
        return self.segment(at).steps(at)

    def rotor(self, at: Ns) -> float:
        """Where the motor stood in full steps; it may have stalled."""
        return self.segment(at).rotor(at)

    def rpm(self, at: Ns) -> float:
        """Velocity, signed."""
        return self.segment(at).rpm(at)

    def state(self, at: Ns) -> str:
        """The node's state."""
        return self.segment(at).state(at)

    def command(self, at: Ns) -> str:
        """The command that ran, or was about to; empty when none did."""
        segment = self.segment(at)
        return "" if segment.end is not None and at >= segment.end else segment.command

    def levels(self, at: Ns) -> Mapping[str, int]:
        """Levels of the outputs that follow from how it moved."""
        return self.segment(at).levels(at)

    def states(self, since: Ns = 0, until: Ns = FOR_EVER) -> Iterator[tuple[Ns, str]]:
        """Each change of state in [since, until), with what it changed to."""
        last = ""
        for number, segment in enumerate(self.segments):
            following = self._follows(number)
            for when, state in segment.states():
                if when >= following or when >= until:
                    break
                if state != last and when >= since:
                    yield when, state
                last = state

    def pulses(self, since: Ns, until: Ns) -> Times:
        """When pulses were issued in [since, until), rising: ns, int64. Single ones count too."""
        return _joined([times for times, _ in self._parts(since, until)])

    def edges(self, since: Ns, until: Ns) -> tuple[Times, Times]:
        """When clk rises, with each of :meth:`pulses`, and when it falls again after each.

        Of single pulses nobody knows more than the instant at which they were asked for: they are
        shown from then on, one after the other, a microsecond each and a microsecond apart.
        """
        rises, falls = [], []
        for number, low, high in self._windows(since, until):
            segment = self.segments[number]
            if segment.since >= since and (jump := abs(self._jump(number))):
                # The first pulse of a command that follows without a gap is no single one.
                if segment.started == segment.since:
                    rises.append(np.array([segment.since], dtype=np.int64))
                    falls.append(segment.pulse_ends(segment.since, segment.since + 1))
                    jump -= 1
                single = segment.since + 2 * US * np.arange(jump, dtype=np.int64)
                rises.append(single)
                falls.append(single + US)
            rises.append(segment.pulse_times(low, high))
            falls.append(segment.pulse_ends(low, high))
        return _joined(rises), _joined(falls)

    def forget(self, until: Ns) -> None:
        """Keep only what tells of instants from ``until`` on; for who goes through a long one."""
        del self.segments[: max(bisect_left(self.segments, until, key=_SINCE) - 1, 0)]

    def directions(self, since: Ns, until: Ns) -> Times:
        """For each of :meth:`pulses` +1 where it turned clockwise, else -1."""
        parts = self._parts(since, until)
        return _joined([np.full(times.size, sign, dtype=np.int64) for times, sign in parts])

    def _parts(self, since: Ns, until: Ns) -> Iterator[tuple[Times, int]]:
        """Pulses that are of one direction each, with it."""
        for number, low, high in self._windows(since, until):
            segment = self.segments[number]
            if segment.since >= since and (jump := self._jump(number)):
                yield np.full(abs(jump), segment.since, dtype=np.int64), 1 if jump > 0 else -1
            times = segment.pulse_times(low, high)
            if times.size:
                yield times, 1 if segment.position(high - 1) > segment.position(low - 1) else -1

    def _windows(self, since: Ns, until: Ns) -> Iterator[tuple[int, Ns, Ns]]:
        """The segments that say something of [since, until), by number, and of which part of it."""
        # Those that began at the same instant have their joints there.
        first = max(bisect_left(self.segments, since, key=_SINCE) - 1, 0)
        for number in range(first, len(self.segments)):
            began = self.segments[number].since
            if began >= until:
                return
            yield number, max(since, began + 1), min(until, self._follows(number) + 1)

    def _jump(self, number: int) -> int:
        """Pulses at the instant at which a segment begins that came of nothing before, signed."""
        segment = self.segments[number]
        if number == 0 or segment.anew:
            return 0
        return segment.position(segment.since) - self.segments[number - 1].position(segment.since)

    def _follows(self, number: int) -> Ns:
        """When the next segment begins."""
        following = number + 1
        return self.segments[following].since if following < len(self.segments) else FOR_EVER


def _joined(parts: list[Times]) -> Times:
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)
