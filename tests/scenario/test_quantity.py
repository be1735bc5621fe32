"""Times and bounds as people write them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.kernel import MS, SECOND, US
from sacbus.scenario.quantity import (
    LONGEST,
    Bounds,
    QuantityError,
    bounds,
    marked_bytes,
    nanoseconds,
    time_text,
)


@pytest.mark.parametrize(
    ("text", "ns"),
    [
        ("0 s", 0),
        ("7 ns", 7),
        ("10 us", 10 * US),
        ("10 µs", 10 * US),
        ("250ms", 250 * MS),
        ("1.5 s", 1_500 * MS),
        (" 0.000000001 s ", 1),
        ("2 min", 120 * SECOND),
        ("1 h", 3_600 * SECOND),
    ],
)
def test_a_time_is_a_number_with_its_unit(text: str, ns: int) -> None:
    assert nanoseconds(text) == ns


@pytest.mark.parametrize(
    "value",
    ["3", 3, 3.0, "-1 s", "1 sec", "s", "1 s 2 ms", "1e3 s", "1,5 s", True, None, ["1 s"], ""],
)
def test_anything_else_is_refused_with_an_example(value: object) -> None:
    with pytest.raises(QuantityError, match=r'^expected a time such as "250 ms" .*, got '):
        nanoseconds(value)


def test_what_is_no_whole_ns_or_longer_than_a_year_is_refused() -> None:
    with pytest.raises(QuantityError, match=r"expected a whole number of ns, got '0.5 ns'"):
        nanoseconds("0.5 ns")
    with pytest.raises(QuantityError, match="at most a year"):
        nanoseconds("10000 h")


@given(st.integers(0, LONGEST))
def test_what_a_time_reads_as_is_that_time(ns: int) -> None:
    assert nanoseconds(time_text(ns)) == ns


@pytest.mark.parametrize(
    ("ns", "text"),
    [(0, "0 s"), (999, "999 ns"), (1_500, "1.5 us"), (10_000_001, "10.000001 ms"), (SECOND, "1 s")],
)
def test_a_time_reads_in_the_largest_unit_that_fits_into_it(ns: int, text: str) -> None:
    assert time_text(ns) == text


@pytest.mark.parametrize(
    ("value", "low", "high", "text"),
    [
        (400, 400, 400, "400"),
        (-1.5, -1.5, -1.5, "-1.5"),
        ([1, 5], 1, 5, "1 to 5"),
        ("<= 3", -math.inf, 3, "at most 3"),
        (">=0.5", 0.5, math.inf, "at least 0.5"),
    ],
)
def test_bounds_are_a_number_a_pair_or_a_limit(
    value: object, low: float, high: float, text: str
) -> None:
    assert bounds(value) == Bounds(low, high)
    assert str(bounds(value)) == text
    assert low in bounds(value)
    assert high in bounds(value)
    assert low - 1 not in Bounds(low, high) or low == -math.inf


@pytest.mark.parametrize(
    "value", [True, "3", [5, 1], [1], [1, 2, 3], "< 3", math.nan, math.inf, None]
)
def test_what_bounds_nothing_is_refused(value: object) -> None:
    with pytest.raises(QuantityError, match="expected a number"):
        bounds(value)


@pytest.mark.parametrize(
    ("text", "data", "ninth"),
    [
        ("18 0c", b"\x18\x0c", None),
        ("^18 0c0f ^1d", b"\x18\x0c\x0f\x1d", b"\x01\x00\x00\x01"),
        ("55^18", b"\x55\x18", b"\x00\x01"),
    ],
)
def test_bytes_may_have_marks(text: str, data: bytes, ninth: bytes | None) -> None:
    assert marked_bytes(text) == (data, ninth)


@pytest.mark.parametrize("text", ["1", "xx", "^", "18 ^", "^^18"])
def test_what_is_no_bytes_is_refused(text: str) -> None:
    with pytest.raises(QuantityError, match="expected bytes in hexadecimal, got"):
        marked_bytes(text)
