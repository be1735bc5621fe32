"""Queue files: the companion's own, read and written byte for byte, and every mistake named."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import NO_RAMP, Defaults, Motion, Session, parse
from sacbus.language.commands import Move
from sacbus.language.queue_file import (
    Form,
    QueueRow,
    ReadRow,
    WrongRow,
    read_rows,
    write_rows,
)

DATA = Path(__file__).parents[1] / "data"
GOOD = " 1 , 800 , 0 , 1 , 150 , 2000 , 0 , 1 , 1 , 0 , 0 , 3000 "
FACTORY = Defaults()


def companions(name: str) -> list[str]:
    """The lines of a file of the companion's, ends included."""
    return (DATA / name).read_bytes().decode().splitlines(keepends=True)


def row_of(line: str, defaults: Defaults = FACTORY) -> ReadRow:
    (read,) = read_rows([line], defaults=defaults)
    return read


def with_field(column: int, text: str) -> str:
    """The good row with another field, counted from 0."""
    fields = GOOD.split(",")
    fields[column] = f" {text} "
    return ",".join(fields)


# ---------------------------------------------------------------------- the companion's


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("companion-queue.txt", Form.PRESENT),
        ("companion-queue-14-fields.txt", Form.OLDER),
    ],
)
def test_the_companions_files_come_out_as_they_went_in(name: str, form: Form) -> None:
    lines = companions(name)
    read = list(read_rows(lines, name))
    assert [one.remarks for one in read] == [()] * 30
    assert [one.line for one in read] == list(range(1, 31))
    assert list(write_rows((one.row for one in read), form)) == lines


def test_a_row_of_each_form_means_what_the_companions_screen_shows() -> None:
    # Manual, "Queue" (the screen): 2  600 CCW  50  6000  1.00 1.00  0  3000, and row 12.
    rows = [one.row for one in read_rows(companions("companion-queue.txt"))]
    assert rows[1] == QueueRow(2, Motion(600, False, 50, 6000, 100, 100, False, wait_us=3000))
    assert rows[11] == QueueRow(12, Motion(2000, False, 100, 3000, 1047, 1047, True))
    # Row 9 of the older form: direction 1 is CW there, pulses 0 is full steps.
    rows = [one.row for one in read_rows(companions("companion-queue-14-fields.txt"))]
    assert rows[8] == QueueRow(9, Motion(4000, True, 160, 1875, 500, 500, True, wait_us=3_000_000))


def test_one_form_can_be_written_as_the_other() -> None:
    rows = [one.row for one in read_rows(companions("companion-queue-14-fields.txt"))]
    again = [one.row for one in read_rows(write_rows(rows))]
    assert again == rows


# ------------------------------------------------------------------------------ one to one


positions = st.integers(1, 2**32 - 1)
ramps = st.integers(1, 9_999) | st.integers(100, 999).map(lambda whole: whole * 100)


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    cycle_us = draw(st.integers(1, 2**32 - 1))
    return Motion(
        draw(st.none() | st.integers(1, 2**32 - 1)),
        draw(st.booleans()),
        FACTORY.rpm_of(cycle_us),
        cycle_us,
        draw(ramps),
        draw(ramps),
        draw(st.booleans()),
        draw(st.integers(0, 255)),
        draw(st.integers(0, 2**32 - 1)),
        draw(st.booleans()),
        draw(st.booleans()),
    )


@given(st.lists(st.builds(QueueRow, positions, motions()), max_size=5), st.sampled_from(Form))
def test_what_is_written_is_read_again(rows: list[QueueRow], form: Form) -> None:
    read = list(read_rows(write_rows(rows, form)))
    assert [one.row for one in read] == rows
    assert not any(one.remarks for one in read)


@given(motions(), st.booleans(), st.booleans())
def test_the_command_of_a_row_means_the_row_whatever_the_session(
    motion: Motion, linear: bool, full_step: bool
) -> None:
    move = QueueRow(1, motion).move()
    parsed = parse(move.text())
    assert isinstance(parsed.command, Move)
    session = Session(linear=linear, full_step=full_step, rpm=3, cycle_us=100_000, acc100=7)
    assert session.resolve(parsed.command)[0] == motion


