"""Addresses and endpoints: what is taken, what is refused and how, and there and back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.config.notation import (
    NotationError,
    addresses,
    endpoint,
    endpoint_text,
    quoted,
    ranges,
    right_addresses,
)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("10", (10,)),
        ("10-12,85", (10, 11, 12, 85)),
        ("85,10-11", (85, 10, 11)),
        (" 4 , 254 - 255 ", (4, 254, 255)),
        ("7-7", (7,)),
        ("010", (10,)),
    ],
)
def test_addresses_are_taken_in_the_order_given(text: str, found: tuple[int, ...]) -> None:
    assert addresses(text) == found


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", ["expected addresses like 10-19,85, got ''"]),
        ("ten", ["expected addresses like 10-19,85, got 'ten'"]),
        ("10-", ["expected addresses like 10-19,85, got '10-'"]),
        ("-10", ["expected addresses like 10-19,85, got '-10'"]),
        ("10--12", ["expected addresses like 10-19,85, got '10--12'"]),
        ("10,,11", ["expected addresses like 10-19,85, got ''"]),
        ("٣٤", ["expected addresses like 10-19,85, got '٣٤'"]),
        ("250-256", ["expected addresses from 0 to 255, low to high, got '250-256'"]),
        ("20-10", ["expected addresses from 0 to 255, low to high, got '20-10'"]),
        ("10-12,11-14", ["expected each address once, got 11-12 twice"]),
        (
            "x,10,300,10",
            [
                "expected addresses like 10-19,85, got 'x'",
                "expected addresses from 0 to 255, low to high, got '300'",
                "expected each address once, got 10 twice",
            ],
        ),
    ],
)
def test_all_that_is_wrong_with_addresses_is_told(text: str, faults: list[str]) -> None:
    assert right_addresses(text)[1] == tuple(faults)
    with pytest.raises(NotationError) as wrong:
        addresses(text)
    assert str(wrong.value) == "; ".join(faults)


def test_what_is_right_among_wrong_addresses_is_found_once() -> None:
    assert right_addresses("10-12,x,12-13")[0] == (10, 11, 12, 13)


@given(st.lists(st.integers(4, 255), unique=True, min_size=1))
def test_ranges_read_back_as_the_addresses_they_were_made_of(found: list[int]) -> None:
    assert addresses(ranges(found)) == tuple(found)
    assert addresses(ranges(sorted(found))) == tuple(sorted(found))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("7000", ("127.0.0.1", 7000)),
        ("0", ("127.0.0.1", 0)),
        ("127.0.0.1:7000", ("127.0.0.1", 7000)),
        ("192.0.2.1:65535", ("192.0.2.1", 65_535)),
        ("[::1]:7000", ("::1", 7000)),
        ("[::]:0", ("::", 0)),
        ("localhost:7000", ("localhost", 7000)),
        ("bench-3.example.org:7000", ("bench-3.example.org", 7000)),
        (" 7000 ", ("127.0.0.1", 7000)),
    ],
)
def test_endpoints_are_taken(text: str, found: tuple[str, int]) -> None:
    assert endpoint(text) == found


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        ":7000",
        "localhost",
        "localhost:",
        "localhost:x",
        "localhost:-1",
        "::1:7000",
        "[::1]",
        "[127.0.0.1]:7000",
        "[]:7000",
        "127.0.0:7000",
        "1.2.3.4.5:7000",
        "256.0.0.1:7000",
        "*:7000",
        "-x:7000",
        "a b:7000",
        "socket://localhost:7000",
        "localhost:7000/",
        "localhost:٣",
        "localhost:99999999999",
    ],
)
def test_what_is_no_endpoint_is_refused_with_what_one_looks_like(text: str) -> None:
    with pytest.raises(NotationError) as wrong:
        endpoint(text)
    assert str(wrong.value) == (
        "expected HOST:PORT, such as 127.0.0.1:7000 or [::1]:7000, or a port alone, "
        f"got {quoted(text)}"
    )


def test_a_port_that_does_not_exist_is_refused() -> None:
    with pytest.raises(NotationError, match=r"^expected a port from 0 to 65535, got '65536'$"):
        endpoint("localhost:65536")


@given(st.text())
def test_any_text_is_an_endpoint_that_reads_back_or_is_refused(text: str) -> None:
    try:
        found = endpoint(text)
    except NotationError as wrong:
        said = str(wrong)
    else:
        said = endpoint_text(*found)
        assert endpoint(said) == found
    assert len(said.splitlines()) == 1


@given(st.text())
def test_any_text_is_addresses_or_is_refused(text: str) -> None:
    found, faults = right_addresses(text)
    assert found or faults
    assert all(len(fault.splitlines()) == 1 for fault in faults)


def test_a_long_text_is_quoted_by_its_beginning() -> None:
    assert quoted("x" * 60) == repr("x" * 60)
    assert quoted("x" * 61) == repr("x" * 57) + "…"
