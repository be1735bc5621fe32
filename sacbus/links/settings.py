"""The settings of a serial line: raw mode and the baud rate, read and written on a descriptor.

On Linux through the termios2 calls, which take and tell any rate as a number and cost 1 µs;
elsewhere through the termios module, which knows the usual rates by name.
"""

from __future__ import annotations

import fcntl
import platform
import struct
import sys
import termios
from array import array
from typing import Final

__all__ = ["LineSettings"]

# asm-generic/ioctls.h and termbits.h; some architectures number them differently, or have none.
_TERMIOS2_HERE: Final = sys.platform.startswith("linux") and platform.machine() in {
    "aarch64",
    "armv6l",
    "armv7l",
    "i686",
    "loongarch64",
    "riscv64",
    "s390x",
    "x86_64",
}
_TCGETS2: Final = 0x802C542A
_TCSETS2: Final = 0x402C542B
_BOTHER: Final = 0o010000
_CBAUD: Final = 0o010017
_TERMIOS2: Final = struct.Struct("=IIIIB19sII")  # 4 sets of flags, discipline, characters, rates
_OSPEED: Final = 10  # the last of its 32-bit words

_RATE_OF: Final = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name.startswith("B") and name[1:].isdigit()
}
_CODE_OF: Final = {rate: code for code, rate in _RATE_OF.items()}


class LineSettings:
    """The settings of the line behind one descriptor, which somebody else owns and closes."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._words = array("I", bytes(_TERMIOS2.size))  # reused: `baud` is asked for every chunk

    def make_raw(self, baud: int) -> None:
        """8N1 at `baud`, every byte as it is: no echo, no lines, no signals, no flow control.

        Raises ValueError for a rate that the system cannot set.
        """
        code = _CODE_OF.get(baud)
        if baud <= 0 or (code is None and not _TERMIOS2_HERE):
            message = f"cannot set {baud} baud, expected one of {sorted(_CODE_OF)[1:]}"
            raise ValueError(message)
        characters = termios.tcgetattr(self._descriptor)[6]
        characters[termios.VMIN], characters[termios.VTIME] = 1, 0
        flags = termios.CS8 | termios.CREAD | termios.CLOCAL
        speed = termios.B38400 if code is None else code
        raw = [0, 0, flags, 0, speed, speed, characters]
        termios.tcsetattr(self._descriptor, termios.TCSANOW, raw)
        if code is None:
            self._set_any_rate(baud)

    def baud(self) -> int:
        """The rate the line is sent at, in bits a second; 0 after a hang-up (B0)."""
        if not _TERMIOS2_HERE:
            return _RATE_OF[termios.tcgetattr(self._descriptor)[5]]
        fcntl.ioctl(self._descriptor, _TCGETS2, self._words)
        return self._words[_OSPEED]

    def _set_any_rate(self, baud: int) -> None:
        held = bytearray(_TERMIOS2.size)
        fcntl.ioctl(self._descriptor, _TCGETS2, held)
        iflag, oflag, cflag, lflag, discipline, characters, _, _ = _TERMIOS2.unpack(held)
        cflag = cflag & ~_CBAUD | _BOTHER
        wanted = _TERMIOS2.pack(iflag, oflag, cflag, lflag, discipline, characters, baud, baud)
        fcntl.ioctl(self._descriptor, _TCSETS2, wanted)