def test_a_direction_is_the_true_one_whatever_the_default() -> None:
    row = row_of(GOOD).row
    assert row.motion.cw
    assert not row.move().opposite
    assert row.move(Defaults(cw=False)).opposite


def test_a_velocity_is_told_in_rpm_where_that_gives_its_cycle() -> None:
    assert row_of(GOOD).row.move().text() == "m800v150a1d1l0t3000f"
    odd = with_field(4, "65").replace("2000", "4567")
    assert row_of(odd).row.move().text() == "m800vc4567a1d1l0t3000f"
    assert row_of(GOOD.replace("800", "0")).row.move().continuous


# ------------------------------------------------------------------------ leniency, remarks


@pytest.mark.parametrize(
    "line",
    [
        "1,800,0,1,150,2000,0,1,1,0,0,3000",
        "\ufeff1,800,0,1,150,2000,0,1,1,0,0,3000\r\n",
        "\t1\t, 0800,0,1,150 ,2000,0,1.00,01,000,0,3000\n",
    ],
)
def test_blanks_zeros_and_ends_of_lines_do_not_matter(line: str) -> None:
    assert row_of(line) == row_of(GOOD)


def test_empty_lines_are_passed_over_and_counted() -> None:
    read = list(read_rows(["\n", GOOD, "  \r\n", GOOD]))
    assert [one.line for one in read] == [2, 4]


@pytest.mark.parametrize(
    ("rpm", "cycle", "kept", "expected"),
    [
        ("150", "3000", (100, 3000), "100, the RPM of a cycle of 3000"),
        ("0", "3000", (100, 3000), "100, the RPM of a cycle of 3000"),
        ("65", "0", (100, 3000), None),
    ],
)
def test_a_cycle_that_disagrees_with_its_rpm_wins(
    rpm: str, cycle: str, kept: tuple[int, int], expected: str | None
) -> None:
    read = row_of(with_field(4, rpm).replace("2000", cycle))
    assert (read.row.motion.rpm, read.row.motion.cycle_us) == kept
    last = read.remarks[-1]
    assert last.got == rpm
    assert last.text == "the cycle counts"
    assert last.column == GOOD.index("150") + 1
    if expected is not None:
        assert last.expected == expected


def test_a_cycle_of_nothing_is_the_default_cycle() -> None:
    read = row_of(with_field(4, "100").replace("2000", "0"))
    assert (read.row.motion.rpm, read.row.motion.cycle_us) == (100, 3_000)
    assert [remark.text for remark in read.remarks] == ["the default of 3000 is used"]


@pytest.mark.parametrize(
    ("rpm", "cycle"),
    [("1100", "272"), ("1102", "272"), ("65", "4567"), ("70", "4285"), ("0", "400000")],
)
def test_an_rpm_agrees_with_its_cycle_either_way_round(rpm: str, cycle: str) -> None:
    read = row_of(with_field(4, rpm).replace("2000", cycle))
    assert not read.remarks
    assert (read.row.motion.rpm, read.row.motion.cycle_us) == (int(rpm), int(cycle))


def test_rpm_and_cycle_are_compared_at_the_motors_own_steps() -> None:
    read = row_of(GOOD, Defaults(sprf=400))
    assert (read.row.motion.rpm, read.row.motion.cycle_us) == (75, 2_000)
    assert len(read.remarks) == 1


@pytest.mark.parametrize(
    ("text", "value100", "remark"),
    [
        (".2", 20, None),
        ("10.47", 1_047, None),
        ("5.", 500, None),
        ("999", NO_RAMP, None),
        ("10.479", 1_047, "two decimals"),
        ("120.5", 12_000, "no decimals"),
        ("1000", NO_RAMP, "at most 999"),
        ("0", NO_RAMP, "at least 0.01"),
    ],
)
def test_ramps_are_cut_as_a_command_cuts_them(text: str, value100: int, remark: str | None) -> None:
    read = row_of(with_field(7, text))
    assert read.row.motion.acc100 == value100
    if remark is None:
        assert not read.remarks
    else:
        assert remark in read.remarks[0].expected
        assert read.remarks[0].column == GOOD.index(" 1 , 1 , 0 , 0 ,") + 2


