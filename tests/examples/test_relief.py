"""The relief: a long program that is right, the same every time, and looks like a CAM program's."""

from __future__ import annotations

from pathlib import Path

import pytest

from examples import relief
from sacbus.gcode import check_program, read_program
from sacbus.toolpath import Axis, Halt, Machine, Straight

MACHINE = Machine(tuple(Axis(name, node, 400.0) for node, name in enumerate("XYZ", 10)))


@pytest.mark.parametrize("lines", [1_000, 1_001, 5_000, 12_345])
def test_a_program_has_as_many_lines_as_were_asked_for_and_is_right(lines: int) -> None:
    program = list(relief.program(lines))
    assert len(program) == lines
    survey = check_program(program, MACHINE)
    assert survey.stretches > 0.95 * lines
    assert survey.halts == 7


@pytest.mark.slow
def test_the_program_that_is_written_unless_told_otherwise_has_over_100_000_lines() -> None:
    assert relief.LINES > 100_000
    assert check_program(relief.program(relief.LINES), MACHINE).lines == relief.LINES - 1


def test_the_tool_stays_over_the_plate_between_the_bands_and_comes_home() -> None:
    stretches = [
        item for item in read_program(relief.program(5_000), MACHINE) if isinstance(item, Straight)
    ]
    assert stretches[-1].to == (0.0, 0.0, 0.0)
    cutting = [item for item in stretches if item.feed == relief.FINISH]
    assert len({item.to for item in cutting}) == len(cutting)
    assert {0.0, relief.WIDTH} <= {item.to[0] for item in cutting}
    assert max(item.to[1] for item in cutting) > 0.95 * relief.HEIGHT
    heights = [item.to[2] for item in cutting]
    assert min(heights) == 0.0
    assert 0.8 * relief.RAISED < max(heights) <= relief.RAISED
    lifted = [item for item in stretches if item.feed is None and item.to[2] == relief.SAFE]
    assert len(lifted) == 2 * relief.BANDS  # up and across for each, and up at the end


def test_what_a_person_has_to_see_to_is_told() -> None:
    items = read_program(relief.program(1_000), MACHINE)
    told = [item.text for item in items if isinstance(item, Halt)]
    assert told[1:] == ["T1 M6", "S12000 M3", "M8", "M9", "M5", "M30"]
    assert told[0].startswith("CLAMP THE PLATE")


def test_it_is_written_to_a_file_or_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "relief.ngc"
    assert relief.main(["1000", str(file)]) == 0
    assert capsys.readouterr().out == ""
    assert relief.main(["1000"]) == 0
    assert capsys.readouterr().out == file.read_text(encoding="ascii")
    assert file.read_bytes().count(b"\n") == 1_000


@pytest.mark.parametrize("asked", ["999", "many", "-5", "", "1e6", "²"])
def test_a_number_that_makes_no_relief_is_told_in_one_line(
    asked: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert relief.main([asked]) == 2
    written = capsys.readouterr()
    assert (written.out, written.err.count("\n")) == ("", 1)
    assert "expected a number of lines from 1000" in written.err


def test_a_file_that_cannot_be_written_is_told_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert relief.main(["1000", str(tmp_path / "none" / "x.ngc")]) == 1
    written = capsys.readouterr()
    assert (written.out, written.err.count("\n")) == ("", 1)
    assert "name a file in a directory that is there" in written.err
