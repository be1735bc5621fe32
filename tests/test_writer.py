"""Standard output that nobody can hold up: order, what is missed, and an output that is gone."""

from __future__ import annotations

import asyncio
import os
import re
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from sacbus.writer import WAITING, Writer


@contextmanager
def piped() -> Iterator[int]:
    """Standard output is a pipe: its reading end. No fixture, since capturing would reset it."""
    reading, writing = os.pipe()
    before = sys.stdout
    with os.fdopen(writing, "w", encoding="utf-8") as output:
        sys.stdout = output
        try:
            yield reading
        finally:
            sys.stdout = before
            os.close(reading)


def missed(count: int) -> str:
    return f"<{count} missed>\n"


def test_texts_are_written_in_order_and_all_of_them_before_it_closes() -> None:
    async def scene() -> None:
        writer = Writer(lambda fault: pytest.fail(repr(fault)), missed)
        for number in range(100):
            writer.say(f"{number} …\n")
        writer.close()

    with piped() as pipe:
        asyncio.run(scene())
        written = os.read(pipe, 65_536).decode()
    assert written == "".join(f"{number} …\n" for number in range(100))


def test_what_a_reader_does_not_take_is_missed_and_counted_and_saying_it_never_waits() -> None:
    line = "x" * 1_000 + "\n"
    said = WAITING + 500  # a pipe holds some 64 of these
    read: list[bytes] = []

    def read_to_the_end(pipe: int) -> None:
        while not (read and read[-1].endswith(b"end\n")):
            read.append(os.read(pipe, 65_536))

    async def scene(pipe: int) -> None:
        writer = Writer(lambda fault: pytest.fail(repr(fault)), missed)
        taken = sum(writer.say(line) for _ in range(said))
        assert WAITING <= taken < said
        reader = threading.Thread(target=read_to_the_end, args=(pipe,), daemon=True)
        reader.start()
        async with asyncio.timeout(60):
            await writer.room()
        assert writer.say("end\n")
        writer.close()
        reader.join(60)

    with piped() as pipe:
        asyncio.run(scene(pipe))
    text = b"".join(read).decode()
    [counted] = re.findall(r"<(\d+) missed>\n", text)
    assert text == line * (said - int(counted)) + missed(int(counted)) + "end\n"


def test_who_can_wait_for_room_misses_nothing_however_slow_the_reader() -> None:
    count = 3 * WAITING
    read: list[bytes] = []

    def read_to_the_end(pipe: int) -> None:
        while not (read and read[-1].endswith(b"end\n")):
            read.append(os.read(pipe, 1_000))

    async def scene(pipe: int) -> None:
        writer = Writer(lambda fault: pytest.fail(repr(fault)), missed)
        reader = threading.Thread(target=read_to_the_end, args=(pipe,), daemon=True)
        held_back = 0
        async with asyncio.timeout(30):
            for number in range(count):
                writer.say(f"{number} {'x' * 100}\n")
                room = asyncio.ensure_future(writer.room())
                await asyncio.sleep(0)
                if not room.done():
                    held_back += 1
                    if held_back == 1:  # nobody reads until it has come to that
                        reader.start()
                    await room
        writer.say("end\n")
        writer.close()
        reader.join(30)
        assert held_back

    with piped() as pipe:
        asyncio.run(scene(pipe))
    lines = b"".join(read).splitlines()
    assert [int(line.split()[0]) for line in lines[:-1]] == list(range(count))


def test_an_output_that_is_gone_is_told_once_in_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    reading, writing = os.pipe()
    os.close(reading)

    async def scene() -> list[OSError]:
        told: list[OSError] = []
        came = asyncio.Event()

        def lost(fault: OSError) -> None:
            told.append(fault)
            came.set()

        writer = Writer(lost, missed)
        for _ in range(10):
            writer.say("a line\n")
        async with asyncio.timeout(30):
            await came.wait()
        writer.close()
        return told

    with os.fdopen(writing, "w") as output:
        monkeypatch.setattr(sys, "stdout", output)
        told = asyncio.run(scene())
        monkeypatch.undo()
    assert [type(one) for one in told] == [BrokenPipeError]


def test_a_replaced_output_is_written_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    async def scene() -> None:
        writer = Writer(lambda fault: pytest.fail(repr(fault)), missed)
        writer.say("a line\n")
        writer.close()

    asyncio.run(scene())
    assert capsys.readouterr().out == "a line\n"
