"""Whole programs, checked and read: nothing but its own error, in no more memory than a line's."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from itertools import islice, repeat

import pytest
from hypothesis import given
from hypothesis import strategies as st

from examples import relief
from sacbus.gcode import Checked, GcodeError, Mistake, check_program, read_program
from sacbus.gcode.vocabulary import GROUPS, REFUSED
from sacbus.toolpath import Straight
from tests.gcode.rig import MACHINE, items, machine

numbers = st.sampled_from(
    ["0", "1", "5.", "-.5", "+2", "0.01", "123456789", "-", "", "1.5.", "[1]"]
)
letters = st.sampled_from("XYZIJKRFPSTNADHOgxm#é(;)%/ ")
words = st.one_of(
    st.tuples(letters, numbers).map("".join),
    st.sampled_from([*GROUPS, *REFUSED]),
    st.sampled_from(["(MSG,a)", "( a )", "M30", "%"]),
)
lines = st.lists(words, max_size=8).map(" ".join)


def mistakes(program: list[str]) -> tuple[Mistake, ...]:
    """What is wrong with a program, all of it."""
    try:
        check_program(program, MACHINE)
    except GcodeError as fault:
        return fault.mistakes
    return ()


@pytest.mark.slow
@given(st.lists(lines | st.text(), max_size=12))
def test_whatever_is_written_is_read_or_refused(program: list[str]) -> None:
    if wrong := mistakes(program):
        assert all(str(mistake).isprintable() for mistake in wrong)
        assert [mistake.line for mistake in wrong] == sorted(mistake.line for mistake in wrong)
        with pytest.raises(GcodeError) as fault:
            for _ in read_program(program, MACHINE):
                pass
        assert fault.value.mistakes[0] == wrong[0]
    else:
        # Arcs of a million chords are right, too: not all of them here.
        came = list(islice(read_program(program, MACHINE), 1_000))
        stretches = sum(isinstance(item, Straight) for item in came)
        assert stretches == check_program(program, MACHINE).stretches or len(came) == 1_000


def test_a_check_counts_what_reading_gives() -> None:
    program = "G1 X3 Y4\nG4 P1.5\nG0 Z5 M0\nG2 X13 I5\nS5 M3\nM30\nG1 X0\n"
    checked = check_program(program.splitlines(), MACHINE)
    came = items(program)
    assert checked.lines == 6
    assert checked.stretches == sum(isinstance(item, Straight) for item in came)
    assert checked.length == pytest.approx(5 + 5 + 5 * 3.14159, abs=1e-3)
    assert (checked.dwell, checked.halts, checked.waits) == (1.5, 3, 1)


def test_a_stretch_that_no_machine_has_is_a_mistake_before_anything_moves() -> None:
    with pytest.raises(GcodeError) as refused:
        check_program(["G1 X1 F5", "X99999999", "G1 Q1"], MACHINE, "part.ngc")
    first, second = map(str, refused.value.mistakes)
    assert first.startswith("X: would go ")
    assert first.endswith(
        " steps at once, 100000000 at most, part.ngc:2:1, check units and steps per mm"
    )
    assert second.startswith("Q1: ")


def test_an_empty_program_comes_to_nothing() -> None:
    assert check_program([], MACHINE) == Checked(0, 0, 0.0, 0.0, 0, 0)
    assert items("") == []


def test_mistakes_are_told_up_to_a_number_and_no_further() -> None:
    read = 0

    def program() -> Iterator[str]:
        nonlocal read
        for line in repeat("G1 E1 Q2"):
            read += 1
            yield line

    with pytest.raises(GcodeError) as wrong:
        check_program(program(), MACHINE, "part.ngc", most=5)
    assert len(wrong.value.mistakes) == 5
    assert read == 3
    with pytest.raises(GcodeError) as wrong:
        check_program(program(), MACHINE)
    assert len(wrong.value.mistakes) == 20


def test_a_mistake_has_all_that_its_line_says() -> None:
    with pytest.raises(GcodeError) as wrong:
        check_program(["", "G1 B5"], MACHINE, "part.ngc")
    (mistake,) = wrong.value.mistakes
    assert (mistake.name, mistake.line, mistake.column, mistake.word) == ("part.ngc", 2, 4, "B5")
    assert mistake.what == "the machine has no axis B"
    assert mistake.remedy == "give it one (--axis B=NODE:STEPS) or take it out"
    assert isinstance(wrong.value, ValueError)


def test_reading_is_a_line_ahead_at_most() -> None:
    taken: list[int] = []

    def program() -> Iterator[str]:
        for number in range(1, 4):
            taken.append(number)
            yield f"G1 X{number}"

    reading = read_program(program(), MACHINE)
    next(reading)
    assert taken == [1]
    next(reading)
    assert taken == [1, 2]


def test_nothing_is_told_of_what_lies_behind_the_end() -> None:
    endless = iter(["G1 X1", "M2", *repeat("$", 3)])
    assert check_program(endless, MACHINE).lines == 2
    assert list(endless) == ["$"] * 3


@pytest.mark.slow
def test_a_program_of_any_length_is_read_in_the_memory_of_a_line() -> None:
    def peak(count: int) -> int:
        tracemalloc.reset_peak()
        check_program(relief.program(count), MACHINE)
        for _ in read_program(relief.program(count), MACHINE):
            pass
        return tracemalloc.get_traced_memory()[1]

    tracemalloc.start()
    try:
        peak(1_000)
        short, long = peak(1_000), peak(10_000)
    finally:
        tracemalloc.stop()
    assert long < short + 20_000  # a line is some 30 bytes; 9 000 more would be 270 000


def test_axes_of_a_smaller_machine_are_asked_for_in_every_line_that_names_them() -> None:
    program = ["G0 Z5", "X1 Y1", "G1 Z-1 F100", "X5"]
    with pytest.raises(GcodeError) as wrong:
        check_program(program, machine("XY"), "part.ngc")
    assert [(mistake.line, mistake.word) for mistake in wrong.value.mistakes] == [
        (1, "Z5"),
        (3, "Z-1"),
    ]
