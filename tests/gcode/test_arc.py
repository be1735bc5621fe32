"""Arcs and their chords: never further apart than the tolerance, and exact at both ends."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.gcode.arc import Arc, Point, angle_between, centre_from_radius

figures = st.integers(-100_000, 100_000).map(lambda thousandths: thousandths / 1_000)
angles = st.floats(0.01, math.tau).flatmap(lambda angle: st.sampled_from([angle, -angle]))


@st.composite
def arcs(draw: st.DrawFn) -> Arc:
    """An arc in the second and the fourth of four axes, its ends at slightly different radii."""
    centre = draw(figures), draw(figures)
    radius, begin = draw(st.floats(0.02, 200)), draw(st.floats(-math.pi, math.pi))
    angle = draw(angles)
    last = radius + draw(st.sampled_from([0.0, 0.004, -0.004]))
    start, end = around(centre, radius, begin), around(centre, last, begin + angle)
    return Arc(
        start=(draw(figures), start[0], draw(figures), start[1]),
        to=(draw(figures), end[0], draw(figures), end[1]),
        plane=(1, 3),
        centre=centre,
        angle=angle,
        tolerance=draw(st.sampled_from([0.0005, 0.01, 0.1, 5.0])),
        feed=100.0,
        line=3,
    )


def around(centre: Point, radius: float, angle: float) -> Point:
    return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)


def from_centre(arc: Arc, place: tuple[float, ...]) -> float:
    return math.dist((place[1], place[3]), arc.centre)


@pytest.mark.slow
@given(arcs())
def test_chords_stay_within_the_tolerance_and_end_on_the_arc(arc: Arc) -> None:
    straights = list(arc.straights())
    assert len(straights) == arc.chords
    places = [arc.start, *(straight.to for straight in straights)]
    first, last = arc.radii
    for number, place in enumerate(places):
        on_the_arc = first + (last - first) * number / arc.chords
        assert from_centre(arc, place) == pytest.approx(on_the_arc, abs=1e-9)
    # A rounded arc's chord may lie between two radii: that much more is not the chord's.
    slope = abs(last - first) / arc.chords
    for number, (before, after) in enumerate(pairwise(places)):
        middle = tuple((one + other) / 2 for one, other in zip(before, after, strict=True))
        on_the_arc = first + (last - first) * (number + 0.5) / arc.chords
        assert abs(from_centre(arc, middle) - on_the_arc) <= arc.tolerance + slope + 1e-9


@given(arcs())
def test_the_last_chord_ends_exactly_where_the_arc_does(arc: Arc) -> None:
    *_, last = arc.straights()
    assert last.to == arc.to
    assert (last.feed, last.line) == (arc.feed, arc.line)


@pytest.mark.slow
@given(arcs())
def test_chords_turn_the_way_of_the_arc_by_equal_parts(arc: Arc) -> None:
    places = [arc.start, *(straight.to for straight in arc.straights())]
    turned = [math.atan2(place[3] - arc.centre[1], place[1] - arc.centre[0]) for place in places]
    for before, after in pairwise(turned):
        part = math.remainder(after - before, math.tau)
        assert part == pytest.approx(arc.angle / arc.chords, abs=1e-6)


@pytest.mark.slow
@given(arcs())
def test_the_other_axes_go_along_evenly(arc: Arc) -> None:
    for number, straight in enumerate(arc.straights(), 1):
        for axis in (0, 2):
            even = arc.start[axis] + (arc.to[axis] - arc.start[axis]) * number / arc.chords
            assert straight.to[axis] == pytest.approx(even, abs=1e-9)


@pytest.mark.slow
@given(arcs())
def test_the_length_is_that_of_ever_finer_chords(arc: Arc) -> None:
    fine = Arc(arc.start, arc.to, arc.plane, arc.centre, arc.angle, 1e-5, None, 0)
    places = [arc.start, *(straight.to for straight in fine.straights())]
    added = sum(math.dist(*pair) for pair in pairwise(places))
    # A chord is shorter by a third of its sagitta a radian; a change of radius is not counted in.
    assert added == pytest.approx(arc.length, abs=1e-5 * abs(arc.angle) / 3 + 0.008)


def circle(radius: float, tolerance: float) -> Arc:
    at = (radius, 0.0)
    return Arc(at, at, (0, 1), (0.0, 0.0), math.tau, tolerance, None, 0)


@pytest.mark.parametrize(
    ("radius", "tolerance", "chords"),
    # pi / acos(1 - tolerance / radius), rounded up; never fewer than 4 a circle.
    [(10, 0.01, 71), (10, 0.1, 23), (100, 0.01, 223), (1, 5, 4), (0.001, 0.01, 4)],
)
def test_a_circle_has_no_more_chords_than_it_takes(
    radius: float, tolerance: float, chords: int
) -> None:
    assert circle(radius, tolerance).chords == chords
    assert circle(radius, tolerance).length == pytest.approx(math.tau * radius)


def test_a_huge_circle_is_made_chord_by_chord() -> None:
    straights = circle(1e9, 0.0005).straights()
    assert math.dist(next(straights).to, next(straights).to) == pytest.approx(2_000, rel=0.01)


@pytest.mark.parametrize(
    ("end", "clockwise", "turned"),
    [
        ((0.0, 1.0), False, 0.25),
        ((0.0, 1.0), True, -0.75),
        ((0.0, -1.0), False, 0.75),
        ((0.0, -1.0), True, -0.25),
        ((-1.0, 0.0), False, 0.5),
        ((-1.0, 0.0), True, -0.5),
        ((1.0, 0.0), False, 1.0),
        ((1.0, 0.0), True, -1.0),
        # Rounded figures: the end is a little farther out, or a rounding error to either side.
        ((1.005, 0.0), False, 1.0),
        ((1.005, 0.0), True, -1.0),
        ((0.995, 1e-13), False, 1.0),
        ((0.995, 1e-13), True, -1.0),
        ((0.995, -1e-13), False, 1.0),
        ((0.995, -1e-13), True, -1.0),
    ],
)
def test_an_angle_is_up_to_a_full_circle(end: Point, clockwise: bool, turned: float) -> None:
    angle = angle_between((1.0, 0.0), end, (0.0, 0.0), clockwise=clockwise)
    assert angle == pytest.approx(turned * math.tau)


@given(figures, figures, st.floats(0.01, 6.27), st.floats(0.1, 100), st.booleans())
def test_a_centre_by_its_radius_is_the_one_that_the_arc_turns_round(
    x: float, y: float, angle: float, radius: float, clockwise: bool
) -> None:
    start = around((x, y), radius, 1.0)
    end = around((x, y), radius, 1.0 - angle if clockwise else 1.0 + angle)
    signed = radius if angle <= math.pi else -radius
    found = centre_from_radius(start, end, signed, 1e-6, clockwise=clockwise)
    assert found is not None
    # Near half a circle the centre depends on the last digit: the square root of it is left.
    assert found == pytest.approx((x, y), abs=1e-4)


def test_ends_that_rounding_has_moved_apart_still_have_a_centre() -> None:
    assert centre_from_radius((0, 0), (10, 0), 4.999, 0.01, clockwise=True) == (5.0, 0.0)
    assert centre_from_radius((0, 0), (10, 0), 4.9, 0.01, clockwise=True) is None
