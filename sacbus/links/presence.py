"""Hints that somebody has opened or closed a path, from Linux's inotify.

Hints, not truth: the kernel merges equal events that follow each other unread, so two clients that
come in the same instant are one event. Whoever needs to know asks the pty (see pty.py); a hint says
when.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import os
import struct
import sys
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Final

with contextlib.suppress(ImportError):  # Windows has neither, and no inotify to use them for
    import fcntl
    import termios

__all__ = ["Hint", "Presence", "inotify_library"]

# linux/inotify.h. IN_CLOSE is both ways of closing; the overflow comes unasked.
_IN_CLOSE: Final = 0x08 | 0x10
_IN_OPEN: Final = 0x20
_IN_DELETE_SELF: Final = 0x400
_IN_Q_OVERFLOW: Final = 0x4000
_EVENT: Final = struct.Struct("iIII")  # watch, mask, cookie, length of the name that follows
_READ: Final = 4096  # some 256 events; what does not fit is read at the loop's next turn

Hint = Callable[[list[bool]], None]
"""Told what happened, oldest first: True for an open, False for a close; [] when some were lost."""


class Presence:
    """Watches any number of paths with one descriptor, from the first `watch` to the last `forget`.

    Share one between many links: a user may have only 128 by default. Needs a running event loop.
    """

    def __init__(self) -> None:
        self._inotify: int | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._hints: dict[int, Hint] = {}
        self._waiting = array("i", [0])

    def watch(self, path: str, hint: Hint) -> int | None:
        """Call `hint` at every open and close of `path` from now on; the number to forget it by.

        None where there is no inotify, or no more of it: nothing will be told.
        """
        if _LIBC is None or (self._inotify is None and not self._begin(_LIBC)):
            return None
        watch = self._look_out_for(path, _IN_OPEN | _IN_CLOSE)
        if watch < 0:
            self._end_if_unused()
            return None
        self._hints[watch] = hint
        return watch

    @contextmanager
    def unseen(self, path: str) -> Iterator[None]:
        """Give no hint of what happens to a watched path meanwhile: our own opens are no clients.

        A client that comes meanwhile is not hinted either, so look for one afterwards.
        """
        # A second watch of a path replaces what the first looks out for, and keeps its number.
        self._look_out_for(path, _IN_DELETE_SELF)
        try:
            yield
        finally:
            self._look_out_for(path, _IN_OPEN | _IN_CLOSE)

    def forget(self, watch: int) -> None:
        """End a watch; hints of it that still wait are dropped."""
        del self._hints[watch]
        if _LIBC is not None and self._inotify is not None:
            # It fails when the device has gone and has taken its watch along, which is as good.
            _LIBC.inotify_rm_watch(self._inotify, watch)
        self._end_if_unused()

    def attend(self) -> None:
        """Give the hints that wait, before the loop would; costs 1 µs when there are none."""
        if self._inotify is not None:
            fcntl.ioctl(self._inotify, termios.FIONREAD, self._waiting)
            if self._waiting[0]:
                self._read()

    def _begin(self, libc: ctypes.CDLL) -> bool:
        inotify = int(libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC))
        if inotify < 0:
            return False
        self._inotify, self._loop = inotify, asyncio.get_running_loop()
        self._loop.add_reader(inotify, self._read)
        return True

    def _look_out_for(self, path: str, mask: int) -> int:
        if _LIBC is None or self._inotify is None:
            return -1
        return int(_LIBC.inotify_add_watch(self._inotify, os.fsencode(path), mask))

    def _read(self) -> None:
        if self._inotify is None:
            return
        try:
            data = os.read(self._inotify, _READ)
        except BlockingIOError:  # `attend` was quicker than the loop
            return
        happened: dict[int, list[bool]] = {}
        at = 0
        while at < len(data):
            watch, mask, _, length = _EVENT.unpack_from(data, at)
            at += _EVENT.size + length
            if mask & _IN_Q_OVERFLOW:
                happened.update((every, []) for every in self._hints)
            elif mask & (_IN_OPEN | _IN_CLOSE):
                happened.setdefault(watch, []).append(bool(mask & _IN_OPEN))
        for watch, events in happened.items():
            hint = self._hints.get(watch)  # forgotten meanwhile, perhaps by the hint before
            if hint is not None:
                hint(events)

    def _end_if_unused(self) -> None:
        if not self._hints and self._inotify is not None and self._loop is not None:
            self._loop.remove_reader(self._inotify)
            os.close(self._inotify)
            self._inotify = self._loop = None


@cache
def inotify_library() -> ctypes.CDLL | None:
    """The C library, where it has inotify."""
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    return library if hasattr(library, "inotify_init1") else None


_LIBC: Final = inotify_library()
