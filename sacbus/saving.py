"""Saving nodes' memories while a bus runs, without holding up the line.

Owns when a memory is written: in real time by a thread, since a disk may take its time; in virtual
time at once, since nothing waits there. Which file, and that it is whole, is ``state.py``'s
business. A save that fails is told, and the node goes on.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Mapping
from typing import Final

from sacbus.state import StateDirectory

__all__ = ["AtOnce", "Saving", "Soon"]

Memory = Mapping[str, object]

#: Told of a save that has failed: the address in the configuration, and the reason in a line.
Failed = Callable[[int, str], object]


class AtOnce:
    """Writes while the caller waits."""

    def __init__(self, state: StateDirectory, failed: Failed) -> None:
        self._state: Final = state
        self._failed: Final = failed

    def save(self, address: int, kind: str, memory: Memory) -> None:
        """Write it now; ``failed`` is told if it cannot be."""
        try:
            self._state.save(address, kind, memory)
        except OSError as fault:  # StateError is one; no other may end the saving either
            self._failed(address, str(fault))

    def close(self) -> None:
        """Nothing is left to do."""


class Soon:
    """Writes in a thread of its own, which begins with the first save.

    Of several memories of one node that wait, the newest is written: each file goes from one of
    them to a later one, never back. To be made in a running event loop, where ``failed`` is called.
    """

    def __init__(self, state: StateDirectory, failed: Failed) -> None:
        self._at_once = AtOnce(state, self._tell)
        self._failed = failed
        self._loop = asyncio.get_running_loop()
        self._changed = threading.Condition()
        self._waiting: dict[int, tuple[str, Memory]] = {}
        self._closed = False
        self._thread: threading.Thread | None = None

    def save(self, address: int, kind: str, memory: Memory) -> None:
        """Have it written soon; never waits for the disk. Not after :meth:`close`."""
        with self._changed:
            self._waiting[address] = (kind, memory)
            self._changed.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="sacbus memory", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Wait until all is written. Idempotent."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._closed:
                    self._changed.wait()
                if not self._waiting:
                    return
                address = next(iter(self._waiting))
                kind, memory = self._waiting.pop(address)
            self._at_once.save(address, kind, memory)

    def _tell(self, address: int, text: str) -> None:
        # The loop may be closed by now; what could not be written is then tried, and told, again
        # by whoever closes the bus.
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._failed, address, text)


Saving = AtOnce | Soon
