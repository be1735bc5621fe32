"""The server of RFC 2217, as programs of others meet it: pyserial's client, and bare telnet."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from random import Random

import pytest
import pytest_asyncio
import serial
from serial import rfc2217

from sacbus.links import MemoryClient, MemoryLink, Tuning
from sacbus.links.link import FormattedLink, SerialFormat
from sacbus.links.rfc2217 import Rfc2217Link, Rfc2217Server
from tests.links.programs import TcpProgram, TelnetProgram
from tests.links.rig import Ear, ServerRig, until

EVERY_BYTE = bytes(range(256))

#: Seconds that pyserial's client may wait for us. Only a failing test waits so long.
PATIENCE = 20


@pytest_asyncio.fixture
async def rig() -> AsyncIterator[ServerRig]:
    rig = ServerRig(Rfc2217Server(), TelnetProgram)
    await rig.start()
    yield rig
    rig.close()


@contextmanager
def port_at(url: str, baud: int) -> Iterator[rfc2217.Serial]:
    """pyserial's client. It waits in everything it does, so only for threads."""
    port = serial.serial_for_url(url, baud, timeout=PATIENCE)
    assert isinstance(port, rfc2217.Serial)
    try:
        yield port
    finally:
        port.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # pyserial's
@pytest.mark.asyncio
async def test_pyserial_opens_it_sets_it_and_talks(rig: ServerRig) -> None:
    def echo(data: bytes) -> None:
        rig.link.send(data)

    rig.deliver = echo
    seen: list[tuple[int | None, SerialFormat]] = []

    def see() -> None:
        assert isinstance(rig.link, FormattedLink)
        seen.append((rig.link.client_baud(), rig.link.client_format()))

    def program() -> None:
        with port_at(rig.where, 9600) as port:
            see()
            port.baudrate = 57_600
            port.parity = serial.PARITY_EVEN
            port.bytesize = serial.SEVENBITS
            port.stopbits = serial.STOPBITS_TWO
            see()
            port.rts = False
            port.dtr = False
            assert port.cts
            assert port.dsr
            assert port.cd
            assert not port.ri
            port.write(EVERY_BYTE * 4)
            assert port.read(1024) == EVERY_BYTE * 4
            port.reset_input_buffer()
            port.reset_output_buffer()
            port.break_condition = True
            port.break_condition = False
            port.write(b"and on")
            assert port.read(6) == b"and on"

    await asyncio.to_thread(program)
    assert seen == [(9600, SerialFormat()), (57_600, SerialFormat(7, "E", 2))]
    counters = rig.counters
    assert (counters.bytes_in, counters.bytes_out, counters.dropped_out) == (1030, 1030, 0)


PROGRAM = """
import sys, serial
port = serial.serial_for_url(sys.argv[1], 19200, parity="M", timeout=20)
port.write(bytes(range(256)))
assert port.read(256) == bytes(range(256))[::-1]
port.close()
"""


@pytest.mark.slow
@pytest.mark.asyncio
async def test_programs_of_other_processes_have_settings_of_their_own(rig: ServerRig) -> None:
    programs = [
        await asyncio.create_subprocess_exec(sys.executable, "-c", PROGRAM, rig.where)
        for _ in range(2)
    ]
    other = await rig.client_is_known()
    await until(lambda: len(rig.links) == 3 and rig.counters.bytes_in == 512)
    for link in rig.links:
        assert isinstance(link, FormattedLink)
        if link.counters.bytes_in:
            assert (link.client_baud(), link.client_format().parity) == (19_200, "M")
            link.send(EVERY_BYTE[::-1])
        else:
            assert (link.client_baud(), link.client_format()) == (38_400, SerialFormat())
    for program in programs:
        assert await program.wait() == 0
    assert other.read() == b""


@pytest.mark.asyncio
async def test_its_place_and_its_kind_say_what_it_is(rig: ServerRig) -> None:
    await rig.client_is_known()
    assert rig.server.kind == rig.link.kind == "rfc2217"
    assert rig.where.startswith("rfc2217://127.0.0.1:")
    assert Rfc2217Server("::1", 7001).where == "rfc2217://[::1]:7001"


@pytest.mark.asyncio
async def test_the_rate_that_programs_find_is_the_bus_s() -> None:
    server = Rfc2217Server("127.0.0.1", 0, 9600)
    rig = ServerRig(server, TcpProgram)
    await rig.start()
    client = await rig.client_is_known()
    assert rig.link.client_baud() == 9600
    asks, told = b"\xff\xfa\x2c\x01\0\0\0\0\xff\xf0", b"\xff\xfa\x2c\x65\0\0\x25\x80\xff\xf0"
    client.write(asks)
    ear = Ear(client)
    await until(lambda: ear.has_bytes(1) and told in ear.heard)
    rig.close()


class Desk:
    """A program that speaks RFC 2217 to a link without any network in between."""

    def __init__(self) -> None:
        self._stream = MemoryLink("desk")
        self.link = Rfc2217Link(self._stream, 38_400)

    def opens(self, deliver: Callable[[bytes], None]) -> MemoryClient:
        self.link.open(deliver)
        return self._stream.client()


def sets(what: int, value: int) -> bytes:
    """A suboption that sets one byte."""
    return b"\xff\xfa\x2c%c%c\xff\xf0" % (what, value)


def test_the_wrong_format_garbles_and_is_told_in_words() -> None:
    desk, told, heard = Desk(), list[str](), list[bytes]()
    tuning = Tuning(desk.link, 38_400, Random(0), told.append)
    program = desk.opens(lambda data: heard.append(tuning.from_client(data)))
    program.write(b"right" + sets(2, 7) + sets(3, 3))
    program.write(b"wrong" + sets(2, 8) + sets(3, 1))
    program.write(b"again")
    assert heard[0] == b"right"
    assert heard[1] != b"wrong"
    assert heard[2] == b"again"
    assert told == ["the program on desk has set 7E1, the line is 8N1: bytes arrive garbled"]


def test_mark_and_space_set_the_ninth_bit_of_the_bytes_that_follow() -> None:
    desk, heard = Desk(), list[tuple[bytes, int | None]]()
    tuning = Tuning(desk.link, 38_400, Random(0), str, nine=True)
    program = desk.opens(lambda data: heard.append((tuning.from_client(data), tuning.ninth())))
    program.write(b"none" + sets(3, 4) + b"head" + sets(3, 5) + b"tail")
    assert heard == [(b"none", None), (b"head", 1), (b"tail", 0)]


def test_what_telnet_adds_is_counted_as_nothing() -> None:
    desk, heard = Desk(), bytearray()
    program = desk.opens(heard.extend)
    program.write(sets(2, 8) + b"\xff\xff")
    desk.link.send(b"\xff")
    counters = desk.link.counters
    assert (counters.bytes_in, counters.bytes_out, counters.dropped_out) == (1, 1, 0)
    assert heard == b"\xff"
    assert program.read().endswith(b"\xff\xff")


def test_a_link_has_the_bus_s_settings_before_it_is_open() -> None:
    link = Rfc2217Link(MemoryLink("desk"), 9600)
    assert (link.client_baud(), link.client_format()) == (9600, SerialFormat())
