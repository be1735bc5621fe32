"""A port: the place where outside bytes get on the line, and its bytes get out.

Owns the pacing of a link's bytes: a program writes whenever it likes, the line takes 260 µs a byte
and one talker at a time. A port also is how mother sits on a virtual bus.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.bus.medium import Medium
from sacbus.kernel import MS, Ns
from sacbus.node import Heard

__all__ = ["FULL", "LATENCY", "Port"]

#: A paced link starts to send no earlier than this after the line went idle, as a USB adapter's
#: round trip makes it; so a quick client does not fall into a node's deaf time.
LATENCY: Final[Ns] = 1 * MS

#: What a port sends in one transmission at most; a run of several goes out without a pause. It
#: bounds how long a listener waits for the first byte of a stream that holds no frame.
CHUNK: Final = 4_096


#: Bytes that wait for the line, beyond which whoever says them is asked to hold back, and down to
#: which they are before it may go on. A system's own buffers before a UART are of this order.
FULL: Final = 16_384
LOW: Final = 4_096


class Port:
    """A talker and listener on the line.

    Bytes given to :meth:`talk` take line time from their arrival on, and start no earlier than
    ``latency`` after the line went idle; while the port itself is sending they follow without a
    pause. ``hear`` takes what arrives on the line; with ``echo`` the port's own bytes too, as a
    two-wire adapter gives them back (so only on a line of one lane). ``hold`` is told True when so
    many bytes wait for the line that no more should come, and False when they may again. ``name``
    is for people.
    """

    __slots__ = (
        "_buffer",
        "_held",
        "_hold",
        "_lane",
        "_latency",
        "_medium",
        "_ninth",
        "_until",
        "_waiting",
        "echo",
        "hear",
        "name",
    )

    def __init__(
        self,
        medium: Medium,
        hear: Callable[[Heard, Ns], None],
        *,
        latency: Ns = LATENCY,
        echo: bool = False,
        name: str = "port",
        hold: Callable[[bool], None] | None = None,
    ) -> None:
        self.name = name
        self._hold = hold
        self._held = False
        self._medium = medium
        self._lane = medium.master_lane
        #: The medium's side: takes what arrives on the line.
        self.hear = hear
        self._latency = latency
        self._buffer = bytearray()
        #: Their ninth bits, on a line that has some.
        self._ninth = bytearray() if medium.rate.nine else None
        #: True while an appointment to start or to go on sending stands.
        self._waiting = False
        #: When the port's own last transmission ends.
        self._until: Ns = -1
        self.echo = echo
        medium.listen(medium.node_lane, self, None if echo else self)

    @property
    def unsent(self) -> int:
        """Bytes that wait for the line."""
        return len(self._buffer)

    def talk(self, data: bytes | bytearray, ninth: int | bytes = 0) -> None:
        """Bytes from outside, arriving now, on a line of ninth bits each with its own.

        ``ninth``: one for all, or a 0 or 1 for each.
        """
        if not data:
            return
        if not self._waiting and self._ninth is None and len(data) <= CHUNK and self._free():
            # Nearly always: a packet, all of it, and the line is free.
            self._until = self._medium.transmit(self, bytes(data), self._lane).end
            return
        self._buffer += data
        if self._ninth is not None:
            self._ninth += ninth if isinstance(ninth, bytes) else bytes((ninth,)) * len(data)
        if len(self._buffer) > FULL:
            self._flow(held=True)
        if self._waiting:
            return
        kernel = self._medium.kernel
        if kernel.now < self._until:
            # What comes in while the port is sending follows without a pause.
            self._waiting = True
            kernel.at(self._until, self._start)
        else:
            self._start()

    def drop(self) -> None:
        """Forget what waits for the line; what is being sent is sent to its end."""
        self._buffer.clear()
        if self._ninth is not None:
            self._ninth.clear()
        if self._held:
            self._flow(held=False)

    def leave(self) -> None:
        """Hear nothing any more; what was said is still sent, as a UART sends on what it holds."""
        for lane in range(self._medium.lanes):
            self._medium.unlisten(lane, self)

    def close(self) -> None:
        """Leave the line. What is being sent is sent to its end; the rest is dropped."""
        self.drop()
        self.leave()

    def _start(self) -> None:
        """Send what is buffered if the line lets us, or make an appointment for when it may."""
        self._waiting = False
        if not self._buffer:
            return
        medium = self._medium
        kernel = medium.kernel
        if not self._free():
            free_at = medium.free_at(self._lane)
            assert free_at is not None  # somebody else has the line, or had it just now
            self._waiting = True
            kernel.at(free_at + self._latency, self._start)
            return
        buffer = self._buffer
        chunk = bytes(buffer if len(buffer) <= CHUNK else buffer[:CHUNK])
        del buffer[:CHUNK]
        if self._held and len(buffer) <= LOW:
            self._flow(held=False)
        ninth = None
        if self._ninth is not None:
            ninth = bytes(self._ninth[: len(chunk)])
            del self._ninth[: len(chunk)]
        self._until = medium.transmit(self, chunk, self._lane, ninth).end
        if self._buffer:
            self._waiting = True
            kernel.at(self._until, self._start)

    def _free(self) -> bool:
        """Whether the port may begin to send now: right behind its own bytes, or on a free line."""
        now = self._medium.kernel.now
        if now <= self._until:
            return now == self._until
        free_at = self._medium.free_at(self._lane)
        return free_at is None or free_at + self._latency <= now

    def _flow(self, *, held: bool) -> None:
        if held != self._held and self._hold is not None:
            self._held = held
            self._hold(held)
