"""A recording as what a picture of it is drawn through: points, stretches and ticks.

Owns how much of it that is, however long it is: about as much as a picture has columns of pixels,
with the highest and lowest of each column kept. Goes through the recording once, and keeps of the
nodes only those that are drawn. Knows nothing of drawing. Times in ns of bus time.
"""

from __future__ import annotations

from array import array
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.kernel import Ns
from sacbus.trace.reading import Recording
from sacbus.trace.records import Moved, Sent
from sacbus.trace.track import Track

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Times = NDArray[np.int64]

__all__ = ["MOST_NODES", "Strips", "Talk", "Ticks", "curve", "stretches", "strips_of"]

#: Axes that are drawn; of more, those that moved first.
MOST_NODES: Final = 12

#: What a picture has columns of pixels for.
COLUMNS: Final = 1_500

#: Points of a ramp at most, and in all ramps of a long picture together.
RAMP: Final = 32
RAMPS: Final = 24_000

#: States that last for a while, in which the velocity changes all the time.
_RAMPS: Final = frozenset({"ACCEL", "DECEL"})

Node = tuple[int, int]
"""The number of the bus, and the address."""


@dataclass(slots=True)
class Ticks:
    """Transmissions of one talker: when each began, and when it was over."""

    starts: array[int] = field(default_factory=lambda: array("q"))
    ends: array[int] = field(default_factory=lambda: array("q"))

    def add(self, sent: Sent) -> None:
        """One more; they come in the order in which they ended."""
        self.starts.append(sent.start)
        self.ends.append(sent.end)

    def spread(self, first: Ns, last: Ns) -> list[tuple[Ns, Ns]]:
        """As (start, length), of those that begin in one column of the picture only the longest."""
        starts = np.array(self.starts, dtype=np.int64)
        lengths = np.array(self.ends, dtype=np.int64) - starts
        columns = (starts - first) * COLUMNS // max(last - first, 1)
        # The longest of a column comes first, and the first of each is what unique() finds.
        order = np.lexsort((-lengths, columns))
        _, places = np.unique(columns[order], return_index=True)
        chosen = order[places]
        return list(zip(starts[chosen].tolist(), lengths[chosen].tolist(), strict=True))


@dataclass(slots=True)
class Talk:
    """What one talker sent: all of it, and what did not arrive as it was sent, at whomever."""

    whole: Ticks = field(default_factory=Ticks)
    hit: Ticks = field(default_factory=Ticks)


@dataclass(slots=True)
class Strips:
    """A recording from ``first`` to ``last``: the nodes that moved, and who talked.

    ``moved``: how many moved; of them the first ones are in ``tracks``, or those wanted. The
    talkers are called as in the records, by bus.
    """

    first: Ns
    last: Ns
    moved: int
    tracks: dict[Node, Track]
    talks: dict[tuple[int, int | str], Talk]


def strips_of(
    recording: Recording, since: Ns | None = None, wanted: Collection[int] = ()
) -> Strips:
    """Go through a recording; ``since``: from when on it is drawn, or else its first record.

    ``wanted``: addresses of the nodes that are drawn, whether they moved or not.
    """
    resting = {(node.bus, node.address): Track(node) for node in recording.nodes}
    tracks = {node: track for node, track in resting.items() if node[1] in wanted}
    moved: set[Node] = set()
    talks: dict[tuple[int, int | str], Talk] = {}
    for record in recording:
        if since is None:
            since = record.when
        if type(record) is Sent and record.start >= since:
            talk = talks.setdefault((record.bus, record.sender), Talk())
            talk.whole.add(record)
            if record.collided or record.arrived != record.data or record.missed or record.heard:
                talk.hit.add(record)
        elif type(record) is Moved:
            node = record.bus, record.node
            track = resting[node]
            track.segments.append(record.segment)
            if node not in moved and _moves(track):
                moved.add(node)
                if not wanted and len(tracks) < MOST_NODES:
                    tracks[node] = track
            if node not in tracks:
                del track.segments[:-1]
    first = since or 0
    last = max(recording.end, first + 1)
    return Strips(first, last, len(moved), dict(sorted(tracks.items())), dict(_in_order(talks)))


