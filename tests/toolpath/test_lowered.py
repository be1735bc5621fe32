"""By how much blocks are slower than was asked, in words."""

from __future__ import annotations

import pytest

from sacbus.toolpath import Axis, Machine, Phase, Straight
from sacbus.toolpath.lowered import against, by_axes, by_line, largest
from sacbus.toolpath.piece import pieces
from sacbus.toolpath.stretch import Stretch, stretches

XY = Machine((Axis("X", 10, 400), Axis("Y", 11, 400, max_rpm=100)), rapid=600)


def only(to: tuple[float, float], feed: float | None) -> list[Stretch]:
    found = stretches(pieces([Straight(to, feed)], XY, 0), XY)
    return [one for one in found if isinstance(one, Stretch)]


def test_the_axis_that_is_furthest_beyond_its_limit_is_named() -> None:
    part, why = by_axes(XY, only((10.0, 10.0), 150))
    # 150 mm/min at 45 degrees are 212 RPM of each axis.
    assert part == pytest.approx(1 - 100 / (150 / 2**0.5 * 2), rel=1e-6)
    assert why == "Y turns at 100 RPM at most"


def test_a_feed_within_all_limits_and_a_rapid_are_not_lowered() -> None:
    assert by_axes(XY, only((10.0, 10.0), 50)) == (0.0, "")
    assert by_axes(XY, only((10.0, 10.0), None)) == (0.0, "")


def test_laws_are_held_against_each_other_peak_by_peak() -> None:
    free = (Phase(0, 0, 1, 1, 0, 4), Phase(1, 0, 0.5, 1, 4, 4), Phase(1, 0.5, 1, 1, 4, 0))
    held = (Phase(0, 0, 1, 1, 0, 3), Phase(1, 0, 0.5, 1, 3, 2), Phase(1, 0.5, 1, 1, 2, 0))
    assert against(free, held) == 0.25
    assert against(free, free) == 0
    assert against(held, free) == 0


def test_what_the_line_carries_is_told_in_whole_commands_a_second() -> None:
    assert by_line(0.25, 0.0105) == (0.25, "the line carries 95 commands a second")
    assert by_line(0.0, 0.0) == (0.0, "")


def test_the_largest_lowering_is_the_one_that_is_told() -> None:
    assert largest((0.1, "a"), (0.3, "b"), (0.0, "")) == (0.3, "b")
    assert largest((0.0, ""), (0.0, "")) == (0.0, "")
