"""Places: what figures count from, in which units, and what G53 and G92 do to that."""

from __future__ import annotations

import pytest

from tests.gcode.rig import machine, places


def test_axes_go_where_their_words_say() -> None:
    assert places("G1 X1 Y-2 Z.5\nG0 Y3") == [(1, -2, 0.5), (1, 3, 0.5)]
    assert places("G1 U1 V2 W3 B4", machine("WVBU")) == [(3, 2, 4, 1)]


def test_the_figures_have_the_order_of_the_machines_axes() -> None:
    assert places("G1 X1 Y2 Z3", machine("ZXY")) == [(3, 1, 2)]


def test_ways_add_up() -> None:
    assert places("G91 G1 X1 Y1\nX1\nG90 X1\nG91 X-3 Y-1") == [
        (1, 1, 0),
        (2, 1, 0),
        (1, 1, 0),
        (-2, 0, 0),
    ]


def test_inches_are_25_4_mm() -> None:
    assert places("G20 G1 X1 Y.5\nG91 X1\nG21 X1") == [
        pytest.approx((25.4, 12.7, 0)),
        pytest.approx((50.8, 12.7, 0)),
        pytest.approx((51.8, 12.7, 0)),
    ]


def test_units_hold_for_all_of_their_line() -> None:
    assert places("G1 X1 G20") == [(25.4, 0, 0)]


def test_inches_do_not_concern_rotary_axes() -> None:
    on = machine("XA")
    assert places("G20 G1 X1 A90\nG92 A0 X0\nX1 A1", on) == [(25.4, 90), (50.8, 91)]


def test_g92_moves_the_origin_and_g92_1_moves_it_back() -> None:
    program = "G1 X5 Y5\nG92 X0\nX1 Y1\nG92 X10 Y10\nX10 Y11\nG92.1\nX5 Y5"
    assert places(program) == [(5, 5, 0), (6, 1, 0), (6, 2, 0), (5, 5, 0)]


def test_g92_counts_in_the_units_of_its_line() -> None:
    assert places("G1 X25.4\nG20 G92 X1\nG21 X0") == [(25.4, 0, 0), (0, 0, 0)]


def test_g92_does_not_concern_ways() -> None:
    assert places("G1 X5\nG92 X0\nG91 X1") == [(5, 0, 0), (6, 0, 0)]


def test_g92_1_may_stand_before_a_motion_in_its_line() -> None:
    assert places("G1 X5\nG92 X0\nG92.1 X6") == [(5, 0, 0), (6, 0, 0)]


def test_g53_counts_from_the_beginning_for_its_line() -> None:
    program = "G1 X5\nG92 X0\nG53 X7\nX7\nG91\nG53 G0 X1\nX1"
    assert places(program) == [(5, 0, 0), (7, 0, 0), (12, 0, 0), (1, 0, 0), (2, 0, 0)]


def test_g53_leaves_axes_that_it_does_not_name() -> None:
    assert places("G1 X5 Y3\nG53 X7") == [(5, 3, 0), (7, 3, 0)]
