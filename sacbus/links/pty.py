"""A pseudo-terminal as the bus's serial port: the link that any program on the machine can open.

Theory of operation. The bus holds the master's end and, while it can, *no* slave end of its own.
Then the kernel itself knows whether a client is there: reading the master fails with EIO exactly
while nobody has the slave open, after the last byte of whoever left. inotify (presence.py) says
when to look again, so nothing here counts opens and closes to know who is there, and nothing polls.
Two alternatives were refused: holding a slave end hides the clients' coming and going, and counting
inotify's events goes wrong for ever once two of them are merged.

    nobody there   the master is not in the event loop (it would be ready, hung up, all the time);
                   output is dropped; a hint makes us read once
    client there   the master is in the event loop; output goes to the slave's buffer

When the last client leaves, the line is as on the first day: raw, at the bus's rate, nothing left
to read, no exclusive lock. Linux keeps all of these with the pty while its master lives.

Without inotify (macOS, or a user's allowance used up) the bus holds a slave end and takes a client
to be there always; then what nobody reads waits in the system's buffer until that is full.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
from collections.abc import Callable
from pathlib import Path
from typing import Final

from .errors import LinkError
from .link import LinkCounters
from .presence import Presence

try:
    from .pair import PtyPair
    from .symlink import Symlink
except ImportError:  # fcntl and termios, on Windows
    _HERE = False
else:
    _HERE = True

__all__ = ["PtyLink"]


class PtyLink:
    """A raw pty, behind a stable symlink if a path is given.

    `baud` is the bus's rate, which the line is set to when no client has set another. `presence`
    may be shared between links of one event loop; by default each link has its own. LinkError where
    the system has no ptys, as Windows has none.
    """

    kind: Final = "pty"

    def __init__(
        self,
        path: str | Path | None = None,
        *,
        baud: int = 38_400,
        presence: Presence | None = None,
    ) -> None:
        if not _HERE:
            raise LinkError(
                "this system has no ptys", str(path or "pty"), "use TCP or RFC 2217 in its place"
            )
        self.counters = LinkCounters()
        self._baud = baud
        self._presence = Presence() if presence is None else presence
        self._symlink = None if path is None else Symlink(path)
        self._pair: PtyPair | None = None
        self._deliver: Callable[[bytes], None] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._watch: int | None = None
        self._present = False
        self._opens = 0  # clients that have it open, as far as hints can tell
        self._sent = False  # whether the present clients may have something unread
        self._held = False
        #: As TellingLink.left; not where the system does not tell who is there.
        self.left: Callable[[], object] | None = None

    @property
    def where(self) -> str:
        """The symlink, or else the slave's own path; empty before `open` without a symlink."""
        if self._symlink is not None:
            return str(self._symlink.path)
        return "" if self._pair is None else self._pair.path

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """Make the pty and let clients in. Needs a running event loop; otherwise as Link.open.

        Raises ValueError, too, for a rate that the system cannot set.
        """
        if self._pair is not None:
            raise LinkError("the link is open already", self.where, "close it first")
        self._loop = asyncio.get_running_loop()
        pair = PtyPair(self._baud)
        try:
            if self._symlink is not None:
                self._symlink.claim(pair.path)
        except BaseException:
            pair.close()
            raise
        self._deliver = deliver
        self._begin(pair)

    def send(self, data: bytes) -> None:
        taken = 0
        if self._present and self._pair is not None:
            taken = self._pair.write(data)
            self._sent = True
        self.counters.bytes_out += taken
        self.counters.dropped_out += len(data) - taken

    def hold(self, *, held: bool) -> None:
        """As Link.hold. A client that leaves meanwhile is noticed when the link goes on."""
        if held == self._held or self._pair is None:
            return
        self._held = held
        if self._present and self._loop is not None:
            if held:
                self._loop.remove_reader(self._pair.master)
            else:
                self._loop.add_reader(self._pair.master, self._readable)

    def client_baud(self) -> int:
        """The rate the client has set; the bus's own before and after. Costs 1 µs."""
        return self._baud if self._pair is None else self._pair.baud()

    def close(self) -> None:
        if self._pair is None:
            return
        pair, self._pair, self._deliver = self._pair, None, None
        self._held = False
        if self._present and self._sent:
            with contextlib.suppress(OSError):  # exclusive to a client: lost uncounted
                self.counters.dropped_out += pair.drain()
        self._end(pair)
        if self._symlink is not None:
            self._symlink.release()

    def _begin(self, pair: PtyPair) -> None:
        self._pair = pair
        self._watch = self._presence.watch(pair.path, self._hinted)
        if self._watch is None:
            self._arrived(pair)
        else:
            pair.let_go()
            self._look(pair)

    def _end(self, pair: PtyPair) -> None:
        self._gone(pair)
        if self._watch is not None:
            self._presence.forget(self._watch)
            self._watch = None
        pair.close()

    def _look(self, pair: PtyPair) -> None:
        """Ask whether somebody has come; what came and has gone again may have left bytes."""
        data = pair.read()
        if data is None:
            return
        self.counters.clients += self._opens == 0  # one that came while no hints were given
        self._opens = max(self._opens, 1)
        self._arrived(pair)
        self._hand_on(data)

    def _arrived(self, pair: PtyPair) -> None:
        self._present, self._sent = True, False
        assert self._loop is not None  # open has found it
        if not self._held:
            self._loop.add_reader(pair.master, self._readable)

    def _gone(self, pair: PtyPair) -> None:
        if self._present and self._loop is not None:
            self._loop.remove_reader(pair.master)
        self._present, self._opens = False, 0

    def _hinted(self, events: list[bool]) -> None:
        """Somebody has come or gone since the last hint; only the pty knows who is left."""
        if self._pair is None:
            return
        emptied = False
        for opened in events:
            self.counters.clients += opened
            self._opens = self._opens + 1 if opened else max(self._opens - 1, 0)
            emptied |= self._opens == 0
        if not self._present:
            self._look(self._pair)
        elif emptied and self._opens:
            self._changed_hands(self._pair)

    def _changed_hands(self, pair: PtyPair) -> None:
        """One client has left and another come between two looks, so the line never was hung up.

        What the first left unread must not reach the second. The settings are the second's by now.
        """
        if self._sent:
            with self._presence.unseen(pair.path), contextlib.suppress(OSError):
                self.counters.dropped_out += pair.drain()  # unless exclusive to the second
            self._sent = False
        self._tell_left()

    def _readable(self) -> None:
        # First the hints: what a new client writes must be heard after the old one's leaving.
        self._presence.attend()
        if self._pair is None or not self._present:
            return
        data = self._pair.read()
        if data is None:
            self._everybody_left(self._pair)
        elif data:
            self._hand_on(data)

    def _hand_on(self, data: bytes) -> None:
        if data and self._deliver is not None:
            self.counters.bytes_in += len(data)
            self._deliver(data)

    def _everybody_left(self, pair: PtyPair) -> None:
        self._gone(pair)
        self._tell_left()
        try:
            with self._presence.unseen(pair.path):
                self.counters.dropped_out += pair.reset()
        except OSError as error:
            if error.errno != errno.EBUSY:
                raise
            self._replace(pair)
        else:
            self._look(pair)  # who came meanwhile was not hinted

    def _tell_left(self) -> None:
        if self.left is not None:
            self.left()

    def _replace(self, pair: PtyPair) -> None:
        """Go on with a new pty, since a client was killed and has left this one exclusive for good.

        Without a symlink `where` stays right all the same in general: the system hands out the
        lowest number that is free, so the old pty goes first.
        """
        self._end(pair)
        self._pair = None
        fresh = PtyPair(self._baud)
        if self._symlink is not None:
            self._symlink.point(fresh.path)
        self._begin(fresh)
