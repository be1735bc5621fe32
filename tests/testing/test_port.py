"""A serial port in virtual time: pyserial's shape, the line's times."""

from __future__ import annotations

import pytest
import serial

from sacbus.kernel import SECOND
from sacbus.testing import VirtualBus

M400 = bytes.fromhex("02 0a 01 6d 34 30 30 03 de 00")
ACK = bytes.fromhex("02 01 0a 06")


def test_a_packet_is_answered_and_takes_its_time(bus: VirtualBus) -> None:
    with bus.serial() as port:
        assert port.write(M400) == len(M400)
        assert bus.now == 0
        assert port.read(4) == ACK
        # 1 ms of an adapter, 10 bytes, turnaround, 4 bytes.
        assert 0.004 < bus.time() < 0.008
    bus.expect(node=10, position=400, within="5 s")


def test_a_read_ends_with_what_came_when_its_time_is_over(bus: VirtualBus) -> None:
    port = bus.serial(timeout=0.25)
    port.write(M400)
    assert port.read(100) == ACK
    assert bus.now == SECOND // 4
    assert port.read(1) == b""
    port.timeout = 0
    assert port.read(1) == b""
    assert bus.now == SECOND // 2


def test_what_has_come_waits_and_can_be_forgotten(bus: VirtualBus) -> None:
    port = bus.serial()
    port.write(M400)
    assert port.in_waiting == 0
    bus.run_for("100 ms")
    assert port.in_waiting == 4
    assert port.read_until(b"\x0a") == ACK[:3]
    port.reset_input_buffer()
    assert port.in_waiting == 0


def test_flush_waits_until_all_is_on_the_line_and_over(bus: VirtualBus) -> None:
    port = bus.serial()
    port.write(b"\x55" * 384)  # 0.1 s of line time
    port.flush()
    assert 0.1 <= bus.time() < 0.103


def test_flush_waits_for_a_line_that_is_taken(bus: VirtualBus) -> None:
    port = bus.serial()
    bus.raw(b"\x55" * 384)
    bus.run_for("10 ms")
    port.write(b"\x55" * 384)
    port.flush()
    assert 0.2 <= bus.time() < 0.206


def test_a_wrong_baud_rate_is_garbage(bus: VirtualBus) -> None:
    port = bus.serial(baud=9_600, timeout=0.5)
    port.write(M400)
    assert port.read(4) != ACK
    assert bus.node(10).position == 0
    port.baudrate = 38_400
    port.reset_input_buffer()
    port.write(M400)
    assert port.read(4) == ACK


def test_a_read_that_nothing_would_end_is_refused(bus: VirtualBus) -> None:
    port = bus.serial(timeout=None)
    with pytest.raises(serial.SerialException, match="wait for ever"):
        port.read(1)
    port.write(M400)
    assert port.read(4) == ACK


def test_a_closed_port_is_closed(bus: VirtualBus) -> None:
    port = bus.serial()
    port.close()
    port.close()
    assert not port.is_open
    with pytest.raises(serial.SerialException):
        port.write(M400)
    with pytest.raises(serial.SerialException):
        port.read(1)


def test_lines_can_be_set_and_lead_nowhere(bus: VirtualBus) -> None:
    port = bus.serial()
    port.rts = False
    port.dtr = True
    port.break_condition = False
    port.reset_output_buffer()
    port.write(M400)
    assert port.read(4) == ACK
