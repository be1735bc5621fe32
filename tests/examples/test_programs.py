"""The part programs among the examples: they are right, and go where their comments say."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from sacbus.gcode import check_program, read_program
from sacbus.toolpath import Axis, Machine, Straight

EXAMPLES = Path(__file__).parents[2] / "examples"
MACHINE = Machine(tuple(Axis(name, node, 400.0) for name, node in (("X", 10), ("Y", 11))))


def places(name: str) -> list[tuple[float, ...]]:
    with (EXAMPLES / name).open(encoding="ascii") as lines:
        return [item.to for item in read_program(lines, MACHINE) if isinstance(item, Straight)]


def test_every_program_among_the_examples_is_right_and_comes_home() -> None:
    names = sorted(file.name for file in EXAMPLES.glob("*.ngc"))
    assert names == ["circle.ngc", "spiral.ngc"]
    for name in names:
        with (EXAMPLES / name).open(encoding="ascii") as lines:
            assert check_program(lines, MACHINE, name).halts == 1
        assert places(name)[-1] == (0.0, 0.0)


def test_the_circle_is_one() -> None:
    start, *round_, home = places("circle.ngc")
    assert start == round_[-1] == (5.0, 25.0)
    assert {round(math.dist(place, (25, 25)), 9) for place in round_} == {20.0}
    assert home == (0.0, 0.0)


def test_the_spiral_widens_by_half_a_mm_every_half_turn() -> None:
    crossings = [place[0] for place in places("spiral.ngc") if place[1] == 10.0]
    widths = [abs(after - before) for before, after in pairwise(crossings)]
    assert widths == pytest.approx([*range(2, 21)])
