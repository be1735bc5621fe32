"""The feed's other end: finding the bus that is meant, and reading what is told of it.

Owns the search. Nothing is ever sent.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys
from pathlib import Path
from typing import Final

from sacbus.feed.lines import Hello, Line, decode
from sacbus.feed.places import default_directory, remove_stale, same_link, sockets
from sacbus.links.errors import LinkError

__all__ = ["Feed", "SeveralBuses", "find", "running"]

#: Seconds for a daemon to say hello; one that takes longer is stuck.
PATIENCE: Final = 3.0

#: The longest line that is read, in bytes: a transmission of 128 KiB, which nothing sends at once.
LONGEST: Final = 256 * 1024


class SeveralBuses(LinkError):
    """No link was named, and it cannot be told which of several buses is meant."""


class Feed:
    """An open feed: its hello, and then its lines. To be closed."""

    def __init__(
        self, hello: Hello, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self.hello = hello
        self._reader = reader
        self._writer = writer

    async def read(self) -> Line | None:
        """The next line, of those that this version knows; None when the daemon has ended.

        ValueError for what is no line of a feed.
        """
        with contextlib.suppress(ConnectionResetError):
            # Without its line end, it is what a daemon had written when it was killed.
            while (text := await self._reader.readline()).endswith(b"\n"):
                line = decode(text)
                if line is not None:
                    return line
        return None

    async def close(self) -> None:
        """Let go of it. May be called again."""
        self._writer.close()
        with contextlib.suppress(OSError):
            await self._writer.wait_closed()


async def find(link: str | None, directory: Path | None = None) -> Feed | None:
    """The feed of the bus that has ``link`` among its links; None when no such bus runs here.

    Without a link, the feed of the one bus that runs; LinkError when none does, SeveralBuses.
    """
    feeds = await running(directory)
    if link is None:
        chosen = feeds[0] if len(feeds) == 1 else None
    else:
        chosen = next((one for one in feeds if _has(one.hello, link)), None)
    for feed in feeds:
        if feed is not chosen:
            await feed.close()
    if chosen is None and link is None:
        raise _not_one([feed.hello for feed in feeds], directory)
    return chosen


async def running(directory: Path | None = None) -> list[Feed]:
    """The feeds of all buses that this user runs, to be closed. Remains of killed runs go."""
    if sys.platform == "win32":  # its Python has no unix sockets
        return []
    try:
        place = default_directory() if directory is None else directory
        remove_stale(place)
        paths = sockets(place)
    except OSError:  # a directory that is not to be trusted, or not to be read
        return []
    hails = [asyncio.create_task(_hail(path)) for path in paths]
    try:
        found = await asyncio.gather(*hails)
    except BaseException:
        for hail in hails:
            hail.cancel()
        for outcome in await asyncio.gather(*hails, return_exceptions=True):
            if isinstance(outcome, Feed):
                await outcome.close()
        raise
    return [feed for feed in found if feed is not None]


async def _hail(path: Path) -> Feed | None:
    """The feed at this socket, if somebody answers there in time, and understandably."""
    try:
        reader, writer = await asyncio.open_unix_connection(path, limit=LONGEST)
    except OSError:  # gone meanwhile, or not to be opened
        return None
    try:
        async with asyncio.timeout(PATIENCE):
            hello = decode(await reader.readline())
        if isinstance(hello, Hello):
            return Feed(hello, reader, writer)
    except (OSError, ValueError):  # TimeoutError is an OSError
        pass
    except BaseException:
        writer.close()
        raise
    writer.close()
    return None


def _has(hello: Hello, link: str) -> bool:
    return any(same_link(link, way) for way in hello.links)


def _not_one(buses: list[Hello], directory: Path | None) -> LinkError:
    if not buses:
        where = str(directory or default_directory())
        return LinkError("no bus of this user runs", where, "start one or give a LINK")
    names = [
        f"{one.bus} ({', '.join(way.where for way in one.links) or 'no links'})" for one in buses
    ]
    return SeveralBuses("several buses run", ", ".join(names), "give the LINK of one")
