"""What a real adapter does beyond what every link must do: it is pulled out, and comes back.

The adapter is one of two ptys that socat joins. What a pty cannot play is in docs/supported.md.
"""

from __future__ import annotations

import array
import asyncio
import errno
import fcntl
import os
import resource
import sys
import termios
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
import pytest_asyncio
import serial

from sacbus.links import LinkError, adapter, arrival
from sacbus.links.adapter import FIRST_RETRY, LAST_RETRY, AdapterLink
from sacbus.links.serialport import BOUND
from tests.conftest import open_descriptors
from tests.links.bench import Bench, on_the_line
from tests.links.rig import Ear, until
from tests.links.socat import Wire, needs_socat

pytestmark = [pytest.mark.asyncio, needs_socat]

needs_inotify = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="inotify is Linux's alone"
)


@pytest_asyncio.fixture
async def bench(wire: Wire) -> AsyncIterator[Bench]:
    bench = Bench(wire)
    bench.open()
    yield bench
    bench.link.close()


def refused(link: AdapterLink) -> str:
    """What opening it says, in one line; nothing stays open."""
    before = open_descriptors()
    with pytest.raises(LinkError) as refusal:
        link.open(lambda _data: None)
    assert open_descriptors() == before
    assert "\n" not in str(refusal.value)
    return str(refusal.value)


def ignore(_text: str) -> None:
    """What is told is not what the test is about."""


# ------------------------------------------------------------------------------------- opening


async def test_an_adapter_says_what_it_is_before_it_is_open() -> None:
    link = AdapterLink("/dev/ttyUSB7", 38_400, tell=ignore)
    assert (link.kind, link.where) == ("adapter", "/dev/ttyUSB7")
    assert link.counters.reconnects == 0


@pytest.mark.parametrize(
    ("path", "why"),
    [
        ("/nonexistent/tty", "no such file.*, /nonexistent/tty, check the path.*plugged in"),
        ("/", "it is a directory"),
        ("/dev/null", "it is not a serial port"),
    ],
)
async def test_an_adapter_that_cannot_be_opened_is_refused_in_one_line(path: str, why: str) -> None:
    told: list[str] = []
    with pytest.raises(LinkError, match=why):
        AdapterLink(path, 38_400, tell=told.append).open(lambda _data: None)
    await asyncio.sleep(0)
    assert told == []  # and it is not looked for either


async def test_a_rate_that_the_system_cannot_set_is_refused_in_one_line(wire: Wire) -> None:
    assert "cannot open the line" in refused(AdapterLink(wire.near, 2**33, tell=ignore))


async def test_rts_on_a_port_that_has_none_is_refused_in_one_line(wire: Wire) -> None:
    link = AdapterLink(wire.near, 38_400, rts=True, tell=ignore)
    expected = f"the port has no RTS, {wire.near}, leave rts out, or use an adapter that has it"
    assert refused(link) == expected


async def test_a_second_opener_is_refused_in_one_line(bench: Bench) -> None:
    again = AdapterLink(bench.wire.near, 38_400, tell=ignore)
    assert "another program has it" in refused(again)
    with pytest.raises(serial.SerialException) as refusal:
        serial.Serial(bench.wire.near, exclusive=True)
    assert refusal.value.errno == errno.EWOULDBLOCK


async def test_a_port_that_another_program_has_is_not_shared(wire: Wire) -> None:
    with serial.Serial(wire.near, exclusive=True):
        assert "another program has it" in refused(AdapterLink(wire.near, 38_400, tell=ignore))


async def test_a_closed_adapter_leaves_no_descriptor_before_the_loop_turns(wire: Wire) -> None:
    before = open_descriptors()
    link = AdapterLink(wire.near, 38_400, tell=ignore)
    link.open(lambda _data: None)
    link.close()
    assert open_descriptors() == before


