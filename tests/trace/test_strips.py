"""What a picture of a recording is drawn through: little enough to draw, with nothing cut off."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import numpy as np
import pytest

from sacbus.daemon import Configuration, HostedBus
from sacbus.kernel import MS, SECOND
from sacbus.mother import Mother
from sacbus.trace import Recorder, Recording
from sacbus.trace.records import Sent
from sacbus.trace.strips import COLUMNS, MOST_NODES, Ticks, curve, stretches, strips_of
from tests.trace.rig import recorded, two_axes


@pytest.fixture(scope="module")
def axes() -> Recording:
    return recorded(two_axes)


def test_a_curve_has_the_values_of_its_track_and_all_its_extremes(axes: Recording) -> None:
    strips = strips_of(axes)
    for node, track in strips.tracks.items():
        times, rpm, steps = curve(track, strips.first, strips.last)
        true = axes.track(node[1])
        assert steps.tolist() == [true.steps(int(when)) for when in times]
        every = range(strips.first, strips.last, MS)
        assert rpm.max() >= max(true.rpm(when) for when in every)
        assert rpm.min() <= min(true.rpm(when) for when in every)
        assert steps.max() == max(true.steps(when) for when in every)
        assert steps.min() == min(true.steps(when) for when in every)
        # Joined by straight lines it is the motion, to a step.
        between = np.interp(np.array(every), times, steps)
        assert max(abs(between - [true.steps(when) for when in every])) <= 1


def test_stretches_of_all_states_are_the_whole_time(axes: Recording) -> None:
    strips = strips_of(axes)
    found = stretches(strips.tracks[0, 10], strips.first, strips.last)
    assert sum(length for spans in found.values() for _, length in spans) == (
        strips.last - strips.first
    )
    assert {"ACCEL", "CRUISE", "DECEL", "STANDBY", "OFF", "BOOT"} <= set(found)


def test_who_talked_is_there_programs_first(axes: Recording) -> None:
    strips = strips_of(axes)
    assert list(strips.talks) == [(0, "mother"), (0, 10), (0, 11)]
    sent = [one for one in axes if isinstance(one, Sent)]
    assert sum(len(talk.whole.starts) for talk in strips.talks.values()) == len(sent)
    assert not any(talk.hit.starts for talk in strips.talks.values())


async def _many_short_ones(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    # One is by far the fastest, and the position goes out and comes back within it.
    for _ in range(300):
        await mother.send(10, "m3v60")
        await mother.send(10, "m-3v60")
        await asyncio.sleep(0.2)
    await mother.send(10, "m50v400a99d99")
    await asyncio.sleep(1)
    await mother.send(10, "m-50v400a99d99")
    await asyncio.sleep(500)


@pytest.mark.slow
def test_of_a_long_recording_each_column_keeps_its_extremes() -> None:
    recording = recorded(_many_short_ones, Configuration(nodes=(10,)))
    strips = strips_of(recording)
    track = strips.tracks[0, 10]
    times, rpm, steps = curve(track, strips.first, strips.last)
    assert times.size <= 6 * COLUMNS
    assert (np.diff(times) >= 0).all()
    assert rpm.max() == pytest.approx(400, abs=1)
    assert rpm.min() == pytest.approx(-400, abs=1)
    assert steps.max() == 50
    column = (strips.last - strips.first) // COLUMNS
    for spans in stretches(track, strips.first, strips.last).values():
        for (begin, length), (following, _) in pairwise(spans):
            assert following - begin - length > column


def test_of_ticks_in_one_column_the_longest_is_drawn() -> None:
    ticks = Ticks()
    for number in range(100_000):
        ticks.starts.append(number * MS)
        ticks.ends.append(number * MS + (MS if number == 4_321 else 1))
    spread = ticks.spread(0, 100 * SECOND)
    assert len(spread) == COLUMNS
    assert (4_321 * MS, MS) in spread


async def _all_move(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    for address in range(10, 30):
        await mother.send(address, "m20v300")
    await asyncio.sleep(1)


def test_of_many_nodes_those_are_drawn_that_moved_first() -> None:
    strips = strips_of(recorded(_all_move, Configuration(nodes=tuple(range(10, 40)))))
    assert strips.moved == 20
    assert list(strips.tracks) == [(0, address) for address in range(10, 10 + MOST_NODES)]


def test_others_are_drawn_where_they_are_asked_for() -> None:
    recording = recorded(_all_move, Configuration(nodes=tuple(range(10, 40))))
    strips = strips_of(recording, wanted=(29, 35))
    assert strips.moved == 20
    assert list(strips.tracks) == [(0, 29), (0, 35)]
