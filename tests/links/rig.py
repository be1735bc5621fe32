"""The two ends of every kind of link, under one name, for the suite that all of them must pass."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from sacbus.links import Link, MemoryLink, Presence, PtyLink


class Client(Protocol):
    """A program that has the other end open; neither call ever waits."""

    def write(self, data: bytes) -> int:
        """Write what the line takes; how many bytes that was."""

    def read(self) -> bytes: ...

    def close(self) -> None: ...


class MemoryProgram:
    def __init__(self, link: MemoryLink) -> None:
        self._client = link.client()

    def write(self, data: bytes) -> int:
        self._client.write(data)
        return len(data)

    def read(self) -> bytes:
        return self._client.read()

    def close(self) -> None:
        self._client.close()


class PtyProgram:
    """Bare system calls: it sets nothing, flushes nothing, and so sees what the link left."""

    def __init__(self, path: str | Path) -> None:
        self.descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def write(self, data: bytes) -> int:
        try:
            return os.write(self.descriptor, data)
        except BlockingIOError:
            return 0

    def read(self) -> bytes:
        try:
            return os.read(self.descriptor, 65_536)
        except BlockingIOError:
            return b""

    def close(self) -> None:
        os.close(self.descriptor)


class NoPresence(Presence):
    """A system without inotify, as macOS, or one that has no more of it to give."""

    def watch(self, path: str, hint: Callable[[list[bool]], None]) -> int | None:
        return None


class Rig:
    """An open link, what it delivered, and programs that open its other end."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.heard = bytearray()
        self._programs: list[Client] = []

    @property
    def tells_absence(self) -> bool:
        """Without inotify a pty cannot know that nobody is there."""
        return not (isinstance(self.link, PtyLink) and isinstance(self.link._presence, NoPresence))

    def open(self) -> None:
        self.link.open(self.heard.extend)

    def client(self) -> Client:
        program: Client
        if isinstance(self.link, MemoryLink):
            program = MemoryProgram(self.link)
        else:
            program = PtyProgram(self.link.where)
        self._programs.append(program)
        return program

    async def client_is_known(self) -> Client:
        """A client that the link has noticed, so that what is sent from now on is for it."""
        known = self.link.counters.clients
        client = self.client()
        if self.tells_absence:
            await until(lambda: self.link.counters.clients > known)
        return client

    async def leave(self, client: Client) -> None:
        """Close a client, and wait until the link drops what is sent to it."""
        self._programs.remove(client)
        client.close()
        if self.tells_absence:
            await until(lambda: not self._takes_a_byte())

    def _takes_a_byte(self) -> bool:
        before = self.link.counters.bytes_out
        self.link.send(b"?")
        return self.link.counters.bytes_out > before

    def close(self) -> None:
        self.link.close()
        while self._programs:
            self._programs.pop().close()


BACKENDS = ("memory", "pty", "pty without inotify")
BACKENDS_THAT_TELL_ABSENCE = ("memory", "pty")


@contextmanager
def rig_of(backend: str) -> Iterator[Rig]:
    """An open rig; needs a running loop."""
    made: dict[str, Callable[[], Link]] = {
        "memory": MemoryLink,
        "pty": PtyLink,
        "pty without inotify": lambda: PtyLink(presence=NoPresence()),
    }
    rig = Rig(made[backend]())
    rig.open()
    try:
        yield rig
    finally:
        rig.close()


async def until(condition: Callable[[], object]) -> None:
    """Let the loop turn until the condition holds. The time-out exists only to fail."""
    async with asyncio.timeout(20):
        while not condition():  # noqa: ASYNC110 (what is waited for has no event to wait on)
            await asyncio.sleep(0)


class Ear:
    """Collects what a client reads, so that a condition can look at all of it."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self.heard = bytearray()

    def has(self, data: bytes) -> bool:
        self.heard += self._client.read()
        return self.heard == data

    def has_bytes(self, count: int) -> bool:
        self.heard += self._client.read()
        return len(self.heard) >= count