async def test_descriptors_beyond_those_of_select_serve_as_well(wire: Wire) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 2048:
        pytest.skip(f"the system allows {hard} descriptors")
    bench = Bench(wire)
    with ExitStack() as stack:
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2048), hard))
        stack.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        for _ in range(1100):
            stack.callback(os.close, os.open("/dev/null", os.O_RDONLY))
        program = stack.enter_context(on_the_line(wire))
        bench.open()
        stack.callback(bench.link.close)
        program.write(b"hello")
        await until(lambda: bench.heard == b"hello")


# ----------------------------------------------------------------------------------- unplugging


@pytest.mark.slow
async def test_an_adapter_that_is_pulled_out_ten_times_is_told_of_and_found_again(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    said = b""
    for turn in range(10):
        with on_the_line(bench.wire) as program:
            ear = Ear(program)
            words = b"turn %d " % turn
            program.write(words)
            bench.link.send(words)
            said += words
            await until(lambda: bench.heard == said and ear.has(words))
        await bench.unplug()
        await bench.plug()
    told = [text.replace(bench.wire.near, "PATH") for text in bench.told]
    assert len(told) == 20
    assert set(told[::2]) == {
        "adapter PATH is gone (unplugged, or closed by its other end); trying to reach it again"
    }
    assert all(text.startswith("adapter PATH is back after ") for text in told[1::2])
    counters = bench.link.counters
    assert (counters.reconnects, counters.dropped_out) == (10, 0)
    assert (counters.bytes_in, counters.bytes_out) == (len(said), len(said))
    assert caplog.records == []


async def test_what_is_sent_while_it_is_away_is_dropped_counted_and_never_heard(
    bench: Bench,
) -> None:
    await bench.unplug()
    bench.link.send(b"to nobody")
    assert bench.link.counters.dropped_out == 9
    await bench.plug()
    with on_the_line(bench.wire) as program:
        ear = Ear(program)
        bench.link.send(b"to you")
        await until(lambda: ear.has(b"to you"))


async def test_what_was_said_before_it_was_open_again_is_stale_and_not_heard(bench: Bench) -> None:
    await bench.unplug()
    # In again under another name, so that it is not found before something has been said.
    other = Wire()
    other.plug()
    with on_the_line(other) as program:
        program.write(b"stale")
        with on_the_line_of(other.near) as port:
            await until(lambda: waiting(port) == 5)
        Path(bench.wire.near).symlink_to(Path(other.near).readlink())
        await until(lambda: bench.link.counters.reconnects)
        program.write(b"fresh")
        await until(lambda: bench.heard.endswith(b"fresh"))
    assert bench.heard == b"fresh"
    Path(bench.wire.near).unlink()
    bench.link.close()
    other.close()


@contextmanager
def on_the_line_of(path: str) -> Iterator[int]:
    port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        yield port
    finally:
        os.close(port)


def waiting(port: int) -> int:
    """Bytes that could be read now."""
    count = array.array("i", [0])
    fcntl.ioctl(port, termios.FIONREAD, count)
    return count[0]


async def test_what_had_not_been_written_when_it_was_pulled_out_is_counted(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    while bench.link.counters.dropped_out == 0:
        bench.link.send(bytes(4096))
    dropped = bench.link.counters.dropped_out
    await bench.unplug()
    assert bench.link.counters.dropped_out == dropped + BOUND
    assert len(bench.told) == 1
    assert caplog.records == []


async def test_an_adapter_that_nobody_listens_to_keeps_no_more_than_its_bound(bench: Bench) -> None:
    for _ in range(1000):
        bench.link.send(bytes(1000))
    counters = bench.link.counters
    assert counters.bytes_out + counters.dropped_out == 1_000_000
    assert bench.link._connection is not None
    assert bench.link._connection._unwritten <= BOUND
    assert counters.bytes_out <= 2 * BOUND  # and what the system's own buffers hold


@needs_inotify
async def test_an_adapter_that_comes_back_is_found_without_waiting(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adapter, "FIRST_RETRY", 1000.0)
    bench = Bench(wire)
    bench.open()
    await bench.unplug()
    await bench.plug()
    bench.link.close()


async def test_an_adapter_that_nothing_tells_of_is_found_all_the_same(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(arrival, "inotify_library", lambda: None)
    bench = Bench(wire)
    bench.open()
    await bench.unplug()
    await bench.plug()
    bench.link.close()


async def test_an_adapter_that_another_program_took_meanwhile_is_waited_for(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adapter, "FIRST_RETRY", 0.01)
    bench.link._delay = 0.0
    await bench.unplug()
    other = Wire()
    other.plug()
    with serial.Serial(other.near, exclusive=True):
        Path(bench.wire.near).symlink_to(Path(other.near).readlink())
        delay = bench.link._delay
        await until(lambda: bench.link._delay > delay)
        assert bench.link.counters.reconnects == 0
    await until(lambda: bench.link.counters.reconnects)
    assert len(bench.told) == 2
    Path(bench.wire.near).unlink()
    bench.link.close()
    other.close()


@pytest.mark.parametrize("plugged", [True, False])
async def test_an_adapter_that_is_closed_while_it_is_away_is_looked_for_no_more(
    bench: Bench, plugged: bool
) -> None:
    before = open_descriptors()
    await bench.unplug()
    bench.link.close()
    assert len(open_descriptors()) < len(before)
    if plugged:
        bench.wire.plug()
    for _ in range(50):
        await asyncio.sleep(0)
    assert (len(bench.told), bench.link.counters.reconnects) == (1, 0)
    if plugged:
        bench.open()  # and may be opened again
        with on_the_line(bench.wire) as program:
            program.write(b"again")
            await until(lambda: bench.heard == b"again")


async def test_a_listener_may_close_the_adapter_when_it_is_told_of_a_loss(wire: Wire) -> None:
    told: list[str] = []

    def tell(text: str) -> None:
        told.append(text)
        link.close()

    link = AdapterLink(wire.near, 38_400, tell=tell)
    link.open(lambda _data: None)
    wire.unplug()
    await until(lambda: told)
    wire.plug()
    for _ in range(50):
        await asyncio.sleep(0)
    assert len(told) == 1


async def test_a_held_adapter_is_held_still_when_it_comes_back(bench: Bench) -> None:
    await bench.unplug()
    bench.link.hold(held=True)
    await bench.plug()
    assert bench.link._connection is not None
    port = bench.link._connection.port.fileno()
    with on_the_line(bench.wire) as program:
        program.write(b"waits")
        await until(lambda: waiting(port) == 5)
        assert bench.heard == b""
        bench.link.hold(held=False)
        await until(lambda: bench.heard == b"waits")


class Watched(AdapterLink):
    """An adapter that remembers for how long it was let alone after each time it was tried."""

    def __init__(self, path: str) -> None:
        self.told: list[str] = []
        self.pauses: list[float] = []
        super().__init__(path, 38_400, tell=self.told.append)

    def _connect(self) -> None:
        self.pauses.append(self._delay)
        super()._connect()


async def test_an_adapter_that_stays_away_is_tried_ever_more_rarely_for_ever(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert (FIRST_RETRY, LAST_RETRY) == (0.1, 2.0)
    monkeypatch.setattr(adapter, "FIRST_RETRY", 0.001)
    monkeypatch.setattr(adapter, "LAST_RETRY", 0.02)
    link = Watched(wire.near)
    link.open(lambda _data: None)
    link.pauses.clear()
    wire.unplug()
    await until(lambda: len(link.pauses) == 8)
    link.close()
    assert link.pauses == [0.002, 0.004, 0.008, 0.016] + [0.02] * 4
    assert len(link.told) == 1


async def test_a_port_that_is_lost_again_at_once_is_not_tried_more_often_for_it(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adapter, "FIRST_RETRY", 1000.0)
    bench = Bench(wire)
    bench.open()
    bench.link._delay = 500.0  # as if it had been lost, and found, a while ago
    await bench.unplug()
    assert bench.link._delay == 500.0
    bench.link.close()
