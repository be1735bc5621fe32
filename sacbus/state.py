"""The state directory: one small file per node's EEPROM, never half written.

Owns where and how persistent memory lies on disk: ``DIR/BUS/ADDRESS``, JSON with a check value,
replaced atomically. A file that cannot be trusted is kept aside and reported; the node then starts
with factory values, as a device with a worn EEPROM would.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

if sys.platform != "win32":
    import fcntl

from platformdirs import user_state_path

__all__ = ["StateDirectory", "StateError", "Stored", "default_directory", "read_memory"]

_FORMAT: Final = 1

#: The end of the name of a file that is being written.
_UNFINISHED: Final = ".new"

_CURE: Final = "choose another directory with --state DIR, or --ephemeral to keep nothing"


class StateError(OSError):
    """The state directory cannot be used; the text says what, where and what to do."""


@dataclass(frozen=True, slots=True)
class Stored:
    """What a file holds: the kind of node that wrote it, and its memory by name, JSON values."""

    kind: str
    memory: dict[str, object]


def default_directory() -> Path:
    """The user's own state directory for sacbus; StateError for a user who has no home."""
    try:
        return user_state_path("sacbus")
    except RuntimeError as fault:  # no HOME, and nobody by this number in the system's list
        raise StateError(f"there is no home directory for node memory, HOME, {_CURE}") from fault


class StateDirectory:
    """EEPROM files of one bus."""

    def __init__(self, directory: Path, bus: str) -> None:
        self._place = directory / bus
        self._lock: int | None = None

    def path(self, address: int) -> Path:
        """Where the memory of the node configured at ``address`` lies."""
        return self._place / str(address)

    def load(self, address: int, kind: str) -> tuple[dict[str, object] | None, str | None]:
        """The stored memory, if there is one that can be trusted, and a remark if there is not.

        A damaged file, or one of another kind of node, is renamed to ``ADDRESS.damaged`` (the next
        to ``.damaged.2`` and so on), so that nothing is lost.
        """
        path = self.path(address)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None, None
        except OSError as fault:
            raise self._unusable("read", path, fault) from fault
        stored, wrong = _decode(content)
        if stored is not None:
            if stored.kind == kind:
                return stored.memory, None
            wrong = f"of a node of kind {stored.kind!r}, not {kind!r}"
        aside = _free_name(path)
        try:
            path.rename(aside)
        except OSError as fault:
            raise self._unusable("set aside", path, fault) from fault
        return None, f"EEPROM file {path}: {wrong}; kept as {aside.name}, factory values used"

    def save(self, address: int, kind: str, memory: Mapping[str, object]) -> None:
        """Write a memory; whatever happens, the file is either the old or the new one.

        StateError when it cannot be written, whatever is wrong with the directory.
        """
        path = self.path(address)
        content = _encode(kind, memory)
        if self._holds(path, content):
            return
        fresh = path.with_name(f".{path.name}.{os.getpid()}{_UNFINISHED}")
        try:
            self._place.mkdir(parents=True, exist_ok=True)
            with fresh.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            fresh.replace(path)
        except OSError as fault:
            # What kept it from being written may keep it from being removed: the next claim will.
            with contextlib.suppress(OSError):
                fresh.unlink(missing_ok=True)
            raise self._unusable("write", path, fault) from fault

    def _holds(self, path: Path, content: bytes) -> bool:
        try:
            return path.read_bytes() == content
        except OSError:  # whatever is wrong there, writing will tell
            return False

    def claim(self) -> None:
        """Take the bus's memory for this process, and make sure that it can be saved later.

        StateError otherwise, also while another process has it: two would overwrite each other.
        """
        self._make()
        if sys.platform == "win32":
            return
        # The directory itself is locked, so that nothing but memories ever lies in it.
        try:
            lock = os.open(self._place, os.O_RDONLY | os.O_CLOEXEC)
        except OSError as fault:  # it may be writable and not readable
            raise self._unusable("lock", self._place, fault) from fault
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as fault:
            os.close(lock)
            if not isinstance(fault, BlockingIOError):
                raise self._unusable("lock", self._place, fault) from fault
            raise StateError(
                f"the nodes' memory is in use by another sacbus, {self._place}, {_CURE}"
            ) from fault
        self._lock = lock
        try:
            self._clear_away()
        except BaseException:
            self.release()
            raise

    def _clear_away(self) -> None:
        """Remove what saves left behind that were killed; the directory is ours alone."""
        for left in self._place.glob(f".*{_UNFINISHED}"):
            try:
                left.unlink()
            except OSError as fault:
                raise self._unusable("clear away unfinished", left, fault) from fault

    def release(self) -> None:
        """Let others have it. Idempotent."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _make(self) -> None:
        try:
            self._place.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise StateError(
                f"cannot create the state directory ({fault.strerror or fault}), {self._place}, "
                f"{_CURE}"
            ) from fault
        if not os.access(self._place, os.W_OK | os.X_OK):
            raise StateError(f"cannot write the state directory, {self._place}, {_CURE}")

    @staticmethod
    def _unusable(what: str, path: Path, fault: OSError) -> StateError:
        return StateError(f"cannot {what} node memory ({fault.strerror or fault}), {path}, {_CURE}")


def read_memory(path: Path) -> Stored:
    """What a memory's file holds, wherever it lies; StateError when it cannot be trusted."""
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise StateError(
            f"cannot read node memory ({fault.strerror or fault}), {path}, give the file of a "
            "node: ADDRESS in the directory of its bus"
        ) from fault
    stored, wrong = _decode(content)
    if stored is None:
        raise StateError(
            f"this is no node's memory that can be trusted, {path}, {wrong}; a bus that finds it "
            "keeps it aside and starts the node with factory values"
        )
    return stored


def _encode(kind: str, memory: Mapping[str, object]) -> bytes:
    body = {"format": _FORMAT, "kind": kind, "memory": dict(memory)}
    return (json.dumps({**body, "check": _check(body)}, indent=1) + "\n").encode()


def _decode(content: bytes) -> tuple[Stored | None, str]:
    """What is stored, or None and what is wrong with the file."""
    try:
        stored: Any = json.loads(content)  # whatever JSON it is
    except (ValueError, RecursionError):
        return None, "not readable as JSON"
    if not isinstance(stored, dict) or not isinstance(stored.get("memory"), dict):
        return None, "not a node's memory"
    check = stored.pop("check", None)
    if check != _check(stored):
        return None, f"check value {check!r} does not match the content"
    if stored.get("format") != _FORMAT:
        return None, f"format {stored.get('format')!r}, this version reads {_FORMAT}"
    return Stored(str(stored.get("kind")), stored["memory"]), ""


def _check(body: Mapping[str, object]) -> int:
    return zlib.crc32(json.dumps(body, sort_keys=True).encode())


def _free_name(path: Path) -> Path:
    candidate = path.with_name(f"{path.name}.damaged")
    number = 1
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{path.name}.damaged.{number}")
    return candidate
