"""What is asked of a real port's driver. The driver is a stand-in above a pty (driver.py)."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator

import pytest
import serial

from sacbus import Mother
from sacbus.links import LinkError, adapter
from sacbus.links.adapter import AdapterLink
from sacbus.links.hardware import FramingErrors, hasten, kernel_direction, set_dtr, set_rts
from sacbus.mother import BadRequest
from tests.links.driver import LOW_LATENCY, Driver, driven
from tests.links.programs import PtyProgram
from tests.links.rig import Ear, until
from tests.links.socat import Wire

ENABLED, RTS_ON_SEND, RTS_AFTER_SEND, HEARS_MEANWHILE = 1, 2, 4, 16


@pytest.fixture
def port() -> Iterator[serial.Serial]:
    """A pty's slave, as pyserial opens it."""
    master, slave = os.openpty()
    with serial.Serial(os.ttyname(slave), timeout=0) as port:
        yield port
    os.close(master)
    os.close(slave)


# --------------------------------------------------------------------------- a pty has none of it


def test_a_pty_has_nothing_to_hasten(port: serial.Serial) -> None:
    assert not hasten(port)


def test_a_pty_has_no_direction(port: serial.Serial) -> None:
    assert not kernel_direction(port, echo=False)
    assert port.rs485_mode is None
    assert not set_rts(port, high=True)
    assert not set_dtr(port, asserted=True)


def test_a_pty_counts_no_framing_errors(port: serial.Serial) -> None:
    assert FramingErrors(port).fresh() == 0


# ------------------------------------------------------------------------------------ a driver has


def test_a_driver_is_asked_to_hand_on_bytes_at_once(port: serial.Serial) -> None:
    with driven(Driver()) as driver:
        assert hasten(port)
        assert driver.flags == LOW_LATENCY


@pytest.mark.asyncio
async def test_mother_pulls_dtr_of_the_port_that_she_is_on(wire: Wire) -> None:
    with driven(Driver()) as driver:
        async with Mother.connect(wire.near) as mother:
            driver.dtr.clear()
            mother.set_dtr(asserted=False)
            mother.pull_dtr()
            assert driver.dtr == [0, 1, 0]
        with pytest.raises(BadRequest, match="this line has no DTR to set"):
            mother.pull_dtr()  # of a port that is closed


@pytest.mark.parametrize("echo", [False, True])
def test_a_driver_with_rs485_raises_rts_to_send_and_hears_meanwhile_for_an_echo(
    port: serial.Serial, echo: bool
) -> None:
    with driven(Driver(rs485=True)) as driver:
        assert kernel_direction(port, echo=echo)
        assert driver.rs485_flags == ENABLED | RTS_ON_SEND | (HEARS_MEANWHILE if echo else 0)


def test_a_driver_that_takes_the_request_and_does_nothing_is_found_out(port: serial.Serial) -> None:
    with driven(Driver(rs485=True, obeys=False)):
        assert not kernel_direction(port, echo=False)
        assert port.rs485_mode is None


def test_framing_errors_are_those_since_the_last_look_also_when_the_count_runs_over(
    port: serial.Serial,
) -> None:
    with driven(Driver()) as driver:
        driver.framing_errors = 0xFFFF_FFFE
        counter = FramingErrors(port)
        assert counter.fresh() == 0
        driver.framing_errors = 3
        assert counter.fresh() == 5
        port.close()
        assert counter.fresh() == 0


# --------------------------------------------------------------------- an adapter makes use of it


@pytest.mark.asyncio
async def test_an_adapter_is_quick_and_counts_framing_errors_over_losses(wire: Wire) -> None:
    with driven(Driver()) as driver:
        driver.framing_errors = 100
        link = AdapterLink(wire.near, 38_400, tell=lambda _text: None)
        link.open(lambda _data: None)
        assert driver.flags == LOW_LATENCY
        assert link.counters.framing_errors == 0
        driver.framing_errors = 107
        assert link.counters.framing_errors == 7
        wire.unplug()
        driver.framing_errors = 50  # that of another device, perhaps
        wire.plug()
        await until(lambda: link.counters.reconnects)
        counted = link.counters.framing_errors
        driver.framing_errors = 52
        assert link.counters.framing_errors == counted + 2
        link.close()


