"""The time that transactions go by: what they ask of a clock.

A :class:`~sacbus.kernel.Kernel` is one as it is; that of an event loop is in ``loop.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol as Contract

from sacbus.kernel import Ns

__all__ = ["Clock"]


class Clock(Contract):
    """Time and appointments; a :class:`~sacbus.kernel.Kernel` is one."""

    @property
    def now(self) -> Ns:
        """Ns since some start."""
        ...

    def at(self, when: Ns, callback: Callable[..., object], *arguments: object) -> object:
        """Call back then."""
        ...
