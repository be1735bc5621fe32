"""A stable path to a pty: a symlink that one live run owns.

The numbers under /dev/pts are handed out again, so a symlink that a killed run left behind may
point at somebody's shell. PATH.lock, locked by flock for as long as its run lives and holding its
number, tells the two apart: a symlink beside an unlocked PATH.lock is a dead run's and is replaced;
every other thing at PATH is somebody's and is refused.

The lock comes first, then the look at PATH, then the number, then the symlink, in one step. Going
down it is the other way round. Two rules keep that free of races: a PATH.lock without a number has
never guarded anything, so that a newborn one is not mistaken for a dead run's; and it is unlinked
only while locked, so whoever has locked it must look whether it still bears its name.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
from pathlib import Path

from .errors import LinkError, PathTaken

__all__ = ["Symlink"]


class Symlink:
    """PATH -> a device, from `claim` to `release`."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.name:
            raise LinkError("a directory is in the way", str(self.path), "choose another path")
        self._lock_path = self.path.with_name(self.path.name + ".lock")
        self._beside = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        self._lock: int | None = None
        self._target = ""

    def claim(self, target: str) -> None:
        """Lock the path and point it at `target`.

        Raises PathTaken or LinkError, one line each, and leaves everything as it was.
        """
        if self._lock is not None:
            raise LinkError("the path is claimed already", str(self.path), "release it first")
        try:
            self._lock = self._point_under_lock(target)
        except LinkError:
            raise
        except FileNotFoundError as error:
            raise LinkError(
                "no such directory", str(self.path.parent), "create it or choose another path"
            ) from error
        except OSError as error:
            what = f"cannot make the symlink ({error.strerror})"
            remedy = "choose another path"
            if error.errno == errno.EMFILE:
                remedy = "raise this user's limit of open files (ulimit -n), or open fewer links"
            raise LinkError(what, str(self.path), remedy) from error

    def point(self, target: str) -> None:
        """Point the claimed path at `target`, in one step: it is never missing in between."""
        with contextlib.suppress(
            FileNotFoundError
        ):  # of a run with our number that was killed here
            self._beside.unlink()
        self._beside.symlink_to(target)
        self._beside.replace(self.path)
        self._target = target

    def release(self) -> None:
        """Remove symlink and lock, not what others have put there. May be called again."""
        if self._lock is None:
            return
        lock, self._lock = self._lock, None
        try:
            if (
                self._target
                and self.path.is_symlink()
                and str(self.path.readlink()) == self._target
            ):
                self.path.unlink()
            if _is_named(lock, self._lock_path):
                self._lock_path.unlink()
        except OSError as error:
            what = f"cannot remove the symlink ({error.strerror})"
            raise LinkError(what, str(self.path), f"remove it and {self._lock_path}") from error
        finally:
            self._target = ""
            os.close(lock)

    def _point_under_lock(self, target: str) -> int:
        lock = self._take_lock()
        newborn = os.fstat(lock).st_size == 0
        try:
            if os.path.lexists(self.path) and (newborn or not self.path.is_symlink()):
                raise self._not_ours()
            os.ftruncate(lock, 0)
            os.pwrite(lock, b"%d\n" % os.getpid(), 0)
            self.point(target)
        except BaseException:
            if newborn:
                self._lock_path.unlink()
            os.close(lock)
            raise
        return lock

    def _take_lock(self) -> int:
        """PATH.lock, locked, and still of that name."""
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
        while True:  # whoever loses a round has lost it to one who got through
            lock = os.open(self._lock_path, flags, 0o644)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if _is_named(lock, self._lock_path):
                    return lock
            except BlockingIOError:
                owner = os.pread(lock, 20, 0).decode("ascii", "replace").strip()
                os.close(lock)
                what = f"the path is served by process {owner or 'unknown'}"
                raise PathTaken(what, str(self.path), "stop it or choose another path") from None
            except BaseException:
                os.close(lock)
                raise
            os.close(lock)

    def _not_ours(self) -> PathTaken:
        if self.path.is_symlink():
            what = f"a symlink to {self.path.readlink()} that is not ours is in the way"
        elif self.path.is_dir():
            what = "a directory is in the way"
        else:
            what = "a file is in the way"
        return PathTaken(what, str(self.path), "remove it or choose another path")


def _is_named(descriptor: int, path: Path) -> bool:
    """Whether the open file still bears this name."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except FileNotFoundError:
        return False