@pytest.mark.asyncio
@pytest.mark.parametrize("rs485", [{"rs485": False}, {"rs485": True, "obeys": False}])
async def test_without_rs485_in_the_driver_rts_is_raised_to_send_and_falls_afterwards(
    wire: Wire, rs485: dict[str, bool]
) -> None:
    program = PtyProgram(wire.far)
    ear = Ear(program)
    with driven(Driver(**rs485)) as driver:
        link = AdapterLink(wire.near, 38_400, rts=True, tell=lambda _text: None)
        link.open(lambda _data: None)
        assert 1 not in driver.rts  # not even by opening
        for turn in range(1, 3):
            driver.rts.clear()
            link.send(b"packet")
            assert driver.rts == [1]
            await until(lambda: ear.has(b"packet" * turn))
            await until(lambda: driver.rts == [1, 0])
        link.close()
        assert driver.rts == [1, 0]
    program.close()


@pytest.mark.asyncio
async def test_rts_stays_up_while_the_driver_has_something_to_send(wire: Wire) -> None:
    with driven(Driver()) as driver:
        link = AdapterLink(wire.near, 38_400, rts=True, tell=lambda _text: None)
        link.open(lambda _data: None)
        driver.rts.clear()
        driver.unsent = 3
        link.send(b"packet")
        end = asyncio.get_running_loop().time() + 0.01  # 6 bytes take 1.6 ms
        await until(lambda: asyncio.get_running_loop().time() > end)
        assert driver.rts == [1]
        driver.unsent = 0
        await until(lambda: driver.rts == [1, 0])
        link.close()


@pytest.mark.asyncio
async def test_rts_falls_when_the_adapter_is_closed_or_lost_in_the_middle(wire: Wire) -> None:
    told: list[str] = []
    with driven(Driver()) as driver:
        link = AdapterLink(wire.near, 300, rts=True, tell=told.append)
        link.open(lambda _data: None)
        driver.rts.clear()
        link.send(b"a packet that takes a second")
        link.close()
        assert driver.rts == [1, 0]
        link.open(lambda _data: None)
        driver.rts.clear()
        link.send(b"a packet that takes a second")
        wire.unplug()
        await until(lambda: told)
        assert driver.rts == [1]  # gone with its port
        wire.plug()
        await until(lambda: link.counters.reconnects)
        assert driver.rts[1:].count(1) == 0
        link.close()


@pytest.mark.asyncio
async def test_with_rs485_in_the_driver_rts_is_left_to_it(wire: Wire) -> None:
    with driven(Driver(rs485=True)) as driver:
        link = AdapterLink(wire.near, 38_400, rts=True, tell=lambda _text: None)
        link.open(lambda _data: None)
        driver.rts.clear()
        link.send(b"packet")
        assert link._direction is None
        assert driver.rts == []
        link.close()


@pytest.mark.asyncio
async def test_an_adapter_that_comes_back_without_its_rts_is_not_taken_for_it(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adapter, "FIRST_RETRY", 0.02)
    told: list[str] = []
    with driven(Driver()) as driver:
        link = AdapterLink(wire.near, 38_400, rts=True, tell=told.append)
        link.open(lambda _data: None)
        wire.unplug()
        await until(lambda: told)
        driver.modem_lines = False
        delay = link._delay
        wire.plug()
        await until(lambda: link._delay > delay)
        assert link.counters.reconnects == 0
        driver.modem_lines = True
        await until(lambda: link.counters.reconnects == 1)
        assert len(told) == 2
        link.close()
        driver.modem_lines = False
        with pytest.raises(LinkError, match="has no RTS"):
            link.open(lambda _data: None)
