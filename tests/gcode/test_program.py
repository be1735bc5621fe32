"""Programs: what holds from line to line, what is told, and in which order a line's words act."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.gcode import GcodeError
from sacbus.gcode.line import read_line
from sacbus.gcode.vocabulary import GROUPS, VALUE_LETTERS
from sacbus.toolpath import Dwell, Halt, PathItem, Straight
from tests.gcode.rig import items, machine, places

DATA = Path(__file__).parents[1] / "data" / "gcode"


def told(program: str) -> list[tuple[str, int]]:
    """What is told, and from which line."""
    return [(item.text, item.line) for item in items(program) if isinstance(item, Halt)]


def feeds(program: str, default: float = 300.0) -> list[float | None]:
    """The feeds of a program's stretches."""
    return [
        item.feed for item in items(program, machine(feed=default)) if isinstance(item, Straight)
    ]


# ---- motion -------------------------------------------------------------------------------------


def test_a_motion_holds_until_the_next_one() -> None:
    assert items("G1 X1\nX2\nG0 X3\nX4") == [
        Straight((1, 0, 0), 300.0, 1),
        Straight((2, 0, 0), 300.0, 2),
        Straight((3, 0, 0), None, 3),
        Straight((4, 0, 0), None, 4),
    ]


def test_rapids_have_no_feed_of_their_own() -> None:
    assert feeds("F10 G0 X1\nG0 X2 F5\nG1 X3") == [None, None, 5.0]


def test_a_feed_holds_until_the_next_one() -> None:
    assert feeds("G1 X1\nX2 F10\nX3\nF20\nX4", default=42.0) == [42.0, 10.0, 10.0, 20.0]


def test_a_feed_is_in_the_units_of_its_line_and_stays_as_it_is() -> None:
    assert feeds("G20 G1 X1 F10\nG21 X2\nX3 F10 G20") == [254.0, 254.0, 254.0]


@pytest.mark.parametrize("program", ["G1 X0", "G1", "G0 X0 Y0 Z0", "G1 F100", "G91 G0 X0", "G28"])
def test_a_stretch_of_no_length_is_none(program: str) -> None:
    assert items(program) == []


def test_axis_words_without_a_motion_are_refused() -> None:
    for program in ("X1", "G90 X1", "G1 X1\nG80\nX2", "G1 X1\nG80 X2"):
        with pytest.raises(GcodeError, match="no motion is in force"):
            items(program)


def test_words_that_ask_for_what_is_so_anyway_do_nothing() -> None:
    assert items("G17 G40 G49 G54 G80 G90 G94\nG1 X1 G94\nG40 X2\nG49 X3\nG54 X4") == items(
        "\nG1 X1\nX2\nX3\nX4"
    )


def test_g28_goes_by_way_of_a_place_with_the_axes_it_names() -> None:
    away = "G1 X5 Y6 Z7\nG92 X0 Y0 Z0\n"
    at = [Straight((5, 6, 7), 300.0, 1)]
    assert items(f"{away}G28 Z5") == [
        *at,
        Straight((5, 6, 12), None, 3),
        Straight((5, 6, 0), None, 3),
    ]
    assert items(f"{away}G91 G28 Z0") == [*at, Straight((5, 6, 0), None, 3)]
    assert items(f"{away}G28 X1 Y1") == [
        *at,
        Straight((6, 7, 7), None, 3),
        Straight((0, 0, 7), None, 3),
    ]
    assert items(f"{away}G28") == [*at, Straight((0, 0, 0), None, 3)]


def test_g28_leaves_the_motion_in_force() -> None:
    assert items("G1 X5\nG28\nX1 F9")[-1] == Straight((1, 0, 0), 9.0, 3)


# ---- standing still, and what is told -----------------------------------------------------------


def test_a_dwell_is_in_seconds() -> None:
    assert items("G1 X1\nG4 P.5\nG04 P2 X2\nG4 P0") == [
        Straight((1, 0, 0), 300.0, 1),
        Dwell(0.5, 2),
        Dwell(2.0, 3),
        Straight((2, 0, 0), 300.0, 3),
        Dwell(0.0, 4),
    ]


def test_messages_are_told_before_all_else_in_their_line() -> None:
    assert items("(MSG, one) S5 M3 G1 X1 (msg,two)") == [
        Halt("one", line=1),
        Halt("two", line=1),
        Halt("S5 M3", line=1),
        Straight((1, 0, 0), 300.0, 1),
    ]


def test_a_message_may_stand_alone_or_beside_a_motion() -> None:
    assert told("(MSG, a)\nG1 X1 (MSG,b)\n(not this)") == [("a", 1), ("b", 2)]


def test_a_spindles_speed_is_told_when_it_changes() -> None:
    assert told("S1000\nG1 X1 S1000\nX2 S500.5\nX3 S1000.0\nS1000 M3") == [
        ("S1000", 1),
        ("S500.5", 3),
        ("S1000", 4),
        ("M3", 5),
    ]


def test_a_tool_is_told_with_its_change() -> None:
    assert told("T2 M6\nM06 T03\nM6") == [("T2 M6", 1), ("T3 M6", 2), ("M6", 3)]


