"""Look-ahead: velocities that every stretch, corner and axis of a block bears."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf, pi, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.toolpath import Axis, Law, Machine, PathItem, Phase, Straight
from sacbus.toolpath.corner import Corner, corner_of
from sacbus.toolpath.lookahead import has_room, law_of, must_rest
from sacbus.toolpath.piece import pieces
from sacbus.toolpath.stretch import Stretch, stretches
from tests.toolpath.paths import XYZ, circle, straights, wanderings

Block = tuple[list[Stretch], list[Corner]]


def block(items: Sequence[PathItem], on: Machine = XYZ) -> Block:
    """All stretches of a path as one block, whatever its corners."""
    found = [one for one in stretches(pieces(items, on, -1), on) if isinstance(one, Stretch)]
    return found, [corner_of(on.axes, *two) for two in pairwise(found)]


def through(*points: tuple[float, float, float], feed: float | None = 30.0) -> Block:
    return block(list(straights(points, feed)))


def ends(law: Law, segment: int) -> tuple[float, float]:
    """The velocities at which a segment is entered and left."""
    phases = [phase for phase in law if phase.segment == segment]
    return phases[0].v0, phases[-1].v1


# ------------------------------------------------------------------------ worked examples


def test_a_long_line_is_a_trapezoid() -> None:
    ((stretch,), _) = through((10, 0, 0))
    law = law_of(XYZ.axes, [stretch], [])
    # 50 rad/s2 at 400 steps a mm and 200 a revolution: 25 / 2 pi mm/s2.
    up = 0.5 / (25 / 2 / pi)
    assert [(phase.v0, phase.v1) for phase in law] == [(0, 0.5), (0.5, 0.5), (0.5, 0)]
    assert [phase.seconds for phase in law] == pytest.approx([up, (10 - up * 0.5) / 0.5, up])


def test_a_line_too_short_for_its_feed_leaves_a_fifth_for_its_ramps_to_meet_in() -> None:
    ((stretch,), _) = through((0.05, 0, 0))
    law = law_of(XYZ.axes, [stretch], [])
    assert len(law) == 3
    assert law[1].end - law[1].begin == pytest.approx(0.2)
    assert law[0].v1 == law[1].v0 == law[2].v0 == pytest.approx(sqrt(0.8 * 0.05 * 25 / 2 / pi))


def test_a_few_steps_are_run_at_the_velocity_of_a_start() -> None:
    ((stretch,), _) = through((0.02, 0, 0))
    pace = stretch.start
    assert law_of(XYZ.axes, [stretch], []) == (Phase(0, 0.0, 1.0, 0.02 / pace, pace, pace),)


def test_a_line_of_a_feed_that_axes_start_at_needs_no_ramp() -> None:
    ((stretch,), _) = through((10, 0, 0), feed=4)
    assert [(phase.v0, phase.v1) for phase in law_of(XYZ.axes, [stretch], [])] == [(4 / 60, 4 / 60)]


def test_a_shallow_corner_between_long_lines_is_passed_at_full_feed() -> None:
    law = law_of(XYZ.axes, *through((10, 0, 0), (20, 1, 0)))
    assert [phase.v1 for phase in law] == [0.5, 0.5, 0.5, 0]


def test_long_lines_come_down_to_what_their_corner_allows() -> None:
    stretches_, corners = through((10, 0, 0), (19, 5, 0))
    law = law_of(XYZ.axes, stretches_, corners)
    assert ends(law, 0)[1] == ends(law, 1)[0] == pytest.approx(corners[0].through)
    assert max(phase.v1 for phase in law) == 0.5


def test_the_chords_of_a_circle_are_run_at_one_velocity_each() -> None:
    found, corners = block(list(straights(circle(10, 72), feed=60)))
    law = law_of(XYZ.axes, found, corners)
    inner = [phase.segment for phase in law if 0 < phase.segment < 71]
    assert inner == list(range(1, 71))


def test_tiny_stretches_gain_velocity_by_what_axes_bear_at_once() -> None:
    found, corners = through(*((0.02 * i, 0, 0) for i in range(1, 31)))
    paces = [phase.v0 for phase in law_of(XYZ.axes, found, corners)]
    assert paces == pytest.approx(paces[::-1])
    assert paces[:4] == pytest.approx([found[0].start * i for i in range(1, 5)])


def test_a_low_acceleration_holds_tiny_stretches_back() -> None:
    gentle = Machine(XYZ.axes, rapid=45, feed=30, acceleration=2)
    path = list(straights((0.02 * i, 0, 0) for i in range(1, 31)))
    slow, fast = law_of(XYZ.axes, *block(path, gentle)), law_of(XYZ.axes, *block(path))
    assert max(phase.v0 for phase in slow) < max(phase.v0 for phase in fast)


def test_a_cap_holds_everywhere() -> None:
    law = law_of(XYZ.axes, *through((10, 0, 0), (20, 1, 0)), cap=0.3)
    assert max(phase.v1 for phase in law) == 0.3


# ------------------------------------------------------------------------ rests


@pytest.mark.parametrize(
    ("second", "rests"),
    [((20, 1, 0), False), ((19, 5, 0), False), ((15, 9, 0), True), ((10, 10, 0), True)],
)
def test_the_path_rests_where_long_lines_make_a_sharp_corner(
    second: tuple[float, float, float], rests: bool
) -> None:
    (one, two), (corner,) = through((10, 0, 0), second)
    assert must_rest(one, corner, two) is rests


def test_tiny_stretches_turn_corners_without_a_rest() -> None:
    (one, two), (corner,) = through((0.02, 0, 0), (0.02, 0.02, 0))
    assert not must_rest(one, corner, two)


def test_no_rest_is_needed_at_a_feed_that_any_corner_bears() -> None:
    (one, two), (corner,) = through((10, 0, 0), (10, 10, 0), feed=4)
    assert not must_rest(one, corner, two)
    assert [phase.v0 for phase in law_of(XYZ.axes, [one, two], [corner])] == [4 / 60, 4 / 60]


# ------------------------------------------------------------------------ properties


def check(found: list[Stretch], law: Law, cap: float, axes: Sequence[Axis]) -> None:
    """Hold a law against everything that was asked of it."""
    close = 1 + 1e-4
    for segment, stretch in enumerate(found):
        phases = [phase for phase in law if phase.segment == segment]
        assert phases[0].begin == 0
        assert phases[-1].end == 1
        for phase in phases:
            way = (phase.end - phase.begin) * stretch.length
            assert way == pytest.approx(phase.seconds * (phase.v0 + phase.v1) / 2, rel=1e-4)
            assert phase.seconds > 0
            assert max(phase.v0, phase.v1) <= min(stretch.feed, stretch.limit, cap) * close
            if phase.v0 != phase.v1:
                gain = abs(phase.v1 - phase.v0) / phase.seconds
                assert gain <= stretch.acceleration * close
        for one, two in pairwise(phases):
            assert one.end == two.begin
            for axis, rate in zip(axes, stretch.rates, strict=True):
                assert abs(one.v1 - two.v0) * abs(rate) <= axis.jump * close
    for i, (stretch, following) in enumerate(pairwise(found)):
        before, after = ends(law, i)[1], ends(law, i + 1)[0]
        for axis, rate, then in zip(axes, stretch.rates, following.rates, strict=True):
            assert abs(before * rate - after * then) <= axis.jump * close
    assert ends(law, 0)[0] <= found[0].start * close
    assert ends(law, len(found) - 1)[1] <= found[-1].start * close


@pytest.mark.slow
@given(wanderings(), st.one_of(st.just(inf), st.floats(0.01, 1)))
def test_every_law_keeps_to_feeds_limits_accelerations_and_jumps(
    items: list[PathItem], cap: float
) -> None:
    found, corners = block(items)
    if found:
        check(found, law_of(XYZ.axes, found, corners, cap), cap, XYZ.axes)


@pytest.mark.slow
@given(st.lists(st.tuples(*(st.integers(-9, 9) for _ in range(3))), min_size=2, max_size=40))
def test_paths_of_a_few_steps_keep_to_the_jumps(ways: list[tuple[int, int, int]]) -> None:
    at, items = [0, 0, 0], []
    for way in ways:
        at = [here + by for here, by in zip(at, way, strict=True)]
        items.append(Straight(tuple(here / 400 for here in at), 45))
    found, corners = block(items)
    if found:
        check(found, law_of(XYZ.axes, found, corners), inf, XYZ.axes)


@pytest.mark.slow
@given(wanderings(), st.floats(0.02, 1), st.floats(1, 3))
def test_a_path_never_takes_longer_at_a_higher_cap(
    items: list[PathItem], cap: float, more: float
) -> None:
    found, corners = block(items)
    if found and not any(map(has_room, found)):
        slow, fast = (
            sum(phase.seconds for phase in law_of(XYZ.axes, found, corners, limit))
            for limit in (cap, cap * more)
        )
        assert fast <= slow * (1 + 1e-6)
