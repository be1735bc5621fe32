"""A client at another rate than the line's hears and says something else."""

from __future__ import annotations

from random import Random

from sacbus.links import MemoryLink, Tuning

BYTES = bytes(range(256))


def test_at_the_line_s_rate_bytes_pass_as_they_are_and_nothing_is_told() -> None:
    told: list[str] = []
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    link.client()
    tuning = Tuning(link, 38_400, Random(0), told.append)
    assert tuning.pass_on(BYTES) == BYTES
    assert (told, tuning.spoilt) == ([], 0)


def test_at_another_rate_every_byte_is_another_and_it_is_told_once() -> None:
    told: list[str] = []
    link = MemoryLink(where="somewhere", baud=38_400)
    link.open(lambda _data: None)
    client = link.client(baud=9_600)
    tuning = Tuning(link, 38_400, Random(0), told.append)
    for _ in range(3):
        arrived = tuning.pass_on(BYTES)
        assert len(arrived) == len(BYTES)
        assert all(was != is_now for was, is_now in zip(BYTES, arrived, strict=True))
    assert told == [
        "the program on somewhere has set 9600 baud, the line runs at 38400: bytes arrive garbled"
    ]
    assert tuning.spoilt == 3 * len(BYTES)

    client.baud = 38_400
    assert tuning.pass_on(BYTES) == BYTES
    client.baud = 19_200
    assert tuning.pass_on(BYTES) != BYTES
    assert len(told) == 2


def test_the_same_seed_spoils_the_same_way() -> None:
    link = MemoryLink(baud=38_400)
    link.open(lambda _data: None)
    link.client(baud=1_200)
    first, second = (Tuning(link, 38_400, Random(7), str).pass_on(BYTES) for _ in range(2))
    assert first == second
