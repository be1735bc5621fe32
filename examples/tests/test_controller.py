"""A controller that talks through a serial port, as most do, tested in virtual time."""

from __future__ import annotations

import time

import pytest
import serial

from sacbus.testing import VirtualBus
from sacbus.wire import MOTHER, encode

ACK, NAK = 0x06, 0x15


class Table:
    """The controller under test. Yours is imported, and takes its port as an argument like this."""

    def __init__(self, port: serial.SerialBase, axis: int) -> None:
        self._port = port
        self._axis = axis

    def move(self, steps: int) -> None:
        """Send the table somewhere; TimeoutError when nobody answers."""
        self._port.write(encode(self._axis, MOTHER, f"m{steps}v120".encode()))
        answer = self._port.read(4)
        if not answer:
            raise TimeoutError(f"axis {self._axis} does not answer")
        if answer[-1] != ACK:
            raise ValueError(f"axis {self._axis} has refused a packet")

    def shake(self, times: int) -> None:
        """There and back, with a rest in between."""
        for _ in range(times):
            for steps in 50, -50:
                self.move(steps)
                time.sleep(2)


def test_it_moves_the_axis(bus: VirtualBus) -> None:
    Table(bus.serial(), axis=10).move(400)
    bus.expect(node=10, position=400, state="STANDBY", within="5 s")


def test_it_notices_that_nobody_answers(bus: VirtualBus) -> None:
    table = Table(bus.serial(timeout=0.5), axis=99)
    with pytest.raises(TimeoutError, match="axis 99 does not answer"):
        table.move(400)
    assert bus.time() == pytest.approx(0.5, abs=0.1)  # and no second of ours


def test_it_is_told_of_a_damaged_packet(bus: VirtualBus) -> None:
    table = Table(bus.serial(timeout=0.5), axis=10)
    with bus.fault(bit_errors=0.1), pytest.raises((ValueError, TimeoutError)):
        table.move(400)
    bus.run_for("1 s")
    assert bus.node(10).position == 0


def test_its_rests_take_bus_time(bus: VirtualBus, monkeypatch: pytest.MonkeyPatch) -> None:
    # What sleeps by the wall clock would wait for a bus that stands still.
    monkeypatch.setattr(time, "sleep", bus.sleep)
    Table(bus.serial(), axis=10).shake(100)
    assert bus.time() == pytest.approx(400, abs=5)
    assert bus.node(10).position == 0
