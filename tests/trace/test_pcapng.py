"""Blocks of a capture as an independent reader of the format reads them, python-pcapng."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sacbus.trace.pcapng import LINKTYPE_USER0, LINKTYPE_USER1, interface, packet, section
from tests.trace.captured import interfaces_of, packets_of, section_of, time_ns

WIRE = interface("wire", "a wire", link_type=LINKTYPE_USER0, bits_per_second=38_400)
#: Times of a capture: ns since 1970, in 64 bits.
TIMES = st.integers(0, (1 << 64) - 1)
TEXTS = st.text(max_size=30)


def test_a_section_tells_what_made_it() -> None:
    header = section_of(section("sacbus 1.2"))
    assert header.endianness == "<"
    assert header.version == (1, 0)
    assert header.length == -1
    assert header.options["shb_userappl"] == "sacbus 1.2"


def test_an_interface_tells_its_name_its_rate_and_that_times_are_in_nanoseconds() -> None:
    other = interface("other", "b", link_type=LINKTYPE_USER1, bits_per_second=9_600)
    one, two = interfaces_of(section("test") + WIRE + other)
    for block in (one, two):
        assert block.snaplen == 0
        assert block.timestamp_resolution == 1e-9
    assert (one.interface_id, one.link_type) == (0, 147)
    assert (two.interface_id, two.link_type) == (1, 148)
    assert one.options["if_name"] == "wire"
    assert one.options["if_description"] == "a wire"
    assert (one.options["if_speed"], two.options["if_speed"]) == (38_400, 9_600)
    assert b"\x09\x00\x01\x00\x09\x00\x00\x00" in WIRE  # if_tsresol, as it is written


@given(TIMES, st.binary(max_size=300), st.lists(TEXTS, max_size=3), st.integers(0, 1 << 40))
def test_a_packet_comes_back_as_it_was(
    time: int, data: bytes, comments: list[str], dropped: int
) -> None:
    block = packets_of(section("test") + WIRE + packet(0, time, data, comments, dropped=dropped))[0]
    assert (block.interface_id, time_ns(block)) == (0, time)
    assert (block.packet_data, block.captured_len, block.packet_len) == (data, len(data), len(data))
    assert block.options.get_all("opt_comment") == comments
    assert block.options.get("epb_dropcount") == (dropped or None)


@given(st.lists(st.tuples(TIMES, st.binary(max_size=20)), max_size=5))
def test_packets_follow_each_other_in_order(packets: list[tuple[int, bytes]]) -> None:
    capture = b"".join(packet(0, time, data) for time, data in packets)
    read = packets_of(section("test") + WIRE + capture)
    assert [(time_ns(one), one.packet_data) for one in read] == packets


def test_every_block_tells_its_length_at_both_ends_and_is_a_multiple_of_four() -> None:
    for block in (section("x"), WIRE, packet(0, 1, b"12345", ["abc"], dropped=1)):
        assert len(block) % 4 == 0
        assert block[4:8] == block[-4:] == len(block).to_bytes(4, "little")


def test_a_comment_too_long_for_an_option_loses_its_end_and_stays_text() -> None:
    comment = "ä" * 40_000  # 80 000 bytes
    block = packets_of(section("test") + WIRE + packet(0, 0, b"", [comment]))[0]
    assert block.options["opt_comment"] == "ä" * 32_767


def test_text_that_is_no_unicode_can_be_a_comment() -> None:
    block = packets_of(section("test") + WIRE + packet(0, 0, b"", ["a path \udcff"]))[0]
    assert block.options["opt_comment"] == "a path \\udcff"
