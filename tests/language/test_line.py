from __future__ import annotations

from sacbus.language import BARE, Remark
from sacbus.language.line import Line, low_byte, short


def test_a_remark_reads_as_one_sentence() -> None:
    assert str(Remark(3, "a number", "'x'", "the line does nothing")) == (
        "column 3: expected a number, got 'x': the line does nothing"
    )


def test_a_line_knows_where_its_command_ends_and_says_so_when_it_does_not() -> None:
    line = Line("S5 rest")
    assert line.ends(2)
    assert line.remarks == []
    assert not line.ends(1)
    assert line.remarks == [Remark(2, "the end of the command", "'5'", "the line does nothing")]


def test_a_number_stops_at_the_first_other_character() -> None:
    assert Line("x12a").number(1, "a number", 99, "ignored") == (12, 3)
    assert Line("x").number(1, "a number", 99, "ignored") == (None, 1)


def test_the_limit_itself_is_allowed_and_one_more_is_ignored_with_a_remark() -> None:
    line = Line("u255u256")
    assert line.number(1, "a number", 255, "it is ignored") == (255, 4)
    assert line.remarks == []
    assert line.number(5, "a number", 255, "it is ignored") == (None, 8)
    assert line.remarks == [Remark(6, "a number, at most 255", "256", "it is ignored")]


def test_a_number_may_have_any_count_of_leading_zeros() -> None:
    assert Line("0" * 9000 + "7").number(0, "a number", 255, "ignored") == (7, 9001)


def test_a_number_of_thousands_of_digits_is_ignored_and_quoted_in_short() -> None:
    line = Line("9" * 9000)
    assert line.number(0, "a number", 255, "ignored") == (None, 9000)
    assert line.remarks[0].got == "99999999999999999..."


def test_a_number_that_must_be_there_is_asked_for_where_it_is_missing() -> None:
    line = Line("t")
    assert line.whole(1, "a wait", 255, "ignored") is None
    assert line.remarks == [Remark(2, "a wait", "the end of the command", "the line does nothing")]


def test_hundredths_are_bare_without_a_number() -> None:
    assert Line("ad").hundredths(1, "an acceleration") == (BARE, 1)


def test_what_is_quoted_is_cut_beyond_twenty_characters() -> None:
    assert short("1" * 20) == "1" * 20
    assert short("1" * 21) == "1" * 17 + "..."


def test_a_number_out_of_bounds_is_refused_with_them() -> None:
    line = Line("x31")
    assert line.within(1, "a place", 0, 31) == (31, 3)
    assert line.within(1, "a place", 0, 30) is None
    assert line.remarks == [Remark(2, "a place, 0 to 30", "31", "the line does nothing")]


def test_a_position_is_1_to_30_and_its_column_is_kept() -> None:
    line = Line("q030m0")
    assert line.position(1) == (30, 4)
    assert line.columns == {"position": 2}
    assert line.position(5) is None
    assert line.columns == {"position": 2}


def test_the_low_byte_of_a_number_of_any_length() -> None:
    assert [low_byte(digits) for digits in ("0", "255", "256", "341")] == [0, 255, 0, 85]
    assert low_byte("9" * 9000) == (10**9000 - 1) % 256
