"""The line's time as the time of day."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from sacbus.kernel import MS, SECOND
from sacbus.monitor.output import WallClock

NOON = datetime(2024, 2, 29, 12, tzinfo=UTC)
NOON_NS = int(NOON.timestamp()) * SECOND


def test_a_time_of_the_line_is_told_from_one_that_is_known() -> None:
    clock = WallClock()
    clock.set(5 * SECOND, NOON_NS)
    assert clock(5 * SECOND) == NOON
    assert clock(5 * SECOND + 1_234 * MS) == NOON + timedelta(milliseconds=1_234)
    assert clock(0) == NOON - timedelta(seconds=5)


def test_where_the_lines_time_runs_faster_the_clock_goes_its_own_pace() -> None:
    clock = WallClock()
    clock.set(5 * SECOND, NOON_NS, speed=10)
    assert clock(25 * SECOND) == NOON + timedelta(seconds=2)


def test_it_is_local_time() -> None:
    clock = WallClock()
    clock.set(0, NOON_NS)
    assert clock(0).utcoffset() == NOON.astimezone().utcoffset()
