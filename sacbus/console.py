"""A node's terminal in the hands of who hosts it: keys in, what is shown out, at bus time.

Owns who sees what a terminal port shows, and how the keys of a link come to it. What keys mean is
the node's affair, what a link is made of the link's.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from functools import partial
from typing import Final

from sacbus.bus import Bus
from sacbus.host import Host
from sacbus.links import Link
from sacbus.node import Node, Terminal

__all__ = ["KEPT", "WAITING", "Console"]

#: Characters shown and not read that a console keeps; older ones are lost, as from a screen.
KEPT: Final = 65_536

#: Keys of a link that wait for their time; with more its program is held, as at a full UART.
WAITING: Final = 4_096

#: What a node may act upon comes to it on time: a line's end, or a key that needs none.
_PIECE: Final = re.compile(rb"[^\r\n+-]*[\r\n+-]?")


class Console:
    """One node's terminal, for programs that host its bus, in virtual time as in real time.

    ::

        console = bus.terminal(10)
        console.command("q")        # what the node shows upon "q" and CR
        console.type("+")           # keys as they are
        console.read()              # what it has shown since

    Keys are there at once, at no distance from the port; what the node shows upon them can be read
    as soon as :meth:`type` comes back, unless that was called from within an event of the bus.
    """

    def __init__(self, node: Node, terminal: Terminal, bus: Bus, host: Host) -> None:
        self._node = node
        self._terminal = terminal
        self._bus = bus
        self._host = host
        self._watchers: list[Callable[[bytes], object]] = []
        self._shown = bytearray()
        self._news = asyncio.Event()
        self._listens = False

    def listen(self) -> None:
        """Keep what is shown from now on, for :meth:`read`. May be called again."""
        if not self._listens:
            self._listens = True
            self.watch(self._keep)

    def type(self, keys: str | bytes) -> None:
        """Press keys, one after the other at one instant; CR ends a line."""
        data = keys.encode("latin-1") if isinstance(keys, str) else keys
        kernel = self._host.kernel
        if kernel.running:
            kernel.at(kernel.now, self.press, data)
        else:
            self._host.arrive(self.press, data)

    def read(self) -> str:
        """What has been shown since it was last read: the last :data:`KEPT` characters of it."""
        text = self._shown.decode("latin-1")
        self._shown.clear()
        return text

    def command(self, line: str) -> str:
        """Type a line and CR; what is shown upon it at once. What was not read before is lost."""
        self._shown.clear()
        self.type(f"{line}\r")
        return self.read()

    async def until(self, text: str) -> str:
        """Wait until ``text`` has been shown; all that was, up to its end, which counts as read."""
        wanted = text.encode("latin-1")
        while (at := self._shown.find(wanted)) < 0:
            self._news.clear()
            await self._news.wait()
        end = at + len(wanted)
        shown = self._shown[:end].decode("latin-1")
        del self._shown[:end]
        return shown

    def press(self, keys: bytes) -> None:
        """Keys arrive, now by bus time, which must be up to date: ``host.arrive`` sees to that."""
        self._terminal.type(keys, self._host.kernel.now)
        self._bus.touch(self._node)

    def watch(self, show: Callable[[bytes], object]) -> None:
        """Have ``show`` called with all that is shown from now on, as it is."""
        self._watchers.append(show)
        self._terminal.show = self._show

    def open(self, link: Link) -> None:
        """Open a link for a program: its keys come here, it sees what is shown. LinkError as there.

        Keys take the time that they have on a serial line of the bus's rate, so that no program
        can write faster than the bus has time for.
        """
        keys = _Keys(link, self._bus, self._host, self.press)
        link.open(partial(self._host.arrive, keys.come))
        self.watch(link.send)

    def _show(self, data: bytes) -> None:
        for show in tuple(self._watchers):
            show(data)

    def _keep(self, data: bytes) -> None:
        self._shown += data
        if len(self._shown) > KEPT:
            del self._shown[:-KEPT]
        self._news.set()


class _Keys:
    """Keys on their way from a link to a port, as on a serial line."""

    def __init__(self, link: Link, bus: Bus, host: Host, press: Callable[[bytes], None]) -> None:
        self._link = link
        self._kernel = host.kernel
        self._rate = bus.rate
        self._press = press
        self._waiting = bytearray()
        self._on_its_way = b""

    def come(self, keys: bytes) -> None:
        """A program has written keys."""
        self._waiting += keys
        if len(self._waiting) > WAITING:
            self._link.hold(held=True)
        if not self._on_its_way:
            self._send()

    def _send(self) -> None:
        match = _PIECE.match(self._waiting)
        assert match is not None  # it matches nothing, too
        piece = bytes(match[0])
        del self._waiting[: len(piece)]
        self._on_its_way = piece
        if piece:
            self._kernel.at(self._kernel.now + self._rate.span(len(piece)), self._arrive)

    def _arrive(self) -> None:
        self._press(self._on_its_way)
        self._send()
        if len(self._waiting) <= WAITING // 2:
            self._link.hold(held=False)
