"""Saving while a bus runs: in the order of changes, the newest last, and failures are told."""

from __future__ import annotations

import asyncio
import errno
import threading
from collections.abc import Mapping
from pathlib import Path

from sacbus.saving import AtOnce, Soon
from sacbus.state import StateDirectory, read_memory


class SlowDirectory(StateDirectory):
    """A disk that is as slow as a test wants: each save waits until it is let through."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory, "bus")
        self.begun: list[object] = []
        self.gate = threading.Semaphore(0)

    def save(self, address: int, kind: str, memory: object) -> None:
        assert isinstance(memory, dict)
        self.begun.append((address, memory["n"]))
        self.gate.acquire()
        super().save(address, kind, memory)


async def until_begun(state: SlowDirectory, count: int) -> None:
    while len(state.begun) < count:  # noqa: ASYNC110 (it begins in a thread that tells nobody)
        await asyncio.sleep(0.001)


def test_of_what_waits_for_the_disk_each_node_s_newest_is_written(tmp_path: Path) -> None:
    async def scene() -> None:
        state = SlowDirectory(tmp_path)
        saving = Soon(state, lambda address, text: None)
        saving.save(10, "sac", {"n": 0})
        await until_begun(state, 1)
        # The disk is busy with the first: nobody waits for that.
        for number in range(1, 100):
            saving.save(10, "sac", {"n": number})
            saving.save(11, "sac", {"n": -number})
        state.gate.release(3)
        await asyncio.to_thread(saving.close)
        assert state.begun == [(10, 0), (10, 99), (11, -99)]

    asyncio.run(scene())
    assert read_memory(tmp_path / "bus" / "10").memory == {"n": 99}
    assert read_memory(tmp_path / "bus" / "11").memory == {"n": -99}


def threads() -> list[str]:
    return [one.name for one in threading.enumerate() if one.name == "sacbus memory"]


def test_without_a_save_there_is_no_thread(tmp_path: Path) -> None:
    async def scene() -> None:
        saving = Soon(StateDirectory(tmp_path, "bus"), lambda address, text: None)
        assert threads() == []
        saving.save(10, "sac", {})
        assert threads() == ["sacbus memory"]
        saving.close()
        saving.close()
        assert threads() == []

    asyncio.run(scene())


def test_a_failure_is_told_in_the_loop_and_the_next_save_goes_on(tmp_path: Path) -> None:
    told: list[tuple[int, str, threading.Thread]] = []

    async def scene() -> None:
        (tmp_path / "bus" / "10").mkdir(parents=True)
        (tmp_path / "bus" / "10" / "something").touch()
        saving = Soon(
            StateDirectory(tmp_path, "bus"),
            lambda address, text: told.append((address, text, threading.current_thread())),
        )
        saving.save(10, "sac", {})
        saving.save(11, "sac", {})
        saving.close()
        await asyncio.sleep(0)

    asyncio.run(scene())
    ((address, text, thread),) = told
    assert address == 10
    assert text.startswith("cannot write node memory")
    assert thread is threading.main_thread()
    assert (tmp_path / "bus" / "11").is_file()


def test_a_directory_that_is_no_more_ends_no_saving_and_the_next_goes_to_its_successor(
    tmp_path: Path,
) -> None:
    told: asyncio.Queue[str] = asyncio.Queue()
    place = tmp_path / "bus"

    async def scene() -> None:
        place.touch()  # a file: nothing can be made in it, and nothing removed
        saving = Soon(StateDirectory(tmp_path, "bus"), lambda _, text: told.put_nowait(text))
        async with asyncio.timeout(30):
            saving.save(10, "sac", {"n": 1})
            assert (await told.get()).startswith("cannot write node memory (")
            place.unlink()
            saving.save(10, "sac", {"n": 2})
        saving.close()
        assert told.empty()

    asyncio.run(scene())
    assert read_memory(place / "10").memory == {"n": 2}


class BrokenDirectory(StateDirectory):
    """A disk with a fault that nobody has foreseen, for one of the nodes."""

    def save(self, address: int, kind: str, memory: Mapping[str, object]) -> None:
        if address == 10:
            raise OSError(errno.EIO, "Input/output error")
        super().save(address, kind, memory)


def test_no_fault_of_a_disk_ends_the_saving(tmp_path: Path) -> None:
    told: list[tuple[int, str]] = []

    async def scene() -> None:
        saving = Soon(BrokenDirectory(tmp_path, "bus"), lambda *failed: told.append(failed))
        saving.save(10, "sac", {})
        saving.save(11, "sac", {"n": 5})
        saving.close()
        await asyncio.sleep(0)

    asyncio.run(scene())
    assert told == [(10, "[Errno 5] Input/output error")]
    assert read_memory(tmp_path / "bus" / "11").memory == {"n": 5}


def test_at_once_means_before_it_comes_back(tmp_path: Path) -> None:
    told: list[object] = []
    saving = AtOnce(StateDirectory(tmp_path, "bus"), lambda *failed: told.append(failed))
    saving.save(10, "sac", {"n": 5})
    assert read_memory(tmp_path / "bus" / "10").memory == {"n": 5}
    (tmp_path / "bus" / "11" / "something").mkdir(parents=True)
    saving.save(11, "sac", {})
    saving.close()
    assert len(told) == 1
