"""Hints of opens and closes, from the system itself; a plain file will do."""

from __future__ import annotations

import os
import resource
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sacbus.links import Presence
from tests.links.rig import until

pytestmark = [
    pytest.mark.asyncio,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="inotify is Linux's"),
]


@pytest.fixture
def path(tmp_path: Path) -> str:
    file = tmp_path / "file"
    file.touch()
    return str(file)


def watched(presence: Presence, path: str, hint: Callable[[list[bool]], None]) -> int:
    watch = presence.watch(path, hint)
    assert watch is not None
    return watch


async def test_an_open_and_a_close_are_told_in_order(path: str) -> None:
    presence, told = Presence(), list[bool]()
    watch = watched(presence, path, told.extend)
    for flags in (os.O_RDONLY, os.O_WRONLY, os.O_RDWR):
        os.close(os.open(path, flags))
    await until(lambda: told == [True, False] * 3)
    presence.forget(watch)


async def test_equal_events_in_a_row_are_told_as_one(path: str) -> None:
    # Why nobody may count on counting them.
    presence, told = Presence(), list[bool]()
    watch = watched(presence, path, told.extend)
    files = [os.open(path, os.O_RDONLY) for _ in range(3)]
    for file in files:
        os.close(file)
    await until(lambda: told == [True, False])
    presence.forget(watch)


async def test_what_waits_is_told_at_once_when_asked(path: str) -> None:
    presence, told = Presence(), list[bool]()
    watch = watched(presence, path, told.extend)
    presence.attend()
    assert told == []
    file = os.open(path, os.O_RDONLY)
    presence.attend()
    assert told == [True]
    os.close(file)
    presence.forget(watch)


async def test_each_path_has_its_own_hints_and_all_share_a_descriptor(tmp_path: Path) -> None:
    presence = Presence()
    told: dict[str, list[bool]] = {}
    watches = []
    before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208 (a count, no paths)
    for name in ("a", "b", "c"):
        (tmp_path / name).touch()
        told[name] = []
        watches.append(watched(presence, str(tmp_path / name), told[name].extend))
    assert len(os.listdir("/proc/self/fd")) == before + 1  # noqa: PTH208
    os.close(os.open(tmp_path / "b", os.O_RDONLY))
    await until(lambda: told == {"a": [], "b": [True, False], "c": []})
    for watch in watches:
        presence.forget(watch)


async def test_what_happens_unseen_is_not_told_and_what_comes_after_is(path: str) -> None:
    presence, told = Presence(), list[bool]()
    watch = watched(presence, path, told.extend)
    with presence.unseen(path):
        os.close(os.open(path, os.O_RDONLY))
    file = os.open(path, os.O_RDONLY)
    await until(lambda: told)
    assert told == [True]
    os.close(file)
    presence.forget(watch)


async def test_a_path_that_is_forgotten_is_not_told_of_any_more(path: str) -> None:
    presence, told, other = Presence(), list[bool](), list[bool]()
    directory = str(Path(path).parent)
    watch = watched(presence, path, told.extend)
    witness = watched(presence, directory, other.extend)
    os.close(os.open(path, os.O_RDONLY))
    presence.forget(watch)
    os.close(os.open(directory, os.O_RDONLY))
    await until(lambda: other)
    assert told == []
    presence.forget(witness)


async def test_a_hint_may_forget_any_watch(tmp_path: Path) -> None:
    presence = Presence()
    watches: list[int] = []

    def forget_all(events: list[bool]) -> None:
        while watches:
            presence.forget(watches.pop())

    for name in ("a", "b"):
        (tmp_path / name).touch()
        watches.append(watched(presence, str(tmp_path / name), forget_all))
    for name in ("a", "b"):
        os.close(os.open(tmp_path / name, os.O_RDONLY))
    await until(lambda: not watches)


async def test_lost_events_are_told_as_an_empty_hint(path: str) -> None:
    limit = int(Path("/proc/sys/fs/inotify/max_queued_events").read_text())
    presence, told = Presence(), list[list[bool]]()
    watch = watched(presence, path, told.append)
    for _ in range(limit // 2 + 10):
        os.close(os.open(path, os.O_RDONLY))
    await until(lambda: [] in told)
    presence.forget(watch)


async def test_a_path_that_is_not_there_cannot_be_watched(tmp_path: Path) -> None:
    assert Presence().watch(str(tmp_path / "nothing"), lambda events: None) is None


async def test_without_a_descriptor_to_be_had_nothing_is_watched(path: str) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        assert Presence().watch(path, lambda events: None) is None
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
