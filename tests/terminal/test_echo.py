"""The echo of a line taken out of what a terminal port shows."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.terminal.echo import LineEcho


def stripped(line: bytes, shown: bytes, *cuts: int) -> bytes:
    """What is left of ``shown``, that comes in pieces, once nothing more comes."""
    echo = LineEcho(line)
    places = [0, *sorted(cuts), len(shown)]
    pieces = [shown[one:next_] for one, next_ in pairwise(places)]
    left = b"".join(echo.strip(piece) for piece in pieces if piece)
    return left + (b"" if echo.over else echo.settle())


SHOWN = [
    (b"q", b"q\r\n\r\nQ\tSteps", b"\r\nQ\tSteps"),
    (b"m400", b"m400\r\nSAC>", b"SAC>"),
    (b"m400", b"m400\rSAC>", b"SAC>"),
    (b"m400", b"m400\nSAC>", b"SAC>"),
    (b"m400", b"m400SAC>", b"SAC>"),
    (b"", b"\r\nSAC>", b"SAC>"),
    (b"q", b"q\r", b""),
    (b"q", b"q", b""),
    # No echo, or that of another line: nothing is lost.
    (b"q", b"\r\nQ\tSteps", b"\r\nQ\tSteps"),
    (b"m400", b"m40", b"m40"),
    (b"m400", b"m4\r\n2bi", b"m4\r\n2bi"),
    (b"m400", b"m4\r\nSAC>", b"m4\r\nSAC>"),
    (b"m400", b"\r\n2big.\r\nSAC>", b"\r\n2big.\r\nSAC>"),
    # A line that is too long is echoed as far as it was taken.
    (b"m400", b"m4\r\n2big.\r\nSAC>", b"2big.\r\nSAC>"),
    (b"m400", b"m4\r2big.\r\nSAC>", b"2big.\r\nSAC>"),
    (b"m400", b"m4\n2big.\nSAC>", b"2big.\nSAC>"),
]


@pytest.mark.parametrize(("line", "shown", "left"), SHOWN, ids=[repr(one[1]) for one in SHOWN])
def test_the_echo_is_taken_out_whatever_pieces_it_comes_in(
    line: bytes, shown: bytes, left: bytes
) -> None:
    assert stripped(line, shown) == left
    assert stripped(line, shown, *range(len(shown))) == left
    for cut in range(len(shown)):
        assert stripped(line, shown, cut) == left


@given(st.binary(max_size=6), st.binary(max_size=12), st.lists(st.integers(0, 12), max_size=4))
def test_pieces_make_no_difference(line: bytes, shown: bytes, cuts: list[int]) -> None:
    assert stripped(line, shown, *(min(cut, len(shown)) for cut in cuts)) == stripped(line, shown)
    assert shown.endswith(stripped(line, shown))


def test_what_is_no_echo_is_shown_at_once() -> None:
    echo = LineEcho(b"q")
    assert echo.strip(b"x") == b"x"
    assert echo.strip(b"q\r\n") == b"q\r\n"
