"""Lines with their words sorted, and every mistake by its line, column and word."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.gcode import GcodeError, check_program, read_program
from sacbus.gcode.line import read_line
from sacbus.gcode.vocabulary import Group
from tests.gcode.rig import MACHINE, items, machine


def cases() -> list[tuple[str, list[str]]]:
    """The programs of mistakes.txt, each with what is said of it."""
    found: list[tuple[str, list[str]]] = []
    text = Path(__file__).with_name("mistakes.txt").read_text(encoding="utf-8")
    for case in text.split("----\n")[1:]:
        program, *told = case.removesuffix("\n").split("\n! ")
        found.append((program, told))
    return found


CASES = cases()


@pytest.mark.parametrize(("program", "told"), CASES, ids=[program for program, _ in CASES])
def test_every_mistake_is_told_as_it_should_be(program: str, told: list[str]) -> None:
    with pytest.raises(GcodeError) as wrong:
        check_program(program.split("\n"), MACHINE, "part.ngc")
    assert str(wrong.value).splitlines() == told


@pytest.mark.parametrize(("program", "told"), CASES, ids=[program for program, _ in CASES])
def test_reading_ends_at_the_first_line_that_is_wrong(program: str, told: list[str]) -> None:
    with pytest.raises(GcodeError) as wrong:
        list(read_program(program.split("\n"), MACHINE, "part.ngc"))
    first = [str(mistake) for mistake in wrong.value.mistakes]
    assert first == told[: len(first)]
    assert len({mistake.line for mistake in wrong.value.mistakes}) == 1


def test_words_are_sorted_by_what_they_are_for() -> None:
    line = read_line("N5 G01 G90.10 X1 y-.5 M08 (MSG,on)", 7, "part.ngc", "XY")
    assert line.codes == {Group.MOTION: "G1", Group.ARC_DISTANCE: "G90.1", Group.COOLANT: "M8"}
    assert line.values == {"X": 1.0, "Y": -0.5}
    assert (line.number, line.messages, line.mistakes) == (7, ("on",), [])


def test_a_line_number_means_nothing() -> None:
    numbered = "N10 G1 X1\nN5 X2\nN10\nN 9 9 999 9999 X3"
    assert items(numbered) == items("G1 X1\nX2\n\nX3")


def test_an_axis_with_a_letter_of_another_word_cannot_be_moved() -> None:
    with pytest.raises(GcodeError, match="Q1: canned cycles are not read"):
        items("G1 Q1", machine("XQ"))
