"""What a real port can do beyond bytes: low latency, RS485 direction by the kernel, error counts.

Owns the calls for it and their layouts. All of it is a driver's to offer: each function says
whether it was to be had. Linux only; a pty has none of it.
"""

from __future__ import annotations

import contextlib
import struct
import sys
from array import array
from typing import Final

import serial
from serial.rs485 import RS485Settings

if sys.platform != "win32":
    import fcntl

__all__ = ["FramingErrors", "hasten", "kernel_direction", "set_dtr", "set_rts"]

# asm-generic/ioctls.h and linux/serial.h.
_TIOCGRS485: Final = 0x542E
_SER_RS485: Final = struct.Struct("=8I")  # flags first
_ENABLED: Final = 0x01
_TIOCGICOUNT: Final = 0x545D
_ICOUNTS: Final = 20  # ints of serial_icounter_struct: cts, dsr, rng, dcd, rx, tx, frame, ...
_FRAME: Final = 6


def hasten(port: serial.Serial) -> bool:
    """Have the driver hand on every byte at once, instead of after 16 ms or 62 bytes (FTDI)."""
    # pyserial makes a ValueError of the system's refusal; elsewhere it has no such call at all.
    with contextlib.suppress(ValueError, NotImplementedError, AttributeError):
        port.set_low_latency_mode(True)
        return True
    return False


def kernel_direction(port: serial.Serial, *, echo: bool) -> bool:
    """Have the kernel raise RTS for as long as it sends, which it does to the bit.

    With ``echo`` it hears meanwhile. Some drivers take the request and do nothing, so it is looked
    at what they made of it.
    """
    try:
        port.rs485_mode = RS485Settings(loopback=echo)
    except (ValueError, NotImplementedError):
        port.rs485_mode = None  # pyserial would ask again whenever anything is set
        return False
    if sys.platform == "win32":
        return True
    settings = bytearray(_SER_RS485.size)
    with contextlib.suppress(OSError):
        fcntl.ioctl(port.fileno(), _TIOCGRS485, settings)
    enabled = bool(_SER_RS485.unpack(settings)[0] & _ENABLED)
    if not enabled:
        port.rs485_mode = None
    return enabled


def set_rts(port: serial.Serial, *, high: bool) -> bool:
    """Set RTS; False where the port has none (ENOTTY), or is gone."""
    try:
        port.rts = high
    except OSError:
        return False
    return True


def set_dtr(port: serial.Serial, *, asserted: bool) -> bool:
    """Set DTR, which RS485 leaves to other uses; False where the port has none, or is gone."""
    try:
        port.dtr = asserted
    except OSError:
        return False
    return True


class FramingErrors:
    """Bytes without a stop bit that a port has met, as its driver counts them."""

    def __init__(self, port: serial.Serial) -> None:
        self._port = port
        self._counts = array("I", [0] * _ICOUNTS)
        self._here = sys.platform.startswith("linux")
        self._seen = 0
        self.fresh()

    def fresh(self) -> int:
        """How many since this was asked last; 0 where nobody counts, or the port is gone."""
        if not self._here or not self._port.is_open:
            return 0
        try:
            fcntl.ioctl(self._port.fileno(), _TIOCGICOUNT, self._counts)
        except OSError:
            self._here = False  # ENOTTY or EINVAL: it costs 1 us, but not at every byte for nothing
            return 0
        before, self._seen = self._seen, self._counts[_FRAME]
        return (self._seen - before) & 0xFFFF_FFFF
