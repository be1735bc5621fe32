"""The benchmark of lines, a few of them: what it counts, and what it says."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.lines import main, planned, told
from sacbus.toolpath import Deviation

pytestmark = pytest.mark.slow


def test_it_says_how_straight_and_how_even_lines_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--lines", "12", "--seed", "3"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("12 lines, 100.00 % within a step of the coarsest axis\n")
    assert "lines whose axes end more than a pulse apart: 0\n" in said
    assert "jitter of the minor axis, own clock: 0." in said
    assert "jitter of the minor axis, Bresenham: " in said


def test_a_line_that_is_off_is_listed_with_its_reason() -> None:
    (one,) = planned(1, 0)
    far = replace(one.block, deviation=Deviation(0.0125, 1.25, "because"))
    assert told(one._replace(block=far)) == "line 0: 1.25 steps (0.0125 mm): because"
