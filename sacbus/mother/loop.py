"""An event loop's time, for transactions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from sacbus.kernel import SECOND, Ns

__all__ = ["LoopClock"]


class LoopClock:
    """An event loop's clock for :class:`Caller`: ns since this object was made."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._time = loop.time
        self._start = loop.time()

    @property
    def now(self) -> Ns:
        """Ns since the start."""
        # Rounded: a timer that fires at its very time must not find itself a nanosecond early.
        return round((self._time() - self._start) * SECOND)

    def at(self, when: Ns, callback: Callable[..., object], *arguments: object) -> object:
        """Call back then; gives the loop's timer handle."""
        return self._loop.call_at(self._start + when / SECOND, callback, *arguments)
