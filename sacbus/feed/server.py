"""The daemon's side of the feed: a unix socket for each bus, and those who look on.

Owns who is connected, what they have been told, and the bound on what waits for a slow one. While
nobody is connected the bus does not know of it: no watcher, no timer.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import sys
import time
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Final
from typing import Protocol as Contract

from sacbus import __version__
from sacbus.bus import Bus, FaultOn, LivePort, Port, Transmission
from sacbus.feed.lines import Hello, Line, Missed, Reached, Sent, Stopped, Way, encode
from sacbus.feed.places import SUFFIX, private_directory, remove_stale
from sacbus.host import Host
from sacbus.links.link import Link, Server
from sacbus.node import Report, ReportKind

__all__ = ["Fed", "FeedServer", "sent_line"]

#: Bytes that wait for one reader at most, beside what the socket holds: some 1 000 lines. Who is
#: that far behind misses lines, and is told how many.
WAITING: Final = 256 * 1024

#: Lines are handed on once a turn of the event loop, or when this many bytes of them have come up.
BATCH: Final = 64 * 1024

#: Seconds after which those who look on learn how far bus time has come: after something happened
#: (so that they know that no answer came), and while nothing does.
BEAT: Final = 0.1
QUIET_BEATS: Final = 10

#: Distinguishes the feeds of one process.
_numbers: Final = count(1)


class _OfKind(Contract):
    @property
    def kind(self) -> str: ...


class _Configured(Contract):
    @property
    def speed(self) -> float: ...

    @property
    def every_node(self) -> Sequence[_OfKind]: ...


class Fed(Contract):
    """What the feed must know of a bus that runs; a ``HostedBus`` is one."""

    @property
    def bus(self) -> Bus: ...

    @property
    def host(self) -> Host: ...

    @property
    def links(self) -> Sequence[Link | Server]: ...

    @property
    def configuration(self) -> _Configured: ...


class FeedServer:
    """The feed of one bus. ``directory``: where its socket lies; the user's runtime directory."""

    def __init__(self, bus: Fed, directory: Path | None = None) -> None:
        self._hosted = bus
        self._directory = directory
        self._server: asyncio.Server | None = None
        self._path: Path | None = None
        self._clients: list[_Client] = []
        self._lines: list[bytes] = []
        self._waiting = 0
        self._beat: asyncio.TimerHandle | None = None
        self._flush_due = False
        #: Beats since something was told, and since the time was.
        self._told = False
        self._quiet = 0

    @property
    def where(self) -> Path | None:
        """The socket's path while the feed is open."""
        return self._path

    async def open(self) -> bool:
        """Listen. A bus does without a feed that cannot be had: that is reported on it, and False.

        Remains of runs that were killed are removed on the way.
        """
        if sys.platform == "win32":  # its Python has no unix sockets
            return False
        try:
            directory = private_directory(self._directory)
            remove_stale(directory)
            await self._listen(directory)
        except OSError as fault:
            where = fault.filename or self._directory or "the user's runtime directory"
            self._hosted.bus.tell(
                Report(
                    self._hosted.bus.kernel.now,
                    None,
                    ReportKind.WARNING,
                    f"no feed for sacbus monitor ({fault.strerror or fault}), {where}, "
                    "set XDG_RUNTIME_DIR to a directory of yours",
                )
            )
            return False
        return True

    async def _listen(self, directory: Path) -> None:
        path = directory / f"{os.getpid()}-{next(_numbers)}{SUFFIX}"
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        # It gets its name when it listens: until then it would refuse, as only a stale one does.
        fresh = path.with_suffix(".new")
        try:
            fresh.unlink(missing_ok=True)
            listener.bind(os.fspath(fresh))
            fresh.chmod(0o600)
            listener.listen()
            listener.settimeout(0)
            fresh.replace(path)
            loop = asyncio.get_running_loop()
            self._server = await loop.create_unix_server(lambda: _Client(self), sock=listener)
        except BaseException:
            listener.close()
            fresh.unlink(missing_ok=True)
            path.unlink(missing_ok=True)
            raise
        self._path = path

    def close(self) -> None:
        """Tell everybody that the bus has stopped, and go. May be called again."""
        if self._server is None or self._path is None:
            return
        self._server.close()
        self._server = None
        # What is not ours any more is left alone: somebody may have cleared the directory.
        with contextlib.suppress(OSError):
            self._path.unlink()
        self._path = None
        self._say(Stopped())
        self._flush()
        for client in list(self._clients):
            self.left(client)
            client.end()

    def joined(self, client: _Client) -> None:
        """Somebody has connected: say what the bus is, and go on with what happens from now on."""
        if self._server is None:
            client.end()
            return
        self._flush()
        self._hosted.host.arrive(_nothing)
        client.take([encode(self._hello(), self._hosted.bus.name)])
        self._clients.append(client)
        if len(self._clients) == 1:
            self._hosted.bus.medium.watchers.append(self._sent)
            self._hosted.bus.report_watchers.append(self._say)
            self._beat = asyncio.get_running_loop().call_later(BEAT, self._tick)

    def left(self, client: _Client) -> None:
        """Somebody has gone; who was never told of is no matter."""
        if client not in self._clients:
            return
        self._clients.remove(client)
        if not self._clients:
            self._hosted.bus.medium.watchers.remove(self._sent)
            self._hosted.bus.report_watchers.remove(self._say)
            self._lines.clear()
            self._waiting = 0
            if self._beat is not None:
                self._beat.cancel()
                self._beat = None

    def _hello(self) -> Hello:
        hosted = self._hosted
        bus = hosted.bus
        # Not by their snapshots: looking on must not make the line late.
        nodes = zip(bus.nodes, hosted.configuration.every_node, strict=True)
        return Hello(
            __version__,
            bus.name,
            bus.protocol.name,
            bus.rate.baud,
            bus.rate.bits,
            bus.medium.lanes,
            hosted.configuration.speed,
            tuple((node.address, place.kind) for node, place in nodes),
            tuple(_way(link) for link in hosted.links),
            bus.kernel.now,
            time.time_ns(),
        )

    def _sent(self, sent: Transmission) -> None:
        self._say(sent_line(sent, self._hosted.bus))

    def _say(self, line: Line) -> None:
        """Have a line told to everybody, at the end of this turn of the event loop."""
        self._told = True
        text = encode(line, self._hosted.bus.name)
        self._lines.append(text)
        self._waiting += len(text)
        if self._waiting >= BATCH:
            self._flush()
        elif not self._flush_due:
            self._flush_due = True
            asyncio.get_running_loop().call_soon(self._flush)

    def _flush(self) -> None:
        self._flush_due = False
        lines, self._lines, self._waiting = self._lines, [], 0
        if lines:
            for client in self._clients:
                client.take(lines)

    def _tick(self) -> None:
        self._beat = asyncio.get_running_loop().call_later(BEAT, self._tick)
        self._quiet += 1
        self._hosted.host.arrive(_nothing)
        if self._told or self._quiet >= QUIET_BEATS:
            self._say(Reached(self._hosted.bus.kernel.now, time.time_ns()))
            self._told = False
            self._quiet = 0


