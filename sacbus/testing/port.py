"""A serial port on a bus in virtual time, of pyserial's shape: for controllers that are given one.

Owns the passing of time while a program waits for bytes. The line sees it as any program at a pty:
its bytes take line time, and begin no earlier than a USB adapter's would.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING

import serial

from sacbus.hosted import HostedBus
from sacbus.kernel import SECOND, Ns
from sacbus.links import MemoryLink

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

__all__ = ["VirtualPort"]


class VirtualPort(serial.SerialBase):
    """``read``, ``readline``, ``read_until``, ``write``, ``in_waiting`` and the rest, as ever.

    A read that waits lets bus time pass, up to its ``timeout``, which None makes endless; a write
    comes back at once, and ``flush`` when all is on the line and over. Its lines (RTS, DTR) lead
    nowhere.
    """

    def __init__(
        self,
        hosted: HostedBus,
        step: Callable[[Ns | None], None],
        *,
        baud: int | None,
        timeout: float | None,
    ) -> None:
        rate = hosted.bus.rate.baud
        super().__init__(None, baudrate=baud or rate, timeout=timeout)
        self._kernel = hosted.host.kernel
        self._medium = hosted.bus.medium
        self._step = step
        self._link = MemoryLink("serial port of the test", baud=rate)
        self._seat = hosted.attach(self._link)
        self._client = self._link.client(baud=baud or rate)
        self._heard = bytearray()
        self.is_open = True

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read without waiting."""
        self._heard += self._client.read()
        return len(self._heard)

    def read(self, size: int = 1) -> bytes:
        """``size`` bytes, or what came until the time was over."""
        self._refuse_closed()
        timeout = inf if self.timeout is None else self.timeout
        limit = None if timeout == inf else self._kernel.now + round(timeout * SECOND)
        while self.in_waiting < size:
            if limit is not None and self._kernel.now >= limit:
                break
            if limit is None and self._kernel.next_at() is None:
                raise serial.SerialException("the read would wait for ever: nothing is due")
            self._step(limit)
        data = bytes(self._heard[:size])
        del self._heard[:size]
        return data

    def write(self, data: ReadableBuffer, /) -> int:
        """All of it, at once."""
        self._refuse_closed()
        taken = bytes(data)
        while self._client.write(taken) < len(taken):  # the line is that far behind
            self._step(None)
        return len(taken)

    def flush(self) -> None:
        """Wait until all that was written is over."""
        while self._seat.unsent:
            self._step(None)
        while (free := self._medium.free_at(self._medium.master_lane) or 0) > self._kernel.now:
            self._step(free)

    def reset_input_buffer(self) -> None:
        """Forget what has come."""
        self._client.read()
        self._heard.clear()

    def reset_output_buffer(self) -> None:
        """What has been written is on its way: nothing to forget."""

    def close(self) -> None:
        """Leave the line; idempotent."""
        if self.is_open:
            self.is_open = False
            self._client.close()
            self._seat.leave()

    def _refuse_closed(self) -> None:
        if not self.is_open:
            raise serial.PortNotOpenError

    # Called by pyserial when its attributes are assigned.

    def _reconfigure_port(self) -> None:
        self._client.baud = self.baudrate

    def _update_rts_state(self) -> None: ...

    def _update_dtr_state(self) -> None: ...

    def _update_break_state(self) -> None: ...
