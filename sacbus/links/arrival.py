"""A hint that a path has come into being: a device that is plugged in again, from Linux's inotify.

Owns the watch of one directory for one name. A hint, not truth: whoever is told looks, and looks
now and then without being told, for a directory may itself come and go (/dev/serial/by-id does).
"""

from __future__ import annotations

import asyncio
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Final

from .presence import inotify_library

__all__ = ["Arrival"]

# linux/inotify.h. Attributes too: udev makes a device first, and then ours to open.
_ARRIVED: Final = 0x100 | 0x80 | 0x04  # IN_CREATE, IN_MOVED_TO, IN_ATTRIB
_EVENT: Final = struct.Struct("iIII")  # watch, mask, cookie, length of the name that follows
_READ: Final = 4096


class Arrival:
    """Calls ``hint`` whenever something may have come to ``path``, until it is closed.

    Needs a running event loop. Does nothing where there is no inotify, no more of it, or no
    directory to watch.
    """

    def __init__(self, path: str, hint: Callable[[], object]) -> None:
        self._name = os.fsencode(Path(path).name)
        self._hint = hint
        self._loop = asyncio.get_running_loop()
        self._inotify: int | None = None
        library = inotify_library()
        if library is None:
            return
        inotify = int(library.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC))
        if inotify < 0:
            return
        directory = os.fsencode(Path(path).parent)
        if int(library.inotify_add_watch(inotify, directory, _ARRIVED)) < 0:
            os.close(inotify)
            return
        self._inotify = inotify
        self._loop.add_reader(inotify, self._read)

    def close(self) -> None:
        """Watch no more. Idempotent."""
        if self._inotify is not None:
            self._loop.remove_reader(self._inotify)
            os.close(self._inotify)
            self._inotify = None

    def _read(self) -> None:
        assert self._inotify is not None  # closing takes the reader away
        data = os.read(self._inotify, _READ)
        at = 0
        named = False
        while at < len(data):
            _, _, _, length = _EVENT.unpack_from(data, at)
            at += _EVENT.size
            name = data[at : at + length].rstrip(b"\0")
            # No name: events were lost, or the directory itself has changed.
            named |= name in (self._name, b"")
            at += length
        if named:
            self._hint()
