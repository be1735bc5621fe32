"""The picture: what it says, and that it is the same file every time."""

from __future__ import annotations

import io
import re

import pytest

from sacbus.simad import Steps, encode
from sacbus.simad.excerpt import excerpt
from sacbus.simad.picture import draw_lines

pytestmark = pytest.mark.slow


def drawn(form: str = "svg") -> bytes:
    steps = Steps.of(
        [10_000, 10_000, 13_000, 60_000, 2_000_000], [0, 2, 1, 0, 1], [1, 1, -1, -1, 1]
    )
    coded = encode(steps, 3)
    file = io.BytesIO()
    draw_lines(excerpt(steps, coded.falls, coded.edges), ("X", "Y", "Z"), file, form)
    return file.getvalue()


def test_it_says_which_lines_ways_and_times_they_are() -> None:
    said = re.findall(r"<text[^>]*>([^<]*)</text>", drawn().decode())
    assert [one for one in said if one in {"DIR", "X", "Y", "Z"}] == ["Z", "Y", "X", "DIR"]
    assert (said.count("CW"), said.count("CCW")) == (3, 2)
    # Falls in us after the first, and how long DIR had been set.
    assert {"0", "4.5", "50", "1990"} <= set(said)
    assert {"4 µs", "1939.5 µs"} <= set(said)
    assert "5 steps, number 1 on, from 0.000010000 s" in said
    # Two long times are cut, on all four lines.
    assert said.count("≈") == 8


def test_it_is_the_same_file_every_time() -> None:
    assert drawn() == drawn()
    assert drawn("png").startswith(b"\x89PNG")