def test_words_are_told_in_their_order_of_execution() -> None:
    assert items("M30 M08 G1 X1 M04 M6 S9 T1 F5 G4 P1") == [
        Halt("S9 T1 M6 M4 M8", line=1),
        Dwell(1.0, 1),
        Straight((1, 0, 0), 5.0, 1),
        Halt("M30", line=1),
    ]
    for name in ("M3", "M4", "M5", "M7", "M8", "M9"):
        assert items(name) == [Halt(name, line=1)]


def test_m0_waits_and_m1_does_not() -> None:
    assert items("M0\nM1\nG1 X1 M00") == [
        Halt("M0", waits=True, line=1),
        Halt("M1", line=2),
        Straight((1, 0, 0), 300.0, 3),
        Halt("M0", waits=True, line=3),
    ]


# ---- where a program begins and ends ------------------------------------------------------------


@pytest.mark.parametrize("end", ["M2", "M30", "M02", "G1 M30"])
def test_nothing_is_read_behind_the_programs_end(end: str) -> None:
    assert places(f"G1 X1\n{end}\nX2\n$ not G-code") == [(1, 0, 0)]


def test_the_second_percent_line_ends_the_program() -> None:
    assert places("%\nG1 X1\n%\nX2") == [(1, 0, 0)]
    assert places("\n(first)\n % \r\nG1 X1\n%\nX2") == [(1, 0, 0)]
    assert places("G1 X1\n%\nX2") == [(1, 0, 0)]
    assert places("%\n%\nG1 X1") == []


def test_a_line_that_begins_with_a_slash_is_left_out() -> None:
    program = "G1 X1\n / X2 Y2\n/ $ [not G-code\nX3"
    assert places(program) == [(1, 0, 0), (3, 0, 0)]


def test_lines_with_a_slash_can_be_read() -> None:
    assert items("G1 X1\n / X2 Y2\nX3", skipping=False) == items("G1 X1\nX2 Y2\nX3")
    with pytest.raises(GcodeError, match=r"Q1: .*, the program:1:5, "):
        items("/G1 Q1", skipping=False)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan")])
def test_chords_need_a_tolerance(tolerance: float) -> None:
    with pytest.raises(ValueError, match="chords need a tolerance above 0 mm"):
        items("G1 X1", machine(tolerance=tolerance))


# ---- whole programs -----------------------------------------------------------------------------


def listed(item: PathItem) -> str:
    """An item as everything.txt has it: places to 6 decimals, as machines' sines differ."""
    match item:
        case Straight():
            place = " ".join(f"{mm:.6f}".rstrip("0").rstrip(".") for mm in item.to)
            return f"{item.line} {'rapid' if item.feed is None else f'feed {item.feed:g}'} {place}"
        case Dwell():
            return f"{item.line} dwell {item.seconds:g}"
        case Halt():
            return f"{item.line} {'wait' if item.waits else 'tell'} {item.text}"


def test_a_program_with_every_word_comes_to_what_stands_beside_it() -> None:
    program = (DATA / "everything.ngc").read_text(encoding="utf-8")
    came = [listed(item) for item in items(program, machine("XYZA", tolerance=0.5))]
    assert came == (DATA / "everything.txt").read_text(encoding="utf-8").splitlines()


def test_that_program_has_every_word_that_is_read() -> None:
    lines = (DATA / "everything.ngc").read_text(encoding="utf-8").splitlines()
    axes = machine("XYZA")
    read = [read_line(line, 0, "", "XYZA") for line in lines if not line.startswith(("%", "/"))]
    found = {code for line in read for code in line.codes.values()}
    # One of two that end the program, and all of their line that is behind it is not read.
    assert found == GROUPS.keys() - {"M30"}
    letters = {letter for line in read for letter, _ in line.words}
    assert letters >= {*VALUE_LETTERS, *(axis.name for axis in axes.axes)}


figures = st.integers(-9_999_999, 9_999_999).map(lambda thousandths: thousandths / 1_000)
positions = st.tuples(figures, figures, figures)
moves = st.tuples(positions, st.none() | st.integers(1, 90_000).map(lambda feed: feed / 10))


def written(path: list[Straight], *, spaced: bool) -> str:
    """A path as a program: only the words that change, and G words where the motion does."""
    lines, motion, feed = [], "", 300.0
    before: tuple[float, ...] = (0.0, 0.0, 0.0)
    for stretch in path:
        words = []
        wanted = "G0" if stretch.feed is None else "G1"
        if wanted != motion:
            words.append(wanted)
        changed = zip("XYZ", before, stretch.to, strict=True)
        words += [f"{axis}{new:.3f}" for axis, old, new in changed if old != new]
        if stretch.feed is not None and stretch.feed != feed:
            feed = stretch.feed
            words.append(f"F{feed:.1f}")
        lines.append((" " if spaced else "").join(words))
        before, motion = stretch.to, wanted
    return "\n".join(lines)


@pytest.mark.slow
@given(st.lists(moves, max_size=30), st.booleans())
def test_a_path_that_is_written_and_read_is_the_same_path(
    drawn: list[tuple[tuple[float, float, float], float | None]], spaced: bool
) -> None:
    path: list[Straight] = []
    at: tuple[float, ...] = (0.0, 0.0, 0.0)
    for to, feed in drawn:
        if to != at:
            path.append(Straight(to, feed, len(path) + 1))
            at = to
    assert items(written(path, spaced=spaced)) == path
