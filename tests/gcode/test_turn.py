"""Lines with arcs: plane, centre, radius, direction, and the ends that they lead to."""

from __future__ import annotations

import math

import pytest

from sacbus.gcode import GcodeError, check_program
from tests.gcode.rig import MACHINE, items, machine, places


def middle(program: str, letters: str = "XYZ") -> tuple[float, ...]:
    """Where the tool is halfway through a program's stretches, within a chord."""
    found = places(program, machine(letters, tolerance=1e-6))
    return found[len(found) // 2]


@pytest.mark.parametrize(
    ("program", "halfway"),
    [
        ("G2 X10 I5", (5, 5)),
        ("G3 X10 I5", (5, -5)),
        ("G2 X10 I5 J0", (5, 5)),
        ("G2 Y-10 J-5", (5, -5)),
        ("G3 I5", (10, 0)),
        ("G2 I5", (10, 0)),
        ("G3 X0 Y0 I0 J5", (0, 10)),
    ],
)
def test_an_arc_by_its_centre(program: str, halfway: tuple[float, float]) -> None:
    assert middle(program, "XY") == pytest.approx(halfway, abs=0.02)


@pytest.mark.parametrize(
    ("program", "halfway"),
    [
        ("G2 X10 R5", (5, 5)),
        ("G3 X10 R5", (5, -5)),
        ("G2 X10 R-5", (5, 5)),
        # A quarter, and the three quarters of the other centre.
        ("G2 X5 Y5 R5", (5 - 5 * math.sqrt(0.5), 5 * math.sqrt(0.5))),
        ("G2 X5 Y5 R-5", (-5 * math.sqrt(0.5), 5 + 5 * math.sqrt(0.5))),
        ("G3 X5 Y5 R5", (5 * math.sqrt(0.5), 5 - 5 * math.sqrt(0.5))),
        ("G3 X5 Y5 R-5", (5 + 5 * math.sqrt(0.5), -5 * math.sqrt(0.5))),
        ("G20 G2 X1 R.5", (12.7, 12.7)),
    ],
)
def test_an_arc_by_its_radius(program: str, halfway: tuple[float, float]) -> None:
    assert middle(program, "XY") == pytest.approx(halfway, abs=0.03)


def test_the_example_of_the_quarter_by_r_is_that_by_its_centre() -> None:
    assert places("G2 X5 Y5 R5")[-1] == places("G2 X5 Y5 I5")[-1] == (5, 5, 0)
    assert len(places("G2 X5 Y5 R5")) == len(places("G2 X5 Y5 I5"))


@pytest.mark.parametrize(
    ("program", "halfway"),
    [
        # Clockwise as seen from where the third axis points to.
        ("G17 G2 X10 I5", (5, 5, 0)),
        ("G18 G2 Z10 K5", (5, 0, 5)),
        ("G18 G3 Z10 K5", (-5, 0, 5)),
        ("G18 G2 X10 I5", (5, 0, -5)),
        ("G19 G2 Y10 J5", (0, 5, 5)),
        ("G19 G3 Y10 J5", (0, 5, -5)),
        ("G19 G2 Z10 K5", (0, -5, 5)),
    ],
)
def test_each_plane_has_its_axes_and_its_centre(
    program: str, halfway: tuple[float, float, float]
) -> None:
    assert middle(program) == pytest.approx(halfway, abs=0.02)


def test_the_other_axes_of_the_machine_go_along() -> None:
    ends = places("G2 X10 I5 Z4 A90", machine("XYZA"))
    assert ends[-1] == (10.0, 0.0, 4.0, 90.0)
    z = [place[2] for place in ends]
    assert z == pytest.approx([4 * number / len(ends) for number in range(1, len(ends) + 1)])


def test_a_full_circle_may_be_a_turn_of_a_screw() -> None:
    ends = places("G3 I-5 Z1\nI-5 Z2")
    assert ends[-1] == (0.0, 0.0, 2.0)
    assert (0, 0, 1) in ends
    assert min(place[0] for place in ends) == pytest.approx(-10, abs=0.02)


@pytest.mark.parametrize(
    "program",
    [
        "G1 X2 Y1\nG90.1 G2 X12 I7 J1",
        "G1 X2 Y1\nG92 X0 Y0\nG90.1 G2 X10 I5 J0",
        "G1 X2 Y1\nG90.1\nG91.1\nG2 X12 I5",
        "G1 X2 Y1\nG91 G2 X10 I5",
    ],
)
def test_a_centre_may_be_a_place(program: str) -> None:
    assert places(program) == places("G1 X2 Y1\nG2 X12 I5")


def test_arcs_hold_until_another_motion_and_have_the_feed() -> None:
    stretches = items("G2 X10 I5 F77\nX0 I-5\nG0 X1")
    assert {(item.line, getattr(item, "feed", 0)) for item in stretches} == {
        (1, 77.0),
        (2, 77.0),
        (3, None),
    }


def test_arc_words_without_a_figure_to_go_by_only_set_the_mode() -> None:
    assert places("G2\nX10 I5") == places("G2 X10 I5")


def test_ends_that_were_rounded_to_three_decimals_are_taken() -> None:
    # Eighths of a circle of 5 mm: the centre is 5.0007 mm from the first end, 5 mm from the last.
    ends = places("G3 X0 Y7.071 I-3.536 J3.536\nX-3.536 Y8.536 I-3.536 J-3.536", machine("XY"))
    assert ends[-1] == (-3.536, 8.536)


def test_a_wider_tolerance_takes_more_of_a_mismatch() -> None:
    off = ["G2 X10.05 I5"]
    with pytest.raises(GcodeError, match=r"more than 0\.01 mm apart"):
        check_program(off, MACHINE)
    with pytest.raises(GcodeError, match=r"more than 0\.01 mm apart"):
        check_program(off, machine(tolerance=0.001))
    assert check_program(off, machine(tolerance=0.1)).stretches > 4


@pytest.mark.parametrize(
    ("letters", "program", "missing"),
    [("XZ", "G2 X1 I.5", "Y"), ("XY", "G18 G2 X1 I.5", "Z"), ("XY", "G19 G3 Y1 J.5", "Z")],
)
def test_an_arc_needs_both_axes_of_its_plane(letters: str, program: str, missing: str) -> None:
    with pytest.raises(GcodeError) as wrong:
        items(program, machine(letters))
    (mistake,) = wrong.value.mistakes
    assert mistake.what == (
        f"an arc in this plane needs axis {missing}, which the machine does not have"
    )
    assert f"--axis {missing}=NODE:STEPS" in mistake.remedy


def test_a_machine_without_y_has_arcs_in_the_plane_of_the_others() -> None:
    assert places("G18 G2 Z10 K5", machine("XZ"))[-1] == (0, 10)
