"""A serial driver's calls that a pty has not, answered in its place: the kernel of a real port.

The layouts are those of linux/serial.h; all other calls reach the system.
"""

from __future__ import annotations

import errno
import fcntl
import struct
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

__all__ = ["Driver", "driven"]

TIOCGRS485: Final = 0x542E
TIOCSRS485: Final = 0x542F
TIOCGICOUNT: Final = 0x545D
TIOCGSERIAL: Final = 0x541E
TIOCSSERIAL: Final = 0x541F
TIOCMBIS: Final = 0x5416
TIOCMBIC: Final = 0x5417
TIOCOUTQ: Final = 0x5411
DTR: Final = 0x002
RTS: Final = 0x004
LOW_LATENCY: Final = 0x2000
FRAME: Final = 6
FLAGS: Final = 4


class Driver:
    """What the driver can do, is asked to do, and has counted."""

    def __init__(
        self, *, modem_lines: bool = True, rs485: bool = False, obeys: bool = True
    ) -> None:
        self.modem_lines = modem_lines
        self.rs485 = rs485
        self.obeys = obeys
        self.rs485_flags = 0
        self.rts: list[int] = []
        self.dtr: list[int] = []
        self.framing_errors = 0
        self.flags = 0
        self.unsent = 0

    def call(self, request: int, argument: Any) -> Any:  # noqa: ANN401 (as ioctl)
        """As ioctl; LookupError for a call that is not the driver's."""
        if request in (TIOCMBIS, TIOCMBIC) and self.modem_lines:
            if struct.unpack("I", argument)[0] & RTS:
                self.rts.append(int(request == TIOCMBIS))
            if struct.unpack("I", argument)[0] & DTR:
                self.dtr.append(int(request == TIOCMBIS))
            return argument
        if request in (TIOCGRS485, TIOCSRS485) and self.rs485:
            words = array("I", bytes(argument))
            if request == TIOCSRS485:
                self.rs485_flags = words[0] if self.obeys else 0
            words[0] = self.rs485_flags
            memoryview(argument).cast("B")[:] = memoryview(words).cast("B")
            return 0
        if request == TIOCGICOUNT:
            argument[FRAME] = self.framing_errors
            return 0
        if request == TIOCGSERIAL:
            argument[FLAGS] = self.flags
            return 0
        if request == TIOCSSERIAL:
            self.flags = argument[FLAGS]
            return 0
        if request == TIOCOUTQ:
            return struct.pack("I", self.unsent)
        if request in (TIOCMBIS, TIOCMBIC, TIOCGRS485, TIOCSRS485):
            raise OSError(errno.ENOTTY, "Inappropriate ioctl for device")
        raise LookupError


@contextmanager
def driven(driver: Driver) -> Iterator[Driver]:
    """Every port has this driver meanwhile."""
    system: Callable[..., Any] = fcntl.ioctl

    def ioctl(port: Any, request: int, argument: Any = 0, *more: Any) -> Any:  # noqa: ANN401
        try:
            return driver.call(request, argument)
        except LookupError:
            return system(port, request, argument, *more)

    fcntl.ioctl = ioctl
    try:
        yield driver
    finally:
        fcntl.ioctl = system
