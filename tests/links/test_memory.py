"""The link in memory: what it does beyond what every link does."""

from __future__ import annotations

import pytest

from sacbus.links import LinkError, MemoryLink


@pytest.fixture
def heard() -> bytearray:
    return bytearray()


@pytest.fixture
def link(heard: bytearray) -> MemoryLink:
    link = MemoryLink("desk", capacity=8)
    link.open(heard.extend)
    return link


def test_what_a_client_writes_is_delivered_before_write_returns(
    link: MemoryLink, heard: bytearray
) -> None:
    link.client().write(b"now")
    assert heard == b"now"


def test_a_listening_client_hears_before_send_returns(link: MemoryLink) -> None:
    chunks: list[bytes] = []
    client = link.client(chunks.append)
    link.send(b"longer than the buffer")
    link.send(b"x")
    assert chunks == [b"longer than the buffer", b"x"]
    assert client.read() == b""
    assert link.counters.dropped_out == 0


def test_a_client_reads_as_much_as_it_asks_for(link: MemoryLink) -> None:
    client = link.client()
    link.send(b"abcdef")
    assert [client.read(2), client.read(0), client.read(), client.read()] == [
        b"ab",
        b"",
        b"cdef",
        b"",
    ]


def test_the_buffer_is_bounded_and_what_does_not_fit_is_counted(link: MemoryLink) -> None:
    client = link.client()
    link.send(b"12345")
    link.send(b"67890")
    assert client.read() == b"12345678"
    assert (link.counters.bytes_out, link.counters.dropped_out) == (8, 2)


def test_the_client_sets_the_rate_and_takes_it_along(link: MemoryLink) -> None:
    client = link.client(baud=9600)
    assert link.client_baud() == 9600
    client.baud = 57_600
    assert link.client_baud() == 57_600
    client.close()
    assert link.client_baud() == 38_400


def test_a_second_client_is_refused(link: MemoryLink) -> None:
    link.client()
    with pytest.raises(LinkError, match="desk, close that one first"):
        link.client()


def test_a_closed_link_has_no_clients() -> None:
    with pytest.raises(LinkError, match="desk, open it first"):
        MemoryLink("desk").client()


def test_a_client_that_has_left_can_neither_write_nor_disturb_the_next(
    link: MemoryLink, heard: bytearray
) -> None:
    former = link.client()
    former.close()
    present = link.client()
    link.send(b"yours")
    former.close()
    with pytest.raises(LinkError):
        former.write(b"ghost")
    assert (former.read(), present.read(), bytes(heard)) == (b"", b"yours", b"")


def test_a_client_of_before_stays_dead_when_the_link_is_opened_again(link: MemoryLink) -> None:
    client = link.client()
    link.close()
    link.open(lambda data: None)
    with pytest.raises(LinkError):
        client.write(b"ghost")
