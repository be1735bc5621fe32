"""A client at another rate than the line's hears and says something else."""

from __future__ import annotations

from random import Random

import pytest

from sacbus.links import MemoryLink, Tuning

BYTES = bytes(range(256))


def test_at_the_line_s_rate_bytes_pass_as_they_are_and_nothing_is_told() -> None:
    told: list[str] = []
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    link.client()
    tuning = Tuning(link, 38_400, Random(0), told.append)
    assert tuning.from_client(BYTES) == BYTES
    assert (told, tuning.spoilt) == ([], 0)


def test_at_another_rate_every_byte_is_another_and_it_is_told_once() -> None:
    told: list[str] = []
    link = MemoryLink(where="somewhere", baud=38_400)
    link.open(lambda _data: None)
    client = link.client(baud=9_600)
    tuning = Tuning(link, 38_400, Random(0), told.append)
    for _ in range(3):
        arrived = tuning.from_client(BYTES)
        assert len(arrived) == len(BYTES)
        assert all(was != is_now for was, is_now in zip(BYTES, arrived, strict=True))
    assert told == [
        "the program on somewhere has set 9600 baud, the line runs at 38400: bytes arrive garbled"
    ]
    assert tuning.spoilt == 3 * len(BYTES)

    client.baud = 38_400
    assert tuning.from_client(BYTES) == BYTES
    client.baud = 19_200
    assert tuning.from_client(BYTES) != BYTES
    assert len(told) == 2


def test_the_same_seed_spoils_the_same_way() -> None:
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    link.client(baud=1_200)
    first, second = (Tuning(link, 38_400, Random(7), str).from_client(BYTES) for _ in range(2))
    assert first == second


@pytest.mark.parametrize("rate", [37_500, 38_400, 38_462, 39_300])
def test_rates_within_two_and_a_half_per_cent_are_the_same(rate: int) -> None:
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    link.client(baud=rate)
    assert Tuning(link, 38_400, Random(0), str).from_client(BYTES) == BYTES


@pytest.mark.parametrize("rate", [37_400, 39_400])
def test_rates_beyond_that_are_not(rate: int) -> None:
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    link.client(baud=rate)
    assert Tuning(link, 38_400, Random(0), str).from_client(BYTES) != BYTES


def test_a_client_that_only_listens_is_looked_at_too() -> None:
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    client = link.client(baud=38_400)
    tuning = Tuning(link, 38_400, Random(0), str)
    assert tuning.to_client(BYTES) == BYTES
    client.baud = 9_600
    assert tuning.to_client(BYTES) != BYTES
    client.baud = 38_400
    tuning.from_client(BYTES)
    client.baud = 9_600
    # What it wrote last is trusted for a few packets, not for ever.
    assert any(tuning.to_client(BYTES) != BYTES for _ in range(9))
