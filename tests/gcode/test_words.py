"""A line taken apart: the cases that parsers of G-code were tried against, and any text at all."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.gcode.words import column_of, flaw_at, split_words, uncommented


def words(text: str) -> str:
    """A line's words with a blank between them, and what no word can be made of."""
    body = uncommented(text).body
    found, end = split_words(body)
    return " ".join([*map("".join, found), *([f"?{body[end:]}"] if end < len(body) else [])])


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("G1 X1 F100\n", "G1 X1 F100"),
        ("X2\r\n", "X2"),
        ("G28.1 X0", "G28.1 X0"),
        ("G1X1Y2F300", "G1 X1 Y2 F300"),
        ("g1 x1 y-.5", "G1 X1 Y-.5"),
        ("G 1 X 1 0 Y - 2 Z+ . 5", "G1 X10 Y-2 Z+.5"),
        ("\tG1\tX1 \t", "G1 X1"),
        ("N10 G01 X007. Y0.", "N10 G01 X007. Y0."),
        ("G90 G1 G0", "G90 G1 G0"),
        ("", ""),
        (" \n", ""),
    ],
)
def test_blanks_and_cases_mean_nothing(text: str, read: str) -> None:
    assert words(text) == read


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("(all of it)", ""),
        ("G1 (X5) X1(Y5)Y(in the middle)2", "G1 X1 Y2"),
        ("G1 X1 ; Y5", "G1 X1"),
        ("G1 (; is nothing here) X1 ;) (", "G1 X1"),
        ("G1 (größer, 5 µm) X1", "G1 X1"),
        ("(MSG, one) G1 ( msg , two  words )", "G1"),
    ],
)
def test_comments_are_left_out_wherever_they_stand(text: str, read: str) -> None:
    assert words(text) == read
    assert uncommented(text).flaws == ()


def test_messages_are_kept_in_their_order() -> None:
    assert uncommented("(MSG, one) G1 (no) ( m S g , two  words )").messages == ("one", "two words")


def test_a_message_is_one_line_that_moves_no_cursor() -> None:
    assert uncommented("(MSG,\tred \x1b[31m)").messages == ("red ?[31m",)
    assert uncommented("(MSG, )").messages == ()


@pytest.mark.parametrize(
    "text", ["X1..2", "X", "X1Y", "#1=5", "X[1+2]", "O<sub>", "X1/Y2", "X+-1", "$H", "X1é", "Xé1"]
)
def test_what_is_no_word_is_left_over(text: str) -> None:
    assert "?" in words(text)


@given(st.text())
def test_any_text_is_taken_apart_without_an_exception(text: str) -> None:
    read = uncommented(text)
    found, end = split_words(read.body)
    assert "".join(letter + number for letter, number in found) == read.body[:end]
    if end < len(read.body):
        flaw = flaw_at(read.body, end)
        assert 0 <= flaw.at <= end
        assert f"{flaw.shown}{flaw.what}{flaw.remedy}".isprintable()
        assert 1 <= column_of(text, flaw.at) <= len(text)


@given(
    st.lists(st.sampled_from(["g", "1", "X", "-", ".5", " ", "\t", "(a)", "(é;", ")", ";", "é"]))
)
def test_a_column_is_that_of_the_character(parts: list[str]) -> None:
    text = "".join(parts)
    read = uncommented(text)
    if not read.flaws:
        shown = [text[column_of(text, place) - 1].upper() for place in range(len(read.body))]
        assert "".join(shown) == read.body.upper()
