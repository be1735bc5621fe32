"""Pictures of recordings: what they say, and that they are the same file every time."""

from __future__ import annotations

import asyncio
import io
import re
from xml.etree import ElementTree as ET

import matplotlib as mpl
import pytest

from sacbus.bus import BitErrors, Dead
from sacbus.daemon import Configuration, HostedBus
from sacbus.drawing import SHADES
from sacbus.mother import Mother, MotherError, NoAnswer
from sacbus.picture_format import PictureError
from sacbus.trace import Recorder, Recording
from sacbus.trace.plots import HIT, MOST_TALKERS, draw_axes, draw_path
from tests.trace.rig import recorded, two_axes

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def axes() -> Recording:
    return recorded(two_axes)


def drawn(recording: Recording, form: str = "svg") -> bytes:
    file = io.BytesIO()
    draw_axes(recording, file, form)
    return file.getvalue()


def words(picture: bytes) -> list[str]:
    """All that is written in an SVG."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", picture.decode())


def test_each_node_that_moved_and_who_talked_is_named(axes: Recording) -> None:
    said = words(drawn(axes))
    assert {"node 10", "node 11", "RPM", "full steps", "on the line", "mother", "time, s"} <= set(
        said
    )
    assert {"velocity", "position", *SHADES} <= set(said)
    assert any(one.startswith("2 nodes, 2 moved, ") for one in said)
    assert "collided, damaged or missed" not in said


def test_the_states_are_shaded(axes: Recording) -> None:
    for shade in SHADES.values():
        # In the legend, and behind the motion.
        assert drawn(axes).decode().count(shade) > 1


def test_an_instant_may_be_flagged_and_the_time_begin_elsewhere(axes: Recording) -> None:
    file = io.BytesIO()
    draw_axes(axes, file, "svg", since=10**9, flags=[2 * 10**9])
    said = words(file.getvalue())
    assert "not as expected" in said
    (title,) = (one for one in said if "moved" in one)
    (whole,) = (one for one in words(drawn(axes)) if "moved" in one)
    assert title != whole


async def _damaged(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    bus.fault(BitErrors(0.02))
    for _ in range(20):
        try:
            await mother.send(10, "V10")
        except MotherError:
            continue


def test_what_arrived_damaged_is_told_apart() -> None:
    picture = drawn(recorded(_damaged))
    assert "collided, damaged or missed" in words(picture)
    assert picture.decode().count(HIT) > 1
    assert any(one.startswith("2 nodes, none moved") for one in words(picture))


async def _dead(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    bus.fault(Dead(10))
    with pytest.raises(NoAnswer):
        await mother.send(10, "V10")


def test_what_one_node_did_not_hear_is_told_apart_as_well() -> None:
    assert "collided, damaged or missed" in words(drawn(recorded(_dead)))


async def _nothing(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    await asyncio.sleep(1)


def test_a_recording_of_nothing_can_be_drawn() -> None:
    assert "nobody talked" in words(drawn(recorded(_nothing)))


def test_nodes_may_be_chosen(axes: Recording) -> None:
    file = io.BytesIO()
    draw_axes(axes, file, "svg", nodes=(11,))
    said = words(file.getvalue())
    # Node 10 has talked all the same.
    assert said.count("node 11") == 2
    assert said.count("node 10") == 1
    assert any(one.startswith("2 nodes, 2 moved, 1 drawn, ") for one in said)


def test_more_nodes_than_can_be_seen_are_refused() -> None:
    recording = recorded(_nothing, Configuration(nodes=tuple(range(10, 40))))
    with pytest.raises(PictureError, match="expected 12 nodes at most in a picture, got 13"):
        draw_axes(recording, io.BytesIO(), "svg", nodes=range(10, 23))


async def _all_talk(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    for address in range(10, 10 + MOST_TALKERS):
        await mother.send(address, "m20v300")
    await asyncio.sleep(1)


def test_many_talkers_are_one_row_and_of_many_axes_the_title_tells() -> None:
    said = words(drawn(recorded(_all_talk, Configuration(nodes=tuple(range(10, 40))))))
    assert {"mother", "nodes"} <= set(said)
    assert any(one.startswith("30 nodes, 14 moved, 12 drawn, ") for one in said)


def test_of_two_nodes_the_path_is_drawn_and_its_deviation_told(axes: Recording) -> None:
    file = io.BytesIO()
    draw_path(axes, file, "svg", (11, 10))
    said = words(file.getvalue())
    assert {"node 11, full steps", "node 10, full steps", "straight line", "worst"} <= set(said)
    assert any(
        re.match(r"nodes 11 and 10, \d motions: at most \d+\.\d{3} full steps off", one)
        for one in said
    )


def test_a_path_takes_two_nodes_that_are_there_and_have_moved(axes: Recording) -> None:
    with pytest.raises(PictureError, match="expected nodes 10 and 12 on one bus of it, got 10, 11"):
        draw_path(axes, io.BytesIO(), "svg", (10, 12))
    with pytest.raises(PictureError, match="neither of nodes 10 and 11 moved"):
        draw_path(recorded(_nothing), io.BytesIO(), "svg", (10, 11))


@pytest.mark.parametrize("form", ["png", "svg"])
def test_the_same_recording_is_the_same_file_whatever_the_users_settings(
    axes: Recording, form: str
) -> None:
    before = drawn(axes, form)
    with mpl.rc_context({"lines.linestyle": ":", "font.size": 30}):
        assert drawn(recorded(two_axes), form) == before
    if form == "svg":
        ET.fromstring(before)  # noqa: S314 (our own)
