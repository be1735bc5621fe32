"""Times and bounds as people write them."""

from __future__ import annotations

import math

import pytest

from sacbus.bus.duration import TIME
from sacbus.kernel import MS
from sacbus.scenario.quantity import Bounds, QuantityError, bounds, marked_bytes, nanoseconds


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("1.5 s", None),
        (3, f"expected {TIME}, got 3"),
        (["1 s"], f"expected {TIME}, got ['1 s']"),
        ("0.5 ns", "expected a whole number of ns, got '0.5 ns'"),
        ("10000 h", "expected a time of at most a year, got '10000 h'"),
    ],
)
def test_a_time_is_the_bus_s_and_what_is_none_is_told_as_in_toml(
    value: object, expected: str | None
) -> None:
    if expected is None:
        assert nanoseconds(value) == 1_500 * MS
        return
    with pytest.raises(QuantityError) as wrong:
        nanoseconds(value)
    assert str(wrong.value) == expected


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
