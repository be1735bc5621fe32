"""Steps of what moves: all of them once, however long the stretches are that are looked at."""

from __future__ import annotations

import numpy as np
import pytest

from sacbus.simad import moves
from sacbus.simad.moves import steps_of
from sacbus.simad.steps import joined
from sacbus.trace import Recording
from tests.trace.rig import recorded, two_axes


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(two_axes)


@pytest.mark.parametrize("many", [1, 30, 200_000])
def test_the_steps_of_tracks_are_their_pulses(
    recording: Recording, many: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(moves, "MANY", many)
    tracks = [recording.track(10), recording.track(11)]
    end = recording.end + 1
    parts = [*steps_of(tracks, 0, end)]
    steps = joined(parts)
    steps.check()
    assert all(part.count for part in parts)
    for axis, track in enumerate(tracks):
        times, ways = steps.of_axis(axis)
        assert np.array_equal(times, track.pulses(0, end))
        assert np.array_equal(ways, track.directions(0, end))


def test_what_does_not_move_has_no_steps(recording: Recording) -> None:
    assert [*steps_of([recording.track(10)], 0, 1)] == []
