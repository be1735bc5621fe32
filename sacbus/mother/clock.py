"""The time that transactions go by: the kernel's, or an event loop's.

Owns what they ask of a clock; a :class:`~sacbus.kernel.Kernel` is one as it is.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol as Contract

from sacbus.kernel import SECOND, Ns

__all__ = ["Clock", "LoopClock"]


class Clock(Contract):
    """Time and appointments; a :class:`~sacbus.kernel.Kernel` is one."""

    @property
    def now(self) -> Ns:
        """Ns since some start."""
        ...

    def at(self, when: Ns, callback: Callable[..., object], *arguments: object) -> object:
        """Call back then."""
        ...


class LoopClock:
    """An event loop's clock for :class:`Caller`: ns since this object was made."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._start = loop.time()

    @property
    def now(self) -> Ns:
        """Ns since the start."""
        # Rounded: a timer that fires at its very time must not find itself a nanosecond early.
        return round((self._loop.time() - self._start) * SECOND)

    def at(self, when: Ns, callback: Callable[..., object], *arguments: object) -> object:
        """Call back then; gives the loop's timer handle."""
        return self._loop.call_at(self._start + when / SECOND, callback, *arguments)
