"""A client at another rate than the line's hears and says something else."""

from __future__ import annotations

from random import Random

import pytest

from sacbus.links import MemoryLink, Tuning
from sacbus.links.link import SerialFormat

BYTES = bytes(range(256))


class FormattedMemory(MemoryLink):
    """A link in memory whose client can set its format."""

    format = SerialFormat()

    def client_format(self) -> SerialFormat:
        return self.format


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


def spoils(form: SerialFormat, bits: int) -> bool:
    link = FormattedMemory(baud=38_400)
    link.format = form
    tuning = Tuning(link, 38_400, Random(0), str, nine=bits == 11)
    assert (tuning.from_client(BYTES) == BYTES) == (tuning.to_client(BYTES) == BYTES)
    return tuning.from_client(BYTES) != BYTES


@pytest.mark.parametrize("parity", "NEOMS")
@pytest.mark.parametrize("data_bits", [5, 6, 7, 8])
def test_only_what_is_on_the_line_passes(data_bits: int, parity: str) -> None:
    for stop_bits in (1, 1.5, 2):
        form = SerialFormat(data_bits, parity, stop_bits)
        assert spoils(form, 10) == (data_bits != 8 or parity != "N")
        assert spoils(form, 11) == (data_bits != 8 or parity in "EO")


def test_a_wrong_format_is_told_once_and_after_the_rate() -> None:
    told: list[str] = []
    link = FormattedMemory(where="somewhere", baud=38_400)
    link.open(lambda _data: None)
    client = link.client(baud=9_600)
    link.format = SerialFormat(7, "E", 1)
    tuning = Tuning(link, 38_400, Random(0), told.append)
    for _ in range(3):
        tuning.from_client(BYTES)
    client.baud = 38_400
    for _ in range(3):
        tuning.from_client(BYTES)
    link.format = SerialFormat(8, "O", 2)
    tuning.from_client(BYTES)
    link.format = SerialFormat()
    assert tuning.from_client(BYTES) == BYTES
    assert told == [
        "the program on somewhere has set 9600 baud, the line runs at 38400: bytes arrive garbled",
        "the program on somewhere has set 7E1, the line is 8N1: bytes arrive garbled",
        "the program on somewhere has set 8O2, the line is 8N1: bytes arrive garbled",
    ]


def test_a_line_with_ninth_bits_says_so_where_a_format_is_wrong() -> None:
    told: list[str] = []
    link = FormattedMemory(where="somewhere", baud=38_400)
    link.format = SerialFormat(8, "E", 1)
    Tuning(link, 38_400, Random(0), told.append, nine=True).from_client(BYTES)
    (text,) = told
    assert text.endswith("has set 8E1, the line is 8N1 with a ninth bit: bytes arrive garbled")


@pytest.mark.parametrize(("parity", "ninth"), [("M", 1), ("S", 0), ("N", None), ("E", None)])
def test_parity_is_the_ninth_bit_where_there_is_one(parity: str, ninth: int | None) -> None:
    link = FormattedMemory(baud=38_400)
    link.format = SerialFormat(8, parity)
    assert Tuning(link, 38_400, Random(0), str, nine=True).ninth() == ninth
    assert Tuning(link, 38_400, Random(0), str).ninth() is None
    assert Tuning(MemoryLink(), 38_400, Random(0), str, nine=True).ninth() is None
