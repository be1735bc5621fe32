"""The two ends of every kind of link, under one name, for the suite that all of them must pass.

A new kind of link is entered in one place: ``BACKENDS``, at the end.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Final, Literal

import pytest

from sacbus.links import Link, LinkCounters, MemoryLink, Presence, PtyLink
from sacbus.links.adapter import AdapterLink
from sacbus.links.link import Server
from sacbus.links.rfc2217 import Rfc2217Server
from sacbus.links.tcp import TcpServer
from tests.links.programs import Client, MemoryProgram, PtyProgram, TcpProgram, TelnetProgram
from tests.links.socat import Wire

__all__ = [
    "BACKENDS",
    "Backend",
    "Client",
    "Ear",
    "LinkRig",
    "NoPresence",
    "PtyProgram",
    "Rig",
    "ServerRig",
    "able_to",
    "rig_of",
    "until",
]

Capability = Literal[
    "stands alone",  # there is a link while no program has the other end open
    "tells absence",  # it knows when nobody is there, and then keeps nothing for whoever comes
    "tells leaving",  # it tells when a program has said its last word, while it lasts itself
    "counts unread",  # it knows what a program that left had not read, and counts it as dropped
    "has rate",  # a program can set its rate, and finds the bus's
    "serves many",  # each program gets a link of its own
    "hangs up",  # programs find the line dead once it is closed
]


class NoPresence(Presence):
    """A system without inotify, as macOS, or one that has no more of it to give."""

    def watch(self, path: str, hint: Callable[[list[bool]], None]) -> int | None:
        return None


class Rig(ABC):
    """The bus's end of a link, what it delivered, and programs that open the other end.

    ``program`` opens that end, given what a user would open.
    """

    def __init__(self, program: Callable[[str], Client], *, tells_absence: bool = True) -> None:
        self._program = program
        self.tells_absence = tells_absence
        self.heard = bytearray()
        #: Where the bus's side hears what programs say.
        self.deliver: Callable[[bytes], object] = self.heard.extend
        self._programs: list[Client] = []

    @property
    @abstractmethod
    def link(self) -> Link:
        """The link of the program that came last."""

    @property
    @abstractmethod
    def counters(self) -> LinkCounters:
        """Of all programs so far."""

    @property
    @abstractmethod
    def where(self) -> str:
        """What a program opens."""

    @abstractmethod
    async def start(self) -> None:
        """Let programs in."""

    @abstractmethod
    def shut(self) -> None:
        """Close the bus's end."""

    def client(self) -> Client:
        """A program that has the other end open."""
        program = self._program(self.where)
        self._programs.append(program)
        return program

    async def client_is_known(self) -> Client:
        """A client that the link has noticed, so that what is sent from now on is for it."""
        known = self.counters.clients
        client = self.client()
        if self.tells_absence:
            await until(lambda: self.counters.clients > known)
        return client

    def forget(self, client: Client) -> None:
        """Close a client, and do not wait for anything."""
        self._programs.remove(client)
        client.close()

    async def leave(self, client: Client) -> None:
        """Close a client, and wait until the link drops what is sent to it."""
        self.forget(client)
        if self.tells_absence:
            await until(lambda: not self._takes_a_byte())

    def _takes_a_byte(self) -> bool:
        before = self.link.counters.bytes_out
        self.link.send(b"?")
        return self.link.counters.bytes_out > before

    def hear(self, data: bytes) -> None:
        """The bus's side: bytes have come."""
        self.deliver(data)

    def close(self) -> None:
        self.shut()
        while self._programs:
            self._programs.pop().close()


class LinkRig(Rig):
    """A link for one program at a time, by default one that opens a serial port by its path."""

    def __init__(
        self,
        link: Link,
        program: Callable[[str], Client] = PtyProgram,
        *,
        tells_absence: bool = True,
    ) -> None:
        super().__init__(program, tells_absence=tells_absence)
        self._link = link

    @property
    def link(self) -> Link:
        return self._link

    @property
    def counters(self) -> LinkCounters:
        return self._link.counters

    @property
    def where(self) -> str:
        return self._link.where

    def open(self) -> None:
        self._link.open(self.hear)

    async def start(self) -> None:
        self.open()

    def shut(self) -> None:
        self._link.close()


class ServerRig(Rig):
    """A server, and the links of the programs that have come, in that order."""

    def __init__(self, server: Server, program: Callable[[str], Client]) -> None:
        super().__init__(program)
        self.server = server
        self.links: list[Link] = []
        #: Those whose leaving has been told.
        self.gone: list[Link] = []

    @property
    def link(self) -> Link:
        return self.links[-1]

    @property
    def counters(self) -> LinkCounters:
        return self.server.counters

    @property
    def where(self) -> str:
        return self.server.where

    async def start(self) -> None:
        await self.server.open(self.admit)

    def admit(self, link: Link) -> Callable[[], None]:
        self.links.append(link)
        link.open(self.hear)
        return lambda: self.gone.append(link)

    def shut(self) -> None:
        self.server.close()


class AdapterRig(LinkRig):
    """An adapter, and programs on the line behind it, which is there before and after them."""

    def __init__(self) -> None:
        self._wire = Wire()
        self._wire.plug()
        link = AdapterLink(self._wire.near, 38_400, tell=lambda _text: None)
        super().__init__(link, tells_absence=False)

    @property
    def where(self) -> str:
        return self._wire.far

    def close(self) -> None:
        super().close()
        self._wire.close()


@dataclass(frozen=True, slots=True)
class Backend:
    """A kind of link as the suite meets it: how it is set up, and what not all kinds can do."""

    rig: Callable[[], Rig]
    can: frozenset[Capability]


def backend(rig: Callable[[], Rig], *can: Capability) -> Backend:
    return Backend(rig, frozenset(can))


def _memory() -> Rig:
    link = MemoryLink()
    return LinkRig(link, lambda _where: MemoryProgram(link))


def _pty_without_inotify() -> Rig:
    return LinkRig(PtyLink(presence=NoPresence()), tells_absence=False)


#: Every kind of link there is. The suite runs on all of them, and on those that can do what a test
#: is about where not all can.
BACKENDS: Final[dict[str, Backend]] = {
    "memory": backend(
        _memory,
        "stands alone",
        "tells absence",
        "tells leaving",
        "counts unread",
        "has rate",
        "hangs up",
    ),
    "pty": backend(
        lambda: LinkRig(PtyLink()),
        "stands alone",
        "tells absence",
        "tells leaving",
        "counts unread",
        "has rate",
        "hangs up",
    ),
    "pty without inotify": backend(_pty_without_inotify, "stands alone", "has rate", "hangs up"),
    "tcp": backend(
        lambda: ServerRig(TcpServer(), TcpProgram),
        "tells absence",
        "tells leaving",
        "serves many",
        "hangs up",
    ),
    "rfc2217": backend(
        lambda: ServerRig(Rfc2217Server(), TelnetProgram),
        "tells absence",
        "tells leaving",
        "has rate",
        "serves many",
        "hangs up",
    ),
    # What is on a real line is there with or without us, at a rate that nobody tells.
    "adapter": backend(AdapterRig, "stands alone"),
}


def able_to(*needed: Capability) -> pytest.MarkDecorator:
    """Run a test on those kinds of link alone that can do all of that."""
    able = [name for name, backend in BACKENDS.items() if backend.can.issuperset(needed)]
    return pytest.mark.parametrize("rig", able, indirect=True)


@asynccontextmanager
async def rig_of(name: str) -> AsyncIterator[Rig]:
    """The rig of a backend, open."""
    rig = BACKENDS[name].rig()
    try:
        await rig.start()
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
