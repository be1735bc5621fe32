"""What can be said of the last motion of several axes: when each started, and how straight it was.

Owns these two figures. A motion is everything from one rest to the next: several commands without a
gap between them are one. For the start it is each axis's own, for the line that of them all. Times
in ns of bus time, positions in full steps.
"""

from __future__ import annotations

from collections.abc import Mapping

from sacbus.kernel import Ns
from sacbus.trace import RESTS, Track, last_path

__all__ = ["deviation", "first_pulse", "start_skew"]


def first_pulse(track: Track, now: Ns) -> Ns | None:
    """When the first pulse of the last motion up to ``now`` was issued; None if none ever was."""
    begin: Ns | None = None
    rests = True
    for when, state in track.states(0, now + 1):
        if rests and state not in RESTS:
            begin = when
        rests = state in RESTS
    if begin is None:
        return None
    pulses = track.pulses(begin, now + 1)
    return int(pulses[0]) if pulses.size else None


def start_skew(tracks: Mapping[int, Track], now: Ns) -> tuple[Ns, dict[int, Ns]] | None:
    """How far apart the axes' last motions started, and when each; None if one never moved."""
    starts = {node: first_pulse(track, now) for node, track in tracks.items()}
    known = {node: start for node, start in starts.items() if start is not None}
    if len(known) < len(starts):
        return None
    return max(known.values()) - min(known.values()), known


def deviation(tracks: Mapping[int, Track], now: Ns) -> float | None:
    """How far the axes' last motion left the straight line between its two ends, in steps.

    The distance from the line in the space of the axes. The motion is the last one up to ``now``,
    from one instant at which all of them rest to the next. None if nothing moved.
    """
    path = last_path(list(tracks.values()), now + 1)
    return None if path is None else path.worst[0]
