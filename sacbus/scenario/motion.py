"""What can be said of the last motion of several axes: when each started, and how straight it was.

Owns these two figures. A motion is everything from one rest to the next: several commands without a
gap between them are one. Times in ns of bus time, positions in full steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from sacbus.kernel import Ns
from sacbus.trace import Track

__all__ = ["deviation", "first_pulse", "start_skew"]

#: States in which a motor stands, whatever the kind. SYNC: held, and not begun.
_RESTS: Final = frozenset({"STANDBY", "SYNC", "BOOT", "OFF"})


def first_pulse(track: Track, now: Ns) -> Ns | None:
    """When the first pulse of the last motion up to ``now`` was issued; None if none ever was."""
    begin: Ns | None = None
    rests = True
    for when, state in track.states(0, now + 1):
        if rests and state not in _RESTS:
            begin = when
        rests = state in _RESTS
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
    """How far the axes' last motions left the straight line between their two ends, in steps.

    The distance from the line in the space of the axes, at each pulse; the motion that began last
    is looked at, with what the others did from the first pulse of any on. None if nothing moved.
    """
    starts = [first_pulse(track, now) for track in tracks.values()]
    begun = [start for start in starts if start is not None]
    if not begun:
        return None
    begin = min(begun)
    pulses = [track.pulses(begin, now + 1) for track in tracks.values()]
    times = np.unique(np.concatenate(pulses))
    points = np.array(
        [
            [track.steps(begin - 1), *(track.steps(int(when)) for when in times)]
            for track in tracks.values()
        ]
    )
    away = points - points[:, :1]
    line = away[:, -1]
    length = float(np.sqrt(line @ line))
    if length == 0:
        return float(np.sqrt((away**2).sum(axis=0)).max())
    along = (line @ away) / length
    across = (away**2).sum(axis=0) - along**2
    return float(np.sqrt(np.maximum(across, 0)).max())
