"""RTS by hand: the direction of a two-wire adapter, where no kernel moves it.

Owns when RTS rises and falls; whose RTS it is, and what waits before it, is handed in.

What user space costs: RTS must fall after the last stop bit has left and before an answer's first
start bit comes, and a SAC answers after 0.385 ms. The event loop wakes up to a millisecond late,
more on a busy machine; a USB adapter takes RTS a millisecond or so after it was told; and what is
still in the adapter's own FIFO no system tells. So RTS falls some milliseconds late, never early,
and the beginning of a quick answer may be cut off. That is the best that can be had this way: an
adapter that finds its direction itself, or a port with RS485 in its driver, does it to the bit.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

__all__ = ["HandDirection"]

#: Seconds for which a port is believed that says that it still has bytes, beyond the time that
#: they take: one that always says so must not hold the line for ever.
PATIENCE: Final = 1.0


class HandDirection:
    """RTS of one port: up from :meth:`begin` until all that :meth:`sent` tells of has left.

    ``move`` takes its level, 1 or 0. ``waiting`` tells how many bytes are still on this side of the
    wire; it may be too few, so the time that bytes take on the line is waited for in any case.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        byte_s: float,
        move: Callable[[int], object],
        waiting: Callable[[], int],
    ) -> None:
        self._loop = loop
        self._byte_s = byte_s
        self._move = move
        self._waiting = waiting
        self._up = False
        self._leaves = 0.0  # when the last byte has left, if nothing delays any
        self._timer: asyncio.TimerHandle | None = None

    def begin(self) -> None:
        """Something is going to be sent: RTS rises, unless it is up."""
        if not self._up:
            self._up = True
            self._move(1)

    def sent(self, count: int) -> None:
        """So many bytes have been given to the port, behind what it had."""
        now = self._loop.time()
        self._leaves = max(now, self._leaves) + count * self._byte_s
        if self._timer is None:
            self._timer = self._loop.call_at(self._leaves, self._look)

    def end(self) -> None:
        """RTS falls now, whatever is still on its way. Idempotent."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._up:
            self._up = False
            self._move(0)

    def _look(self) -> None:
        """Let RTS fall if all has left; otherwise look again when it should have."""
        self._timer = None
        now = self._loop.time()
        wait = self._leaves - now
        if wait <= 0 and -wait < PATIENCE:
            wait = self._waiting() * self._byte_s
        if wait <= 0:
            self.end()
        else:
            self._timer = self._loop.call_at(now + wait, self._look)
