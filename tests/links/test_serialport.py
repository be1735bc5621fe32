"""A serial port on the event loop, and the defects of its libraries that must not show."""

from __future__ import annotations

import asyncio
import os
import threading
import tty
from collections.abc import AsyncIterator

import pytest
import pytest_asyncio
import serial

from sacbus.links import LinkError
from sacbus.links.serialport import BOUND, SerialConnection
from tests.conftest import open_descriptors
from tests.links.driver import Driver, driven
from tests.links.rig import until

pytestmark = pytest.mark.asyncio


class Pty:
    """A pty, whose master is what hangs on the line; a connection to it, and what that has told."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self._slave)
        self.heard = bytearray()
        self.lost: list[str] = []

    def connect(self) -> SerialConnection:
        return SerialConnection(self.path, 38_400, self.heard.extend, self.lost.append)

    def read(self) -> bytes:
        try:
            return os.read(self.master, 65_536)
        except BlockingIOError:
            return b""

    def hang_up(self) -> None:
        if self.master >= 0:
            os.close(self._slave)
            os.close(self.master)
            self.master = -1


@pytest_asyncio.fixture
async def pty() -> AsyncIterator[Pty]:
    pty = Pty()
    yield pty
    pty.hang_up()


async def turn_the_loop() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


async def test_a_port_that_is_lost_is_told_of_at_the_loops_next_turns(pty: Pty) -> None:
    pty.connect()
    await turn_the_loop()
    pty.hang_up()
    await turn_the_loop()
    assert pty.lost == ["unplugged, or closed by its other end"]


async def test_a_port_that_is_lost_with_something_to_write_gives_no_traceback(
    pty: Pty, caplog: pytest.LogCaptureFixture
) -> None:
    connection = pty.connect()
    assert connection.send(bytes(200_000)) < 200_000
    assert connection._unwritten == BOUND
    pty.hang_up()
    await until(lambda: pty.lost)
    await turn_the_loop()
    assert connection.lost_unwritten == BOUND
    assert (len(pty.lost), caplog.records) == (1, [])


async def test_a_port_that_is_lost_before_the_loop_has_turned_is_told_of_all_the_same(
    pty: Pty, caplog: pytest.LogCaptureFixture
) -> None:
    connection = pty.connect()
    pty.hang_up()
    assert connection.send(b"nobody") == 6  # kept, for as long as nothing has been told
    assert connection.send(b"nobody") == 0
    await until(lambda: pty.lost)
    await turn_the_loop()
    assert connection.lost_unwritten == 6
    assert connection.send(b"nobody") == 0
    assert (len(pty.lost), caplog.records) == (1, [])


async def test_a_port_that_was_lost_while_it_was_held_is_told_of_afterwards(pty: Pty) -> None:
    connection = pty.connect()
    connection.hold(held=True)
    await turn_the_loop()
    pty.hang_up()
    await turn_the_loop()
    assert pty.lost == []
    connection.hold(held=False)
    await turn_the_loop()
    assert len(pty.lost) == 1


async def test_a_read_that_finds_nothing_is_no_loss(pty: Pty) -> None:
    connection = pty.connect()
    await turn_the_loop()
    # As when another program took what there was, between the loop's look and the read.
    connection._transport._read_ready()
    await turn_the_loop()
    assert pty.lost == []
    os.write(pty.master, b"still here")
    await until(lambda: pty.heard == b"still here")
    connection.close()


@pytest.mark.parametrize("lost", [True, False])
async def test_ending_twice_is_ending_once(
    pty: Pty, lost: bool, caplog: pytest.LogCaptureFixture
) -> None:
    connection = pty.connect()
    connection.send(bytes(200_000))
    if lost:
        pty.hang_up()
        await until(lambda: pty.lost)
    assert connection.close() == (0 if lost else BOUND)
    assert connection.close() == 0
    connection.hold(held=True)
    connection.hold(held=False)
    await connection.finish()
    await turn_the_loop()
    assert (len(pty.lost), caplog.records, connection.unsent) == (int(lost), [], 0)


async def test_what_comes_when_it_is_being_closed_is_not_heard(pty: Pty) -> None:
    connection = pty.connect()
    await turn_the_loop()
    os.write(pty.master, b"too late")
    connection.close()
    connection.data_received(b"from a transport that had read it")
    await turn_the_loop()
    assert pty.heard == b""


async def test_what_was_written_before_it_was_closed_is_read_by_the_other_end(pty: Pty) -> None:
    connection = pty.connect()
    taken = connection.send(bytes(BOUND))
    waiting = connection._unwritten
    connection.close()
    read = 0
    while data := pty.read():
        read += len(data)
    assert read == taken - waiting
    assert read > 4096  # more than the other end has been given by the system


async def test_finishing_waits_for_what_is_being_sent(pty: Pty) -> None:
    with driven(Driver()) as driver:
        connection = pty.connect()
        driver.unsent = 3
        finishing = asyncio.ensure_future(connection.finish())
        await turn_the_loop()
        assert not finishing.done()
        driver.unsent = 0
        await finishing
    assert not connection.port.is_open


@pytest.mark.slow
async def test_finishing_does_not_wait_for_ever(pty: Pty) -> None:
    with driven(Driver()) as driver:
        connection = pty.connect()
        driver.unsent = 100
        await connection.finish()
    assert not connection.port.is_open


async def test_closing_throws_away_what_the_system_would_wait_for(pty: Pty) -> None:
    with driven(Driver()) as driver:
        connection = pty.connect()
        connection.send(bytes(10_000))
        driver.unsent = 10_000
        connection.close()
    assert len(pty.read()) < 10_000


async def test_a_failed_opening_leaves_nothing_open(pty: Pty) -> None:
    connection = pty.connect()
    before = open_descriptors()
    with pytest.raises(LinkError, match="another program has it"):
        pty.connect()
    assert open_descriptors() == before
    connection.close()


async def test_marked_bytes_of_one_call_are_out_before_those_of_the_next(
    pty: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pty takes no parity, so what the system is asked for is looked at in pyserial."""
    connection = pty.connect()
    asked: list[str] = []
    threads: set[int] = set()
    gate = threading.Event()

    def flush(_port: serial.Serial) -> None:
        assert gate.wait(10)
        asked.append("out")
        threads.add(threading.get_ident())

    parity = property(None, lambda _port, parity: asked.append(parity))
    monkeypatch.setattr(serial.Serial, "parity", parity)
    monkeypatch.setattr(serial.Serial, "flush", flush)
    connection.send_marked(b"abc", bytes((1, 0, 0)))
    connection.send_marked(b"d", bytes((1,)))
    assert connection.unsent >= len(b"bcd")
    gate.set()
    await connection.finish()
    assert asked == ["M", "out", "S", "out", "M", "out"]
    assert len(threads) == 1
    assert pty.read() == b"abcd"
    assert pty.lost == []


async def test_a_port_that_is_lost_under_marked_bytes_is_told_of_by_their_thread(pty: Pty) -> None:
    asyncio.get_running_loop().set_debug(True)  # it refuses what is not safe from a thread
    connection = pty.connect()
    await turn_the_loop()
    # Not to be told of by the reader.
    connection.hold(held=True)
    await turn_the_loop()
    pty.hang_up()
    assert await asyncio.to_thread(connection.port.write, b"a") == 0
    await turn_the_loop()
    assert len(pty.lost) == 1
