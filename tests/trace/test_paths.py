"""The path of two nodes, and how far it left the straight line."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from sacbus.daemon import HostedBus
from sacbus.mother import Mother
from sacbus.scenario.motion import deviation
from sacbus.trace import Recorder, Track
from sacbus.trace.paths import last_path, off_line, paths
from tests.trace.rig import recorded


async def _bent(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    await mother.send(10, "m200v100s")
    await mother.send(11, "m200v50s")
    await mother.broadcast("y")
    await asyncio.sleep(5)
    await mother.send(10, "m-20v100")
    await asyncio.sleep(5)


@pytest.fixture(scope="module")
def tracks() -> tuple[Track, Track]:
    recording = recorded(_bent)
    return recording.track(10), recording.track(11)


def test_each_motion_is_a_path_from_rest_to_rest(tracks: tuple[Track, Track]) -> None:
    ends = [path.points[:, [0, -1]].tolist() for path in paths(tracks, 0, 10**11)]
    assert ends == [[[0, 200], [0, 200]], [[200, 180], [200, 200]]]


def test_what_is_off_is_what_a_scenario_expects_as_deviation(tracks: tuple[Track, Track]) -> None:
    first, second = paths(tracks, 0, 10**11)
    both = dict(zip((10, 11), tracks, strict=True))
    assert first.worst[0] == pytest.approx(deviation(both, int(first.times[-1])))
    assert first.worst[0] > 10
    # The faster one is x, so the path lies to the right of the line.
    assert first.away.min() == -first.worst[0]
    assert second.worst[0] == 0


def test_only_the_last_motion_counts_as_deviation(tracks: tuple[Track, Track]) -> None:
    both = dict(zip((10, 11), tracks, strict=True))
    assert deviation(both, 10**11) == 0
    last = last_path(tracks, 10**11)
    assert last is not None
    assert last.points[:, [0, -1]].tolist() == [[200, 180], [200, 200]]
    assert last_path(tracks, 1_000) is None


def test_a_motion_that_is_cut_off_is_one_to_there(tracks: tuple[Track, Track]) -> None:
    (cut,) = paths(tracks, 0, 10**9)
    assert cut.times[-1] < 10**9
    assert 0 < cut.points[0, -1] < 200


def test_the_distance_from_a_line_has_a_sign_and_from_a_point_none() -> None:
    line = np.array([[0.0, 3, 3, 6], [0, 1, -1, 0]])
    assert off_line(line).tolist() == [0, 1, -1, 0]
    back = np.array([[0.0, 3, 0], [0, -4, 0]])
    assert off_line(back).tolist() == [0, 5, 0]
    space = np.array([[0.0, 1, 2], [0, 1, 2], [0, 4, 2]])
    assert off_line(space).tolist() == pytest.approx([0, 6**0.5, 0])
