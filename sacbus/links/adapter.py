"""A real RS485 adapter as a link: what hangs on its line, and the bus, are one line.

Owns the adapter's life: opened once for certain, then lost and found again for as long as the link
is open; each loss and each return is told in one line. What is sent while it is away is dropped and
counted, and nothing from before is heard after it.

Theory of operation. The system hangs up on whoever has a device open that is pulled out, and that
ends the connection at the loop's next turn; nothing polls. From then on the path is tried after
`FIRST_RETRY` seconds, and after twice as many each time up to `LAST_RETRY`, and at once whenever
inotify tells of something new there (arrival.py). A port that is lost again sooner than it was
waited for goes on from there, so that a broken one does not fill the log.

An adapter switches its direction itself, or has the kernel do it (RS485 mode), or RTS is moved by
hand (direction.py). One that hears what it says has that taken out (echo.py).
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from .arrival import Arrival
from .direction import HandDirection
from .echo import Echo
from .errors import LinkError
from .hardware import FramingErrors, hasten, kernel_direction, set_rts
from .link import LinkCounters
from .serialport import FAULTS, SerialConnection, unopened

__all__ = ["FIRST_RETRY", "LAST_RETRY", "AdapterLink"]

#: Seconds until an adapter that is gone is tried again: first, and at the most.
FIRST_RETRY: Final = 0.1
LAST_RETRY: Final = 2.0

#: Seconds between two lines that tell of collisions; one packet in a row of them says it all.
QUIET: Final = 10.0

#: Packets in a row without an echo, after which there seems to be none.
DEAF: Final = 3

_BITS: Final = 10  # of a byte: start, eight, stop
_SECOND: Final = 1_000_000_000  # ns
_ROUNDING: Final = 1_000  # ns that a timer may be early


class AdapterLink:
    """The serial port ``path`` at ``baud``, 8N1, for oneself alone.

    ``rts``: RTS switches the adapter's direction, high to send. ``echo``: the adapter hears what it
    says. ``tell`` is given a line for people at each loss, return, and row of collisions.
    """

    kind: Final = "adapter"

    def __init__(
        self,
        path: str,
        baud: int,
        *,
        rts: bool = False,
        echo: bool = False,
        tell: Callable[[str], object],
    ) -> None:
        self.where: Final = path
        self._baud = baud
        self._rts = rts
        self._tell = tell
        self._counters = LinkCounters()
        self._echo = Echo(_BITS * _SECOND // baud) if echo else None
        self._deliver: Callable[[bytes], None] | None = None
        self._held = False
        self._connection: SerialConnection | None = None
        self._direction: HandDirection | None = None
        self._framing: FramingErrors | None = None
        self._arrival: Arrival | None = None
        self._delay = FIRST_RETRY
        self._turned = 0.0  # when the adapter was last lost or found
        self._retry: asyncio.TimerHandle | None = None
        self._settling: asyncio.TimerHandle | None = None
        self._told = 0  # collisions
        self._quiet: asyncio.TimerHandle | None = None
        #: As TellingLink.left: what is on its line cannot be heard any more.
        self.left: Callable[[], object] | None = None

    @property
    def counters(self) -> LinkCounters:
        self._count_framing_errors()
        return self._counters

    @property
    def collisions(self) -> int:
        """Own bytes that came back changed; with ``echo`` only."""
        return 0 if self._echo is None else self._echo.collisions

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """Open the port. Needs a running event loop; otherwise as Link.open.

        LinkError, too, for a port without RTS when RTS is to switch the direction.
        """
        if self._deliver is not None:
            raise LinkError("the link is open already", self.where, "close it first")
        self._loop = asyncio.get_running_loop()
        self._connect()
        self._deliver = deliver
        self._turned = self._loop.time()

    def send(self, data: bytes) -> None:
        taken = 0
        if self._connection is not None and data:
            if self._direction is not None:
                self._direction.begin()
            taken = self._connection.send(data)
            if self._direction is not None:
                self._direction.sent(taken)
            if self._echo is not None:
                self._echo.sent(data[:taken], self._now())
                self._mind_echo(self._echo)
        self._counters.bytes_out += taken
        self._counters.dropped_out += len(data) - taken

    def hold(self, *, held: bool) -> None:
        """As Link.hold. On a real line nobody waits: what the system cannot keep is lost."""
        self._held = held and self._deliver is not None
        if self._connection is not None:
            self._connection.hold(held=held)

    def client_baud(self) -> None:
        """Nobody tells at which rate the others on a real line talk."""

    def close(self) -> None:
        if self._deliver is None:
            return
        self._deliver = None
        self._held = False
        self._look_no_more()
        if self._connection is not None:
            self._leave(self._connection)

    def _connect(self) -> None:
        """Open the port and have it do what it can; LinkError if it does not do what it must."""
        connection = SerialConnection(
            self.where, self._baud, self._heard, self._lost, rts=not self._rts
        )
        try:
            hasten(connection.port)
            direction = self._hand_direction(connection) if self._rts else None
        except BaseException as fault:
            connection.close()
            if isinstance(fault, FAULTS) and not isinstance(fault, LinkError):
                raise unopened(self.where, fault) from fault
            raise
        self._connection, self._direction = connection, direction
        self._framing = FramingErrors(connection.port)
        if self._held:
            connection.hold(held=True)

    def _hand_direction(self, connection: SerialConnection) -> HandDirection | None:
        """RTS to be moved by hand; None where the kernel does it. LinkError where there is none."""
        port = connection.port
        if kernel_direction(port, echo=self._echo is not None):
            return None
        if not set_rts(port, high=False):
            raise LinkError(
                "the port has no RTS", self.where, "leave rts out, or use an adapter that has it"
            )
        return HandDirection(
            self._loop,
            _BITS / self._baud,
            lambda level: set_rts(port, high=bool(level)),
            lambda: connection.unsent,
        )

    def _leave(self, connection: SerialConnection) -> None:
        """End everything that was about this connection; it may be gone already."""
        self._count_framing_errors()
        self._connection = self._framing = None
        direction, self._direction = self._direction, None
        if direction is not None:
            direction.end()
        self._counters.dropped_out += connection.close() + connection.lost_unwritten
        for timer in (self._settling, self._quiet):
            if timer is not None:
                timer.cancel()
        self._settling = self._quiet = None
        if self._echo is not None:
            self._hand_on(self._echo.forget())

    def _heard(self, data: bytes) -> None:
        if self._echo is not None:
            data = self._echo.heard(data)
            self._tell_of_echo(self._echo)
        self._hand_on(data)

    def _hand_on(self, data: bytes) -> None:
        if data and self._deliver is not None:
            self._counters.bytes_in += len(data)
            self._deliver(data)

    def _lost(self, why: str) -> None:
        assert self._connection is not None  # it has just told so itself
        self._leave(self._connection)
        now = self._loop.time()
        if now - self._turned > self._delay:
            self._delay = FIRST_RETRY
        self._turned = now
        self._tell(f"adapter {self.where} is gone ({why}); trying to reach it again")
        if self.left is not None:
            self.left()
        if self._deliver is not None:  # unless that has been the end
            self._arrival = Arrival(self.where, self._found)
            self._retry = self._loop.call_later(self._delay, self._try_again)

    def _try_again(self) -> None:
        self._delay = min(2 * self._delay, LAST_RETRY)
        self._retry = self._loop.call_later(self._delay, self._try_again)
        self._found()

    def _found(self) -> None:
        """The adapter may be there again."""
        try:
            self._connect()
        except LinkError:
            return
        self._look_no_more()
        away = self._loop.time() - self._turned
        self._turned += away
        self._counters.reconnects += 1
        self._tell(f"adapter {self.where} is back after {away:.1f} s")

    def _look_no_more(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
        if self._arrival is not None:
            self._arrival.close()
        self._retry = self._arrival = None

    def _count_framing_errors(self) -> None:
        if self._framing is not None:
            self._counters.framing_errors += self._framing.fresh()

    def _now(self) -> int:
        return int(self._loop.time() * _SECOND)

    def _mind_echo(self, echo: Echo) -> None:
        """See to it that an echo that does not come is given up."""
        if self._settling is None and echo.due is not None:
            self._settling = self._loop.call_at(echo.due / _SECOND, self._settle, echo)

    def _settle(self, echo: Echo) -> None:
        self._settling = None
        foreign = echo.settle(self._now() + _ROUNDING)
        self._mind_echo(echo)
        self._tell_of_echo(echo)
        self._hand_on(foreign)

    def _tell_of_echo(self, echo: Echo) -> None:
        """Tell of collisions, and of an adapter that has no echo; neither again and again."""
        if self._quiet is None and (echo.collisions > self._told or echo.unheard >= DEAF):
            self._quiet = self._loop.call_later(QUIET, self._be_heard_again, echo)
            if echo.collisions > self._told:
                what = "came back changed, somebody else was talking"
                count = echo.collisions - self._told
                self._tell(f"adapter {self.where}: {count} of its own bytes {what}")
            else:
                what = "does not hear what it says, as echo expects; leave echo out"
                self._tell(f"adapter {self.where} {what}")
            self._told = echo.collisions

    def _be_heard_again(self, echo: Echo) -> None:
        self._quiet = None
        if echo.collisions > self._told:
            self._tell_of_echo(echo)
