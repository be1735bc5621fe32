"""Times as people write them: one notation, wherever one is written."""

from __future__ import annotations

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.bus import FaultError, fault_from
from sacbus.bus.duration import LONGEST, DurationError, duration, time_text
from sacbus.cli.recordings import span
from sacbus.kernel import MS, SECOND, US
from sacbus.scenario.quantity import QuantityError, nanoseconds


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
    assert duration(text) == ns


@pytest.mark.parametrize(
    "value",
    ["3", 3, 3.0, "-1 s", "1 sec", "s", "1 s 2 ms", "1e3 s", "1,5 s", True, None, ["1 s"], ""],
)
def test_anything_else_is_refused_with_an_example(value: object) -> None:
    with pytest.raises(DurationError, match=r'^a time such as "250 ms" '):
        duration(value)


def test_what_is_no_whole_ns_or_longer_than_a_year_is_refused() -> None:
    with pytest.raises(DurationError, match=r"^a whole number of ns$"):
        duration("0.5 ns")
    with pytest.raises(DurationError, match="at most a year"):
        duration("10000 h")


@given(st.integers(0, LONGEST))
def test_what_a_time_reads_as_is_that_time(ns: int) -> None:
    assert duration(time_text(ns)) == ns


@pytest.mark.parametrize(
    ("ns", "text"),
    [(0, "0 s"), (999, "999 ns"), (1_500, "1.5 us"), (10_000_001, "10.000001 ms"), (SECOND, "1 s")],
)
def test_a_time_reads_in_the_largest_unit_that_fits_into_it(ns: int, text: str) -> None:
    assert time_text(ns) == text


def at_the_command_line(text: str) -> int:
    option = click.Option(["--time"])
    return span(click.Context(click.Command("x")), option, text)


def of_a_fault(text: str) -> int:
    fault = fault_from({"latency": {"by": text}})
    by = getattr(fault, "by", None)
    assert isinstance(by, int)
    return by


@pytest.mark.parametrize("text", ["16 ms", "16ms", " 1.5  s", "2 min", "0.25 h", "7 µs", "1 ns"])
def test_a_time_is_written_alike_in_scenarios_of_faults_and_at_the_command_line(text: str) -> None:
    assert at_the_command_line(text) == of_a_fault(text) == nanoseconds(text) == duration(text)


@pytest.mark.parametrize("text", ["16", "1 sec", "0.5 ns", "9999999999999 s", "-1 s", ""])
def test_what_is_none_is_told_of_alike(text: str) -> None:
    told = []
    for read in (at_the_command_line, of_a_fault, nanoseconds):
        with pytest.raises((click.BadParameter, FaultError, QuantityError)) as wrong:
            read(text)
        told.append(str(wrong.value).removeprefix("fault 'latency.by': "))
    with pytest.raises(DurationError) as bare:
        duration(text)
    assert told == [f"expected {bare.value.expected}, got {text!r}"] * 3
