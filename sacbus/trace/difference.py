"""Two recordings of what should be the same, compared within tolerances.

Owns what counts as a difference. Compared are what was said on each bus, and each node's states and
positions; not compared is what decides on none of these: reports, marks, collisions by themselves.
Sequences are walked side by side (``alignment.py``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sacbus.kernel import Ns
from sacbus.trace.alignment import NOTHING, Entry, walk
from sacbus.trace.packets import Packet, packets
from sacbus.trace.reading import Recording
from sacbus.trace.track import Track

__all__ = ["Difference", "differences"]

#: Bus time that positions are compared for at once.
SPELL: Final[Ns] = 10_000_000_000


@dataclass(frozen=True, slots=True)
class Difference:
    """``expected`` is the first recording's; ``node`` None: it is about the line."""

    when: Ns
    bus: str
    node: int | None
    what: str
    expected: str
    got: str

    def __str__(self) -> str:
        who = "" if self.node is None else f", node {self.node}"
        seconds = f"{self.when // 10**9}.{self.when % 10**9:09d}"
        return (
            f"{seconds} s, {self.bus}{who}: {self.what}: expected {self.expected}, got {self.got}"
        )


def differences(
    expected: Recording, got: Recording, *, within: Ns = 0, steps: float = 0.0
) -> list[Difference]:
    """Where ``got`` differs, in the order of time; of a node's positions only the first.

    within: ns by which an instant may differ. steps: full steps by which a position may.
    """
    names = [[bus.name for bus in each.buses] for each in (expected, got)]
    if names[0] != names[1]:
        return [Difference(0, "recording", None, "buses", _listed(names[0]), _listed(names[1]))]
    nodes = [
        [f"{names[0][one.bus]}.{one.address} ({one.kind})" for one in each.nodes]
        for each in (expected, got)
    ]
    if nodes[0] != nodes[1]:
        return [Difference(0, "recording", None, "nodes", _listed(nodes[0]), _listed(nodes[1]))]
    found = list(_of_alike(expected, got, within, steps))
    found.sort(key=lambda one: one.when)  # stable: bus by bus, node by node
    return found + _of_ends(expected, got, within, alike=not found)


def _of_ends(expected: Recording, got: Recording, within: Ns, *, alike: bool) -> list[Difference]:
    """One that was killed has less to say, and all that it says may be right.

    When they end is told only of those that are ``alike`` until then.
    """
    ends = (expected.end, got.end)
    told = ["closed" if each.whole else "cut off" for each in (expected, got)]
    if told[0] == told[1]:
        if not alike or abs(ends[0] - ends[1]) <= within:
            return []
        told = [f"{end / 1e9:.9f} s" for end in ends]
    return [Difference(min(ends), "recording", None, "its end", *told)]


def _of_alike(
    expected: Recording, got: Recording, within: Ns, steps: float
) -> Iterator[Difference]:
    for bus in expected.buses:
        said = [
            [_entry(one) for one in packets(bus, each) if one.sent.bus == bus.number]
            for each in (expected, got)
        ]
        for when, one, other in walk(said[0], said[1], within):
            yield Difference(when, bus.name, None, "packet", one, other)
    ends = (expected.end, got.end)
    over = min(ends)
    for node in expected.nodes:
        name = expected.buses[node.bus].name
        tracks = [each.track(node.address, node.bus) for each in (expected, got)]
        if not (tracks[0].segments and tracks[1].segments):
            for when, one, other in _began(tracks[0], tracks[1]):
                yield Difference(when, name, node.address, "motion", one, other)
            continue
        # What comes late enough may do so behind the end of the other recording.
        states = [
            [Entry(when, state) for when, state in track.states(0, min(end, over + within) + 1)]
            for track, end in zip(tracks, ends, strict=True)
        ]
        for when, one, other in walk(states[0], states[1], within):
            unmet = [end for words, end in zip((one, other), ends, strict=True) if words == NOTHING]
            if all(when + within <= end for end in unmet):
                yield Difference(when, name, node.address, "state", one, other)
        apart = _parting(tracks[0], tracks[1], over, within, steps)
        if apart is not None:
            places = [f"{track.steps(apart):g} steps" for track in tracks]
            yield Difference(apart, name, node.address, "position", *places)


def _began(expected: Track, got: Track) -> Iterator[tuple[Ns, str, str]]:
    """Of two nodes of which one at least tells nothing: when the other began to."""
    words = [
        f"told from {track.segments[0].since} ns on" if track.segments else NOTHING
        for track in (expected, got)
    ]
    if words[0] != words[1]:
        (told,) = (track for track in (expected, got) if track.segments)
        yield told.segments[0].since, words[0], words[1]


def _entry(packet: Packet) -> Entry:
    said = packet.said
    sender = f"{packet.sent.sender}" if said.source is None else f"{said.source}"
    to = "" if said.destination is None else f">{said.destination}"
    check = f", check {said.verdict}" if said.verdict not in ("", "right") else ""
    data = f" {said.data.hex()}" if said.kind == "garbage" else ""
    body = said.data.decode("latin-1") if said.kind == "packet" else said.words
    return Entry(packet.start, f"{sender}{to} {body!r}{data}{check}")


def _parting(expected: Track, got: Track, over: Ns, within: Ns, steps: float) -> Ns | None:
    """The first instant at which two nodes are further apart than both tolerances allow.

    Pulses are compared one by one where both have as many, each as far off as it may be; else
    positions, at every pulse of either.
    """
    for since in range(0, over + 1, SPELL):
        until = min(since + SPELL, over + 1)
        if _alike(expected, got, since, until, within):
            continue
        pulses = np.concatenate([track.pulses(since, until) for track in (expected, got)])
        turns = [segment.since for track in (expected, got) for segment in track.segments]
        places = np.unique(np.concatenate([pulses, [one for one in turns if since <= one < until]]))
        for place in places.astype(np.int64).tolist():
            if _apart(expected, got, place, within, steps):
                return int(place)
    return None


def _alike(expected: Track, got: Track, since: Ns, until: Ns, within: Ns) -> bool:
    if expected.steps(since) != got.steps(since):
        return False
    ours, theirs = expected.pulses(since, until), got.pulses(since, until)
    return (
        ours.size == theirs.size
        and bool(np.all(np.abs(ours - theirs) <= within))
        and np.array_equal(expected.directions(since, until), got.directions(since, until))
        and expected.steps(until - 1) == got.steps(until - 1)
    )


def _apart(expected: Track, got: Track, at: Ns, within: Ns, steps: float) -> bool:
    """Whether one is somewhere that the other is at no instant that is near enough."""
    instants = (at - within, at, at + within)

    def reached(track: Track, target: float) -> bool:
        places = [track.steps(one) for one in instants]
        return min(places) - steps <= target <= max(places) + steps

    return not (reached(got, expected.steps(at)) and reached(expected, got.steps(at)))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or NOTHING
