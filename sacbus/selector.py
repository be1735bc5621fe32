"""The event loop's wait for the next event on the bus: as fine as the machine allows.

Owns the selector that a real-time loop sleeps in, and the making of such a loop. Knows descriptors
and seconds only.

asyncio's own selector on Linux counts its time-outs in whole milliseconds, rounded up, so that
everything on the line is late by half of one and more. ``select()`` counts in microseconds, but
takes no descriptor above 1023. So this selector keeps all descriptors in an epoll, however many
there are, and calls ``select()`` on the one descriptor of that epoll. Where there is no epoll
(macOS: kqueue counts in nanoseconds) or it cannot be waited for like this, the system's own
selector waits as ever.

*Precise* mode sleeps until shortly before the time and looks at the clock and the descriptors in
turn for the rest: hardly ever late, at the price of a processor that is busy for that long before
each event.
"""

from __future__ import annotations

import asyncio
import select
import selectors
import sys
from time import monotonic
from typing import Final

__all__ = ["SPIN", "FineSelector", "real_loop"]

#: Seconds before a time-out that precise mode does not sleep: a sleep of 5 ms ends 0.06 to 0.25 ms
#: late on machines of today (``make bench``, lateness).
SPIN: Final = 0.000_3


class FineSelector(selectors.DefaultSelector):
    """The system's selector with time-outs in microseconds. ``precise`` spins their last 0.3 ms."""

    def __init__(self, *, precise: bool = False) -> None:
        super().__init__()
        self._spin = SPIN if precise else 0.0
        #: The epoll, as ``select`` wants it; empty where it cannot wait for it.
        self._epoll: list[int] = []
        if sys.platform == "linux" and isinstance(self, selectors.EpollSelector):
            try:
                select.select([self.fileno()], (), (), 0)
            except ValueError:  # its number is above 1023: the program had that many files open
                return
            self._epoll = [self.fileno()]

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """As the system's selector. Precise mode comes back empty to have its last part asked for.

        asyncio asks again, as of any selector that comes back before the time.
        """
        if timeout is None or timeout <= 0:
            return super().select(timeout)
        if timeout > self._spin:
            return self._sleep(timeout - self._spin)
        deadline = monotonic() + timeout
        while not (ready := super().select(0)) and monotonic() < deadline:
            pass
        return ready

    def _sleep(self, timeout: float) -> list[tuple[selectors.SelectorKey, int]]:
        if not self._epoll:
            return super().select(timeout)
        return super().select(0) if select.select(self._epoll, (), (), timeout)[0] else []


def real_loop(*, precise: bool = False) -> asyncio.AbstractEventLoop:
    """A new event loop that keeps time well: a ``loop_factory`` for :class:`asyncio.Runner`.

    On Windows it is asyncio's own, which alone notices Ctrl-C there; ``precise`` changes nothing.
    """
    if sys.platform == "win32":
        return asyncio.new_event_loop()
    return asyncio.SelectorEventLoop(FineSelector(precise=precise))
