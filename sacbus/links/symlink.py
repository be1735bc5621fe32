"""A stable path to a pty: a symlink that one live run owns.

The numbers under /dev/pts are handed out again, so a symlink that a killed run left behind may
point at somebody's shell. PATH.lock, locked by flock for as long as its run lives, tells the two
apart: a symlink beside an unlocked PATH.lock is a dead run's and is replaced; every other thing at
PATH is somebody's and is refused.

The lock comes first, then the look at PATH, then the symlink, which appears in one step. Two rules
keep that free of races: PATH.lock appears already locked (it is linked into place), so nobody
mistakes a newborn one for a dead run's; and it is unlinked only while locked, so whoever locks it
must look whether it still has its name.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from pathlib import Path
from typing import Final

from .errors import LinkError, PathTaken

__all__ = ["Symlink"]

_CHOOSE: Final = "remove it or choose another path"


class Symlink:
    """PATH -> a device, from `claim` to `release`."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
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
            self._take_lock()
            try:
                self._refuse_what_is_not_ours()
                self.point(target)
            except BaseException:
                self.release()
                raise
        except LinkError:
            raise
        except FileNotFoundError as error:
            raise LinkError(
                "no such directory", str(self.path.parent), "create it or choose another path"
            ) from error
        except OSError as error:
            what = f"cannot make the symlink ({error.strerror})"
            remedy = "change the directory's permissions or choose another path"
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

    def _take_lock(self) -> None:
        """Lock PATH.lock, a dead run's or a new one; whoever loses a round lost it to another."""
        while self._lock is None:
            try:
                self._lock = self._lock_of_a_dead_run()
            except FileNotFoundError:
                if os.path.lexists(self.path):
                    # Before anything is made, so that a refusal leaves no trace.
                    raise self._not_ours() from None
                self._lock = self._new_lock()

    def _lock_of_a_dead_run(self) -> int | None:
        """The lock that stands there, or None when it went away meanwhile."""
        lock = os.open(self._lock_path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_named(lock, self._lock_path):
                os.ftruncate(lock, 0)
                os.pwrite(lock, b"%d\n" % os.getpid(), 0)
                return lock
        except BlockingIOError:
            owner = os.pread(lock, 20, 0).decode("ascii", "replace").strip() or "?"
            os.close(lock)
            what = f"the path is served by process {owner}"
            raise PathTaken(what, str(self.path), "stop it or choose another path") from None
        except BaseException:
            os.close(lock)
            raise
        os.close(lock)
        return None

    def _new_lock(self) -> int | None:
        """A lock of our own, locked before it has its name; None when somebody was quicker."""
        unnamed = self._beside.with_name(self._beside.name + ".lock")
        with contextlib.suppress(
            FileNotFoundError
        ):  # of a run with our number that was killed here
            unnamed.unlink()
        lock = os.open(unnamed, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.pwrite(lock, b"%d\n" % os.getpid(), 0)
            try:
                os.link(unnamed, self._lock_path)
            except FileExistsError:
                os.close(lock)
                return None
        except BaseException:
            os.close(lock)
            raise
        finally:
            unnamed.unlink()
        return lock

    def _refuse_what_is_not_ours(self) -> None:
        """Beside our lock a symlink is a dead run's; anything else was never ours."""
        if os.path.lexists(self.path) and not self.path.is_symlink():
            raise self._not_ours()

    def _not_ours(self) -> PathTaken:
        if self.path.is_symlink():
            what = f"a symlink to {self.path.readlink()} that is not ours is in the way"
        elif self.path.is_dir():
            what = "a directory is in the way"
        else:
            what = "a file is in the way"
        return PathTaken(what, str(self.path), _CHOOSE)


def _is_named(descriptor: int, path: Path) -> bool:
    """Whether the open file still bears this name."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except FileNotFoundError:
        return False
