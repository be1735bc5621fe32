"""The two ends of one pseudo-terminal, as the bus needs them.

Owns the descriptors, the line's settings, and what Linux says about who is there; knows no event
loop.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import termios
from typing import Final

from .errors import LinkError
from .settings import LineSettings

__all__ = ["PtyPair"]

_CHUNK: Final = 65_536  # the most one read may bring; Linux gives 4 kB at a time
_REMEDIES: Final = {
    errno.EMFILE: "raise this user's limit of open files (ulimit -n), or open fewer links",
    errno.ENFILE: "close programs that have many files open",
    errno.ENOSPC: "close programs that use ptys, or raise the system's limit of them",
}
_SLAVE: Final = os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC


class PtyPair:
    """A raw pty at `baud`; `path` is the slave's, for clients. The bus reads and writes the master.

    Raises LinkError when the system has no pty left.
    """

    def __init__(self, baud: int) -> None:
        try:
            self.master, slave = os.openpty()
        except OSError as error:
            what = f"no pty to be had ({error.strerror})"
            remedy = _REMEDIES.get(error.errno or 0, "use another link")
            raise LinkError(what, "/dev/ptmx", remedy) from error
        self.path = os.ttyname(slave)
        self._baud = baud
        self._held: int | None = slave
        self._settings = LineSettings(slave)
        try:
            self._settings.make_raw(baud)
            os.set_blocking(self.master, False)
            os.set_blocking(slave, False)
        except BaseException:
            self.close()
            raise

    def let_go(self) -> None:
        """Close our own slave end, so that `read` can tell whether clients have theirs open.

        Until then it takes somebody to be there always. Only for Linux, where the line keeps its
        settings meanwhile and the master can set them.
        """
        if self._held is not None:
            self._settings = LineSettings(self.master)
            os.close(self._held)
            self._held = None

    def read(self) -> bytes | None:
        """What clients have written, b"" if nothing waits, None if nobody has the slave open."""
        try:
            return os.read(self.master, _CHUNK)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return None

    def write(self, data: bytes) -> int:
        """Hand bytes to the slave's buffer; how many it took, fewer than given when it is full."""
        try:
            return os.write(self.master, data)
        except BlockingIOError:
            return 0

    def baud(self) -> int:
        """The rate that the line is set to, in bits a second; costs 1 µs."""
        return self._settings.baud()

    def reset(self) -> int:
        """Make the line as it was on the first day; how many unread bytes that threw away.

        Raises OSError (EBUSY) when a client that was killed has left the line exclusive (TIOCEXCL)
        and we may not override that, as only a superuser may.
        """
        self._settings.make_raw(self._baud)
        slave = os.open(self.path, _SLAVE)
        try:
            fcntl.ioctl(slave, termios.TIOCNXCL)
            return _unread(slave)
        finally:
            os.close(slave)

    def drain(self) -> int:
        """Throw away what clients have not read; how many bytes that was. Raises as `reset`."""
        slave = os.open(self.path, _SLAVE)
        try:
            return _unread(slave)
        finally:
            os.close(slave)

    def close(self) -> None:
        """Hang up on whoever is there."""
        if self._held is not None:
            os.close(self._held)
            self._held = None
        os.close(self.master)


def _unread(slave: int) -> int:
    """Read the slave empty. Not tcflush: that leaves what is still on its way inside the kernel."""
    count = 0
    with contextlib.suppress(BlockingIOError):
        while data := os.read(slave, _CHUNK):
            count += len(data)
    return count