class _Client(asyncio.Protocol):
    """Somebody who looks on. What they send is not heard."""

    def __init__(self, feed: FeedServer) -> None:
        self._feed = feed
        self._transport: asyncio.Transport | None = None
        self._missed = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """asyncio's: they have connected."""
        assert isinstance(transport, asyncio.Transport)  # a unix socket's is one
        self._transport = transport
        self._feed.joined(self)

    def eof_received(self) -> bool:
        """asyncio's: they will send nothing, as nobody need; they may listen on."""
        return True

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 (asyncio's)
        """asyncio's: they have left."""
        self._transport = None
        self._feed.left(self)

    def take(self, lines: Sequence[bytes]) -> None:
        """Hand lines on, or count them as missed; never waits."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if transport.get_write_buffer_size() > WAITING:
            self._missed += len(lines)
            return
        if self._missed:
            transport.write(encode(Missed(self._missed), ""))
            self._missed = 0
        transport.write(b"".join(lines))

    def end(self) -> None:
        """Let them go: who has read all so far gets the end as well, others are not waited for."""
        if self._transport is None:
            return
        if self._transport.get_write_buffer_size():
            self._transport.abort()
        else:
            self._transport.close()


def sent_line(sent: Transmission, bus: Bus) -> Sent:
    """What is told of a transmission on this bus that is over."""
    seed = bus.medium.seed
    sender, node = _sender(sent.sender, bus)
    return Sent(
        sent.start,
        sent.end,
        sent.lane,
        sender,
        node,
        sent.outcome(seed),
        tuple(sent.hits or ()),
        sent.outcome_ninth(seed),
        sent.faults,
        sent.data if sent.faults else None,
    )


def _sender(sender: object, bus: Bus) -> tuple[str, int | None]:
    """In words, and the address if it is a node."""
    if isinstance(sender, Port | LivePort | FaultOn):
        return sender.name, None
    for node in bus.nodes:
        if node is sender:
            return f"node {node.address}", node.address
    return "somebody", None


def _way(link: Link | Server) -> Way:
    where = link.where
    return Way(link.kind, where, None if "://" in where else os.path.realpath(where))


def _nothing() -> None:
    """Only to bring bus time up to date."""
