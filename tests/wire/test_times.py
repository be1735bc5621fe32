"""The device's own times: the figures that were measured, and the straight lines between them."""

from __future__ import annotations

import pytest

from sacbus.wire.times import deaf_time, turnaround

US = 1_000


@pytest.mark.parametrize(
    ("body", "nul_follows", "us"),
    [
        (5, True, 385),  # spec, wire: from the end of the NUL
        (5, False, 406),  # when nothing follows the trigger byte
        (0, True, 385),
        (6, True, 398),
        (46, True, 385 + 13 * 41),  # measured: 911 from the NUL
    ],
)
def test_the_turnaround_grows_by_13_us_a_character_beyond_five(
    body: int, nul_follows: bool, us: int
) -> None:
    assert turnaround(body, nul_follows=nul_follows) == us * US


@pytest.mark.parametrize(
    ("body", "answered", "us"),
    [(5, True, 310), (0, True, 310), (39, True, 560), (5, False, 370), (39, False, 620)],
)
def test_a_node_is_deaf_for_as_long_as_was_measured(body: int, answered: bool, us: int) -> None:
    assert deaf_time(body, answered=answered) == us * US
