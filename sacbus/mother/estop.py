"""The emergency stop: S to everybody, at once and twice more.

Owns what is sent and when. Why three: a node is deaf while it handles a packet, and after its ACK,
so the first S may be lost to one that mother was talking to, and one sent back to back with it
would be as well; the second finds every node listening, and the third is for a line that is bad.
Source: spec, mother ("Safety"), wire ("Deaf time").
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.kernel import LineRate, Ns
from sacbus.mother.clock import Clock
from sacbus.wire import GENERAL_CALL, MOTHER, encode
from sacbus.wire.times import MOTHER_GAP

__all__ = ["STOPS", "EmergencyStop"]

#: How often S is sent.
STOPS: Final = 3

#: Its CRC is 39: no device takes that for anything else.
_STOP: Final = encode(GENERAL_CALL, MOTHER, b"S")


class EmergencyStop:
    """One row of stops, from the call of :meth:`begin` until ``over`` is called.

    ``send`` takes the bytes of each; the second and third follow 1 ms after the one before is off
    the line: the gap (``MOTHER_GAP``) that a node needs to hear again.
    """

    def __init__(
        self,
        clock: Clock,
        send: Callable[[bytes], object],
        rate: LineRate,
        unsent: Callable[[], int] | None,
        over: Callable[[], object],
    ) -> None:
        self._clock = clock
        self._send = send
        self._unsent = unsent
        self._over = over
        self._slot: Ns = rate.span(len(_STOP)) + MOTHER_GAP
        self._left = 0
        #: Whether bytes still waited for the line when last looked: when they went is not known.
        self._held_up = False
        self._ended = False

    def begin(self, free_at: Ns) -> None:
        """Send the first now. What mother said before is off the line at ``free_at``."""
        self._left = STOPS
        self._next_one(free_at)

    def again(self) -> None:
        """Somebody asks for it while it lasts: as many again from now on."""
        self._left = STOPS

    def end(self) -> None:
        """Send no more: the line is gone."""
        self._ended = True

    def _next_one(self, free_at: Ns) -> None:
        self._left -= 1
        self._send(_STOP)
        now = self._clock.now
        self._clock.at(max(now, free_at) + self._slot, self._slot_over)

    def _slot_over(self) -> None:
        if self._ended:
            return
        waits = self._unsent is not None and self._unsent() > 0
        if waits or self._held_up:
            # Somebody else talks. Once they have let ours out, it takes its time.
            self._held_up = waits
            self._clock.at(self._clock.now + self._slot, self._slot_over)
        elif self._left:
            self._next_one(0)
        else:
            self._ended = True
            self._over()
