"""The path of nodes as the axes of a space, and how far it left the straight line.

Owns where one motion ends and the next begins: a motion is everything from one instant at which
all of the nodes rest to the next. Each is measured against the straight line between its two ends.
Positions in full steps, times in ns of bus time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.kernel import Ns
from sacbus.trace.track import Track

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Times = NDArray[np.int64]

__all__ = ["RESTS", "Path", "last_path", "off_line", "paths"]

#: States in which a motor stands, whatever the kind. SYNC: held, and not begun.
RESTS: Final = frozenset({"STANDBY", "SYNC", "BOOT", "OFF"})

#: Pulses of a motion that are looked at; of more every second, third... one.
MOST_PULSES: Final = 100_000


@dataclass(frozen=True, slots=True)
class Path:
    """One motion of several nodes: where they were at pulses of any, and before the first.

    ``points``: a row an axis. ``away``: the distance from the line; of two axes positive to its
    left. At each pulse, or of very many at every second, third... and the last.
    """

    times: Times
    points: Floats
    away: Floats

    @property
    def worst(self) -> tuple[float, Ns]:
        """The greatest distance, and when."""
        place = int(np.abs(self.away).argmax())
        return abs(float(self.away[place])), int(self.times[place])


def paths(tracks: Sequence[Track], since: Ns, until: Ns) -> Iterator[Path]:
    """Each motion in [since, until) in which a pulse was issued."""
    for begin, end in _motions(tracks, since, until):
        path = _path(tracks, begin, end)
        if path is not None:
            yield path


def last_path(tracks: Sequence[Track], until: Ns) -> Path | None:
    """The last motion before ``until`` in which a pulse was issued; None if there was none."""
    motions = list(_motions(tracks, 0, until))
    found = (_path(tracks, begin, end) for begin, end in reversed(motions))
    return next((path for path in found if path is not None), None)


def off_line(points: Floats) -> Floats:
    """How far each point lies off the line from the first to the last; in a plane, left positive.

    If these are the same, the distance from there.
    """
    away = points - points[:, :1]
    line = away[:, -1]
    length = float(np.linalg.norm(line))
    if length == 0:
        return np.asarray(np.linalg.norm(away, axis=0))
    if len(points) == 2:
        return np.asarray((line[0] * away[1] - line[1] * away[0]) / length)
    along = (line @ away) / length
    across = (away**2).sum(axis=0) - along**2
    return np.asarray(np.sqrt(np.maximum(across, 0)))


def _path(tracks: Sequence[Track], begin: Ns, end: Ns) -> Path | None:
    pulses = np.unique(np.concatenate([one.pulses(begin, end) for one in tracks]))
    if not pulses.size:
        return None
    thinned = pulses[:: -(-pulses.size // MOST_PULSES)]
    if thinned[-1] != pulses[-1]:
        thinned = np.append(thinned, pulses[-1])
    # Where they stood before the first pulse is the line's beginning.
    times = np.concatenate([[thinned[0] - 1], thinned])
    points = np.array([[one.steps(int(when)) for when in times] for one in tracks])
    return Path(times, points, off_line(points))


def _motions(tracks: Sequence[Track], since: Ns, until: Ns) -> Iterator[tuple[Ns, Ns]]:
    """From when to when any of them did not rest; the last is cut off at ``until``."""
    changes = sorted(
        (when, number, state)
        for number, track in enumerate(tracks)
        for when, state in track.states(since, until)
    )
    rests = [not track.segments or track.state(since) in RESTS for track in tracks]
    begin = None if all(rests) else since
    for when, number, state in changes:
        rests[number] = state in RESTS
        if begin is None and not all(rests):
            begin = when
        elif begin is not None and all(rests):
            yield begin, when
            begin = None
    if begin is not None:
        yield begin, until
