"""kill -9 while parameters and queues are being saved: every file is whole, old or new.

A process of its own has everything loaded and forks one that hosts a bus for each kill, so that two
hundred of them take seconds.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Final

import pytest

from nodes.sac.memory import Memory
from sacbus.state import StateDirectory, read_memory
from tests.serving import until

KILLS: Final = 200
NODES: Final = (10, 11)

NURSERY: Final = '''
import asyncio, os, sys
from pathlib import Path
from sacbus.daemon import Configuration, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.node import find_kind

find_kind("sac")
place, virtual = Path(sys.argv[1]), sys.argv[2] == "virtual"


def say(*words):
    os.write(1, (" ".join(map(str, words)) + "\\n").encode())


async def saves():
    """Count up: the cycle is stored, then a queue that holds the same number."""
    async with open_bus(Configuration(nodes=%(nodes)r, state=place)) as bus:
        say("ready", len(bus.bus.reports))
        nodes = list(bus.bus.nodes)
        number = max(node.board.eeprom.cycle for node in nodes)
        while True:
            number += 1
            say("begins", number)
            for node in nodes:
                for line in (f"$Cb{number}", f"q1m{number}", "qs"):
                    node.terminal.type(line.encode() + b"\\r", bus.now())
                await asyncio.sleep(0)
            say("ended", number)


while sys.stdin.readline():
    child = os.fork()
    if not child:
        try:
            run_virtual(Kernel(), saves()) if virtual else asyncio.run(saves())
        finally:
            os._exit(1)
    say("child", child)
    say("dead", os.waitpid(child, 0)[1])
'''


class Nursery:
    """Bears buses one after the other."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def kill_one(
        self, steps: int, after: float, come_to: Callable[[], object] | None = None
    ) -> dict[str, int]:
        """Have a bus begin or end so many saves, and kill it so many seconds later.

        However slow the machine is, it gets somewhere; ``come_to`` is waited for before. The last
        number it said of each word.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        said: dict[str, int] = {}
        while "ready" not in said or "child" not in said:
            self._take_line(said)
        for _ in range(steps):
            self._take_line(said)
        if come_to is not None:
            until(come_to)
        # The one place where a duration is meant: the instant of death is to be any.
        time.sleep(after)
        os.kill(said["child"], signal.SIGKILL)
        while "dead" not in said:
            self._take_line(said)
        assert said["dead"] == signal.SIGKILL
        return said

    def _take_line(self, said: dict[str, int]) -> None:
        assert self._process.stdout is not None
        assert "dead" not in said, f"a bus has ended by itself, wait status {said['dead']}"
        line = self._process.stdout.readline()
        assert line, "the nursery has ended"
        word, number = line.split()
        said[word] = int(number)


@contextmanager
def nursery(place: Path, mode: str) -> Iterator[Nursery]:
    with subprocess.Popen(
        [sys.executable, "-c", NURSERY % {"nodes": NODES}, place, mode],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield Nursery(process)
        finally:
            process.kill()


def stored(place: Path, address: int) -> tuple[int, int]:
    """The cycle and the number in the queue of a file, which any node would take as it is."""
    memory, remarks = Memory().restored(read_memory(place / "bus" / str(address)).memory)
    assert remarks == []
    steps = 0 if memory.queue is None else memory.queue[0].steps or 0
    return memory.cycle, steps


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["virtual", "real"])
def test_whenever_it_is_killed_every_file_holds_the_old_or_the_new(
    tmp_path: Path, mode: str
) -> None:
    chance = Random(mode)
    was = dict.fromkeys(NODES, (3_000, 0))
    unfinished = 0
    with nursery(tmp_path, mode) as bears:
        for number in range(KILLS):
            # In real time a thread saves, and many a life is over before it does: every fourth is
            # spared until it has.
            spared = mode == "real" and number % 4 == 0
            said = bears.kill_one(
                chance.randint(1, 4),
                chance.uniform(0, 0.004),
                (lambda: all(stored(tmp_path, one)[0] > was[one][0] for one in NODES))
                if spared
                else None,
            )
            # Nothing that the one before left behind was worth a word.
            assert said["ready"] == 0
            begun = said.get("begins", 0)
            ended = said.get("ended", 0)
            for address in NODES:
                cycle, steps = now = stored(tmp_path, address)
                allowed = {was[address]}
                if mode == "virtual":
                    # Saved at once: all that ended, and of what began any part from the front.
                    if ended:
                        allowed = {(ended, ended)}
                    if begun != ended:
                        old = max(allowed)
                        allowed |= {(begun, old[1]), (begun, begun)}
                    assert now in allowed
                else:
                    # Saved soon: whatever was asked for last, or before.
                    assert steps in (cycle, cycle - 1, was[address][1])
                    assert was[address] <= now <= (max(begun, was[address][0]),) * 2
                unfinished += now != (begun, begun)
                was[address] = now
    assert unfinished > KILLS // 10
    progress = KILLS if mode == "virtual" else KILLS // 4
    assert min(was.values()) > (3_000 + progress, 0)
    # A killed one may leave a piece behind; the next start clears it away.
    state = StateDirectory(tmp_path, "bus")
    state.claim()
    state.release()
    assert sorted(one.name for one in (tmp_path / "bus").iterdir()) == [str(one) for one in NODES]
