"""Ninth bits as mark and space parity: runs of bytes that have one in common."""

from __future__ import annotations

import asyncio
import os
import tty
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.links import LinkError, open_line
from sacbus.links.marking import PARITIES, runs


def test_each_run_has_the_parity_that_makes_its_ninth_bit() -> None:
    assert list(runs(b"abcd", bytes((1, 0, 0, 1)))) == [("M", b"a"), ("S", b"bc"), ("M", b"d")]
    assert list(runs(b"", b"")) == []


@given(st.lists(st.tuples(st.integers(0, 255), st.integers(0, 1))))
def test_nothing_is_lost_and_neighbours_differ(pairs: list[tuple[int, int]]) -> None:
    data, ninth = bytes(one for one, _ in pairs), bytes(bit for _, bit in pairs)
    found = list(runs(data, ninth))
    assert b"".join(run for _, run in found) == data
    assert b"".join(bytes((PARITIES.index(p),)) * len(run) for p, run in found) == ninth
    assert all(left != right for (left, _), (right, _) in pairwise(found))


@pytest.mark.slow
@pytest.mark.asyncio
async def test_a_pty_takes_no_parity_and_who_marks_bytes_there_all_the_same_loses_it() -> None:
    far, near = os.openpty()
    tty.setraw(near)
    try:
        async with open_line(os.ttyname(near), 9_600) as line:
            lost = asyncio.get_running_loop().create_future()
            line.start(lambda _: None, lost.set_result)
            with pytest.raises(LinkError, match="no ninth bits there"):
                line.check_marking()
            line.send_marked(b"abcd", bytes((1, 0, 0, 1)))
            assert "the line is gone (invalid argument)" in await lost
    finally:
        os.close(far)
        os.close(near)


@pytest.mark.asyncio
async def test_a_socket_has_no_ninth_bits() -> None:
    server = await asyncio.start_server(lambda _r, writer: writer.close(), "127.0.0.1", 0)
    async with server:
        port = server.sockets[0].getsockname()[1]
        async with open_line(f"socket://127.0.0.1:{port}", 9_600) as line:
            with pytest.raises(LinkError, match="take a serial port, or one behind RFC 2217"):
                line.check_marking()
            line.send_marked(b"ab", b"\x01\x00")  # to nobody
