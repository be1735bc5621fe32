"""Saving while a bus runs: in the order of changes, the newest last, and failures are told."""

from __future__ import annotations

import asyncio
import os
import threading
from pathlib import Path

from sacbus.saving import AtOnce, Thread
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
        saving = Thread(state, lambda address, text: None)
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


def test_without_a_save_there_is_no_thread() -> None:
    async def scene() -> None:
        before = threading.active_count()
        saving = Thread(StateDirectory(Path(os.devnull), "bus"), lambda address, text: None)
        assert threading.active_count() == before
        saving.close()
        saving.close()

    asyncio.run(scene())


def test_a_failure_is_told_in_the_loop_and_the_next_save_goes_on(tmp_path: Path) -> None:
    told: list[tuple[int, str, threading.Thread]] = []

    async def scene() -> None:
        (tmp_path / "bus" / "10").mkdir(parents=True)
        (tmp_path / "bus" / "10" / "something").touch()
        saving = Thread(
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


def test_at_once_means_before_it_comes_back(tmp_path: Path) -> None:
    told: list[object] = []
    saving = AtOnce(StateDirectory(tmp_path, "bus"), lambda *failed: told.append(failed))
    saving.save(10, "sac", {"n": 5})
    assert read_memory(tmp_path / "bus" / "10").memory == {"n": 5}
    (tmp_path / "bus" / "11" / "something").mkdir(parents=True)
    saving.save(11, "sac", {})
    saving.close()
    assert len(told) == 1