def _moves(track: Track) -> bool:
    """Whether the last segment moves the node, or single pulses came before it."""
    now = track.segments[-1]
    if now.started is not None:
        return True
    before = track.segments[:-1]
    return bool(
        before and not now.anew and before[-1].position(now.since) != now.position(now.since)
    )


def _in_order(
    talks: dict[tuple[int, int | str], Talk],
) -> Iterator[tuple[tuple[int, int | str], Talk]]:
    """Programs first, in the order in which they spoke, then nodes by their addresses."""
    yield from (one for one in talks.items() if isinstance(one[0][1], str))
    nodes = [(bus, who) for bus, who in talks if isinstance(who, int)]
    yield from ((node, talks[node]) for node in sorted(nodes))


def curve(track: Track, first: Ns, last: Ns) -> tuple[Times, Floats, Floats]:
    """Instants from ``first`` to ``last``, with RPM and full steps at each, to be joined."""
    spans = list(_spans(track, first, last))
    ramps = sum(state in _RAMPS for *_, state in spans)
    followed = min(RAMP, max(3, RAMPS // max(ramps, 1)))
    times: list[Ns] = []
    rpm: list[float] = []
    steps: list[float] = []
    for number, begin, end, state in spans:
        segment = track.segments[number]
        points = followed if state in _RAMPS else 2
        # The last of a span is the instant before it is over: there velocity may jump.
        for place in range(points):
            at = begin + (end - 1 - begin) * place // (points - 1)
            times.append(at)
            rpm.append(segment.rpm(at))
            steps.append(segment.steps(at))
    return _thinned(np.array(times, dtype=np.int64), np.array(rpm), np.array(steps), first, last)


def stretches(track: Track, first: Ns, last: Ns) -> dict[str, list[tuple[Ns, Ns]]]:
    """By state when the node was in it, as (begin, length); gaps too small to see are closed."""
    unseen = (last - first) // COLUMNS
    found: dict[str, list[tuple[Ns, Ns]]] = {}
    for _, begin, end, state in _spans(track, first, last):
        known = found.setdefault(state, [])
        if known and begin - (known[-1][0] + known[-1][1]) <= unseen:
            begin = known.pop()[0]  # noqa: PLW2901 (it goes on)
        known.append((begin, end - begin))
    return found


def _spans(track: Track, first: Ns, last: Ns) -> Iterator[tuple[int, Ns, Ns, str]]:
    """Stretches of one state of one segment, by its number; together all of [first, last)."""
    for number, segment in enumerate(track.segments):
        following = track.segments[number + 1].since if number + 1 < len(track.segments) else last
        end = min(following, last)
        begin = max(segment.since, first) if number else first
        if begin >= end:
            continue
        changes = [when for when, _ in segment.states() if begin < when < end]
        for low, high in zip([begin, *changes], [*changes, end], strict=True):
            if low < high:
                yield number, low, high, segment.state(low)


def _thinned(
    times: Times, rpm: Floats, steps: Floats, first: Ns, last: Ns
) -> tuple[Times, Floats, Floats]:
    """Of each column the first and the last point, and the highest and lowest of both values."""
    if times.size <= 6 * COLUMNS:
        return times, rpm, steps
    columns = (times - first) * COLUMNS // max(last - first, 1)
    edges = np.flatnonzero(np.diff(columns)) + 1
    kept: set[int] = set()
    for low, high in zip([0, *edges.tolist()], [*edges.tolist(), times.size], strict=True):
        kept |= {low, high - 1}
        for values in (rpm[low:high], steps[low:high]):
            kept |= {low + int(values.argmin()), low + int(values.argmax())}
    chosen = np.array(sorted(kept))
    return times[chosen], rpm[chosen], steps[chosen]
