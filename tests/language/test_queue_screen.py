"""The queue screen: the manual's picture read and written, and every value of a row kept."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import NO_RAMP, Defaults, Motion, seeded_row
from sacbus.language.queue_file import QueueRow
from sacbus.language.queue_screen import QueueScreen, WrongScreen
from tests.language.strategies import BITS_32

#: The manual's picture ("Queue"), with the spec's last line; a queue of 12 in its time.
PICTURE = """\
Q	Steps		RPM	Cycle	Acc	Dec	usteps	deltaT
=====
1	800	CW	150	2000	1.00	1.00	0	3000
2	600	CCW	50	6000	1.00	1.00	0	s 3000
3	2000	+CW	150	2000	*10.47	10.47	0	0
4	1200	CCW	100	3000	*10.47	10.47	0	s 0
5	200	CW	20	15000	1.00	1.00	0	0
6	2000	+CCW	100	3000	1.00	1.00	0	1000000
7	1600	CW	120	2500	1.00	1.00	0	s 0
8	200	CW	20	15000	*10.47	10.47	0	0
9	2000	+CCW	200	1500	1.00	1.00	0	0
10	2000	CW	60	5000	1.00	1.00	0	2000000
11	4000	CW	160	1875	*5.00	5.00	0	3000000
12	2000	CCW	100	3000	*10.47	10.47	0	0
=====
Q is at 1  + pulse  * linear  s sync
"""

motions = st.builds(
    Motion,
    st.none() | st.integers(1, BITS_32),
    st.booleans(),
    st.integers(0, BITS_32),
    st.integers(1, BITS_32),
    st.integers(1, NO_RAMP),
    st.integers(1, NO_RAMP),
    st.booleans(),
    st.integers(0, 255),
    st.integers(0, BITS_32),
    st.booleans(),
    st.booleans(),
)
screens = st.builds(
    QueueScreen,
    st.lists(st.builds(QueueRow, st.integers(0, 31), motions), max_size=32).map(tuple),
    st.integers(1, 30),
)


def printed(screen: QueueScreen) -> str:
    return "".join(line + "\r\n" for line in screen.lines())


def read(text: str) -> QueueScreen:
    screen = QueueScreen.read(text)
    assert screen is not None
    return screen


def test_the_manuals_picture_is_read_and_written_to_the_character() -> None:
    screen = read(PICTURE)
    assert "\n".join(screen.lines()) + "\n" == PICTURE
    assert [row.position for row in screen.rows] == list(range(1, 13))
    assert screen.rows[1].motion == Motion(600, False, 50, 6000, 100, 100, False, 0, 3000, True)
    assert screen.rows[2].motion == Motion(2000, True, 150, 2000, 1047, 1047, True, pulses=True)
    assert screen.next_free == 1


@given(screens)
def test_what_is_printed_is_read_back_equal(screen: QueueScreen) -> None:
    assert read(printed(screen)) == screen


@given(screens, st.text(alphabet="SAC>q\r\n\t =123", max_size=40))
def test_what_stands_around_a_screen_does_not_matter(screen: QueueScreen, around: str) -> None:
    text = f"{around}\r\nSAC>q\r\n{printed(screen)}SAC>"
    assert read(text) == screen


@given(screens)
def test_a_screen_is_not_there_before_its_last_line_is(screen: QueueScreen) -> None:
    text = printed(screen)
    before = text[: text.index("Q is at")]
    assert QueueScreen.read(before) is None
    assert QueueScreen.read(text[text.index("\r\n") :]) is None


def test_the_last_of_several_screens_counts() -> None:
    one = QueueScreen((QueueRow(1, seeded_row(Defaults())),), 2)
    damaged = PICTURE.replace("800", "8x0")
    assert read(damaged + printed(one)) == one


def test_a_last_line_alone_ends_no_screen() -> None:
    assert read(PICTURE + "Q is at 9\n") == read(PICTURE)


def test_spaces_do_as_well_as_tabs_and_empty_lines_are_passed_over() -> None:
    spaced = PICTURE.replace("\t", "  ").replace("=====", "\n" + "=" * 70 + "\n")
    assert read(spaced) == read(PICTURE)


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ("1\t800\tCW", "1\t800\tcw"),
        ("1\t800\tCW", "1\t800\t"),
        ("1\t800\tCW", "1\t4294967296\tCW"),
        ("1\t800\tCW", "32\t800\tCW"),
        ("800\tCW\t150\t2000", "800\tCW\t150\t0"),
        ("800\tCW\t150\t2000\t1.00", "800\tCW\t150\t2000\t0.00"),
        ("800\tCW\t150\t2000\t1.00\t1.00", "800\tCW\t150\t2000\t1.00\t999.01"),
        ("800\tCW\t150\t2000\t1.00\t1.00\t0", "800\tCW\t150\t2000\t1.00\t1.00\t256"),
        ("0\t3000\n", "0\tS 3000\n"),
        ("0\t3000\n", "0\t3000\tx\n"),
        ("1\t800", "1\t" + "9" * 5000),
        ("1\t800", "\u0661\t800"),
    ],
)
def test_a_line_that_is_no_row_is_named(good: str, bad: str) -> None:
    assert good in PICTURE
    with pytest.raises(WrongScreen) as caught:
        QueueScreen.read("SAC>q\n" + PICTURE.replace(good, bad, 1))
    assert caught.value.line == 4
    assert "line 4, expected position, steps" in str(caught.value)
    assert len(str(caught.value)) < 350


@given(st.text())
def test_no_text_makes_anything_but_a_screen_or_none(text: str) -> None:
    assert QueueScreen.read(text) is None
