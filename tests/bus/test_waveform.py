"""Bytes read at another rate than they were sent at, bit by bit."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.bus.waveform import resampled
from sacbus.kernel import SECOND, LineRate, Ns


def read(data: bytes, of: int, at: int, bits: int = 10, ninth: bytes | None = None) -> list[bytes]:
    """Values, and ninth bits, of bytes sent without a pause."""
    rate = LineRate(of, bits)
    begins = [rate.span(index) for index in range(len(data))]
    found = resampled(data, ninth, begins, rate, LineRate(at, bits))
    return [bytes(value for _, value, _, _ in found), bytes(bit for _, _, bit, _ in found)]


@pytest.mark.slow
@given(st.binary(max_size=40), st.sampled_from((300, 9_600, 38_400, 115_200)))
def test_at_the_same_rate_the_same_bytes_are_read(data: bytes, baud: int) -> None:
    assert read(data, baud, baud)[0] == data


@pytest.mark.slow
@given(st.binary(max_size=40), st.integers(-40, 40))
def test_a_rate_that_is_off_by_four_percent_at_most_is_good_enough_for_8n1(
    data: bytes, thousandths: int
) -> None:
    assert read(data, 38_400, 38_400 * (1000 + thousandths) // 1000)[0] == data


@pytest.mark.slow
@given(st.lists(st.tuples(st.integers(0, 255), st.integers(0, 1)), max_size=20))
def test_ninth_bits_are_read_as_well(pairs: list[tuple[int, int]]) -> None:
    data, ninth = bytes(one for one, _ in pairs), bytes(bit for _, bit in pairs)
    assert read(data, 57_600, 57_600, 11, ninth) == [data, ninth]


@pytest.mark.parametrize(
    ("data", "of", "at", "expected"),
    [
        # Each bit is read twice: 0 0, 11 00 11 00 11 00 11 00, 11. The first frame ends at a low
        # bit; after the next rise another begins, whose last bit is that of the idle line.
        (b"\x55", 19_200, 38_400, b"\x66\xe6"),
        # A long low is a start bit and zeros; the line must rise before the next byte begins.
        (b"\x00", 9_600, 38_400, b"\x00"),
        # The second byte's start bit falls between two looks at the line.
        (b"\xff\xff", 38_400, 19_200, b"\xff"),
        (b"", 38_400, 19_200, b""),
    ],
)
def test_at_another_rate_other_bytes_are_read(
    data: bytes, of: int, at: int, expected: bytes
) -> None:
    assert read(data, of, at)[0] == expected


def test_bytes_are_read_to_begin_where_their_start_bit_falls() -> None:
    rate = LineRate()
    begins: list[Ns] = [0, SECOND, 2 * SECOND]
    found = resampled(b"abc", None, begins, rate, rate)
    assert [begin for begin, *_ in found] == begins


def test_a_byte_whose_stop_bit_is_low_is_told() -> None:
    def framing(data: bytes, of: int, at: int) -> list[int]:
        rate = LineRate(of)
        begins = [rate.span(index) for index in range(len(data))]
        return [lacks for *_, lacks in resampled(data, None, begins, rate, LineRate(at))]

    assert framing(b"abc", 9_600, 9_600) == [0, 0, 0]
    # A long low has no stop bit.
    assert framing(b"\x00", 9_600, 38_400) == [1]
