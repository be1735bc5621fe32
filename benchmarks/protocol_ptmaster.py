"""``ptmaster://``: a serial port for pyserial that is the master's end of a new pty.

So a server that opens its port by name, as pymodbus' does, is on the same kind of pty as a bus of
ours: it holds the master, and its client opens the slave. The slave's path is printed.
"""

from __future__ import annotations

import os
import tty

import serial

__all__ = ["Serial"]


class Serial(serial.Serial):
    def open(self) -> None:
        self.fd, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.pipe_abort_read_r, self.pipe_abort_read_w = os.pipe()
        self.pipe_abort_write_r, self.pipe_abort_write_w = os.pipe()
        self.is_open = True
        print(os.ttyname(self._slave), flush=True)

    def _reconfigure_port(self, force_update: bool = False) -> None:
        """A pty has no rate to set."""
