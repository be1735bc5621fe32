"""A file that appears whole, or not at all.

Owns how a result is put on disk: written beside its place under another name, then renamed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

__all__ = ["NO_ROOM", "fresh_file"]

#: What only writing meets: no room, a file too large, a share used up.
NO_ROOM: Final = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


@contextmanager
def fresh_file(path: Path) -> Iterator[BinaryIO]:
    """Write a file; it replaces what is at ``path`` when the block ends well, else nothing has.

    Through a symlink its target is replaced; a device or a pipe is written to as it is. OSError,
    with ``path`` as its file name, when the place cannot be written; when there is no room, its
    text is a line for users.
    """
    if path.exists() and not path.is_file():  # a directory says so itself
        try:
            with path.open("wb") as file:
                yield file
        except OSError as fault:
            if fault.errno in NO_ROOM and fault.strerror:
                told = f"{path}: {fault.strerror}, what was written is not whole, make room there"
                raise OSError(told) from fault
            raise
        return
    place = path.resolve()
    beside = place.with_name(f".{place.name}.{os.getpid()}.new")
    try:
        with beside.open("wb") as file:
            yield file
        if place.exists():
            shutil.copymode(place, beside)
        beside.replace(place)
    except OSError as fault:
        _remove(beside)
        if fault.errno in NO_ROOM and fault.strerror:
            told = f"{path}: {fault.strerror}, it is left as it was, make room or write elsewhere"
            raise OSError(told) from fault
        if fault.filename in (str(beside), str(place)):
            raise OSError(fault.errno, fault.strerror, str(path)) from fault
        raise
    except BaseException:
        _remove(beside)
        raise


def _remove(beside: Path) -> None:
    """Take away what is not whole, if that can be: what went wrong before is worth telling."""
    with contextlib.suppress(OSError):
        beside.unlink(missing_ok=True)