# ------------------------------------------------------------------------------ mistakes


@pytest.mark.parametrize(
    ("column", "text", "expected"),
    [
        (0, "0", "the queue position, 1 to 4294967295"),
        (0, "-1", "the queue position"),
        (1, "4294967296", "the steps, 0 to 4294967295"),
        (1, "1e3", "the steps"),
        (1, "٣", "the steps"),
        (1, "", "the steps"),
        (2, "2", "0 (CW) or 1 (CCW)"),
        (3, "full", "1 (full steps) or 0 (pulses)"),
        (4, "fast", "the velocity in RPM"),
        (5, "2000.5", "the cycle in microseconds"),
        (6, "", "0 (harmonic) or 1 (linear)"),
        (7, "", "an acceleration such as 1 or 10.47"),
        (7, "1 2", "an acceleration such as"),
        (8, ".", "a deceleration such as"),
        (8, "1,5", "12 or 14 fields"),
        (9, "256", "the extra pulses, 0 to 255"),
        (10, "01", "0 (no sync) or 1 (sync)"),
        (11, "9" * 5_000, "the start wait in microseconds"),
    ],
)
def test_a_wrong_field_is_named_by_its_column(column: int, text: str, expected: str) -> None:
    with pytest.raises(WrongRow) as told:
        list(read_rows([GOOD, with_field(column, text)], "q.csv"))
    fault = told.value
    assert (fault.name, fault.line) == ("q.csv", 2)
    if "fields" not in expected:
        place = GOOD.split(",")[:column]
        start = sum(len(field) + 1 for field in place) + 1
        assert fault.column == start + (1 if text else 0)
        assert fault.got == ("nothing" if not text else fault.got)
    assert expected in fault.expected or "12 fields" in fault.expected
    assert str(fault).startswith("this is no row of a queue file, q.csv line 2 column ")
    assert len(str(fault)) < 200


@pytest.mark.parametrize(
    ("lines", "column", "expected", "got"),
    [
        (["1,2,3"], 5, "12 or 14 fields", "3"),
        (["m200v100"], 1, "12 or 14 fields", "1"),
        ([GOOD + ", 7"], 60, "12 or 14 fields", "13"),
        ([GOOD, " 1 , 1 , 1 , 2000 , 1 , 0 , 160 , 1875 , 0 , 1 , 1 , 0 , 0 , 0 "], 58,
         "12 fields as before", "14"),
        ([" 1 , 1 , 1 , 2000 , 1 , 0 , 160 , 1875 , 0 , 1 , 1 , 0 , 0 , 0 ", GOOD], 53,
         "14 fields as before", "12"),
        ([" 1 , 0 , 1 , 2000 , 1 , 0 , 160 , 1875 , 0 , 1 , 1 , 0 , 0 , 0 "], 6,
         "1, as in every file of 14 fields that is known", "'0'"),
    ],
)  # fmt: skip
def test_a_wrong_number_of_fields_is_told(
    lines: list[str], column: int, expected: str, got: str
) -> None:
    with pytest.raises(WrongRow) as told:
        list(read_rows(lines))
    fault = told.value
    assert (fault.line, fault.column) == (len(lines), column)
    assert (fault.expected, fault.got) == (expected, got)


@given(st.text(max_size=80) | st.text("0123456789,. -", max_size=80))
def test_no_line_does_more_than_be_refused(line: str) -> None:
    refusal: WrongRow | None = None
    try:
        for read in read_rows([line]):
            assert read.row.motion.cycle_us >= 1
    except WrongRow as fault:
        refusal = fault
    assert refusal is None or refusal.column >= 1
