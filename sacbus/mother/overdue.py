"""When the answer to a request is overdue: the line's own figures, and one look at the clock.

Owns how long an answer may take, and the appointment to see whether it has. Nearly all answers come
in time, so nothing is appointed or cancelled per request: a look that stands is good for all that
come before it, and goes on to the request that is out by then.
Source: spec, mother ("Transactions").
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.kernel import LineRate, Ns
from sacbus.mother.clock import Clock
from sacbus.mother.pending import Pending
from sacbus.wire import MAX_BODY
from sacbus.wire.times import ANSWER_BYTES, turnaround

__all__ = ["Overdue"]

#: What makes a packet of a body: STX, two addresses, ETX, CRC, NUL.
_FRAME_BYTES: Final = 6

#: The space that a body may need for its CRC.
_PADDING: Final = 1


class Overdue:
    """Minds the one request that is out; ``outstanding`` tells which that is, if any.

    ``silent`` is called with it when its answer is overdue. ``unsent``, where it can be known,
    tells how many bytes still wait for the line: while any do, no answer is late.
    """

    def __init__(
        self,
        clock: Clock,
        rate: LineRate,
        outstanding: Callable[[], Pending | None],
        silent: Callable[[Pending], object],
        unsent: Callable[[], int] | None,
    ) -> None:
        self._clock = clock
        self._outstanding = outstanding
        self._silent = silent
        self._unsent = unsent
        #: From a packet's first bit to its answer's last by the line's own figures, by the
        #: length of the body.
        self._line_times: list[Ns] = [
            rate.span(body + _FRAME_BYTES)
            + turnaround(body, nul_follows=True)
            + rate.span(ANSWER_BYTES)
            for body in range(MAX_BODY + _PADDING + 1)
        ]
        #: When the answer is overdue, and for when the next look at it is appointed.
        self._due: Ns = 0
        self._look_at: Ns | None = None

    def line_time(self, body: int) -> Ns:
        """What a transaction takes, by the line's own figures, with a line of ``body`` bytes.

        Those of the line as it is asked for, at most MAX_BODY of them: it may need a space.
        """
        return self._line_times[body + _PADDING]

    def mind(self, request: Pending, now: Ns) -> None:
        """``request`` goes out now."""
        self._due = due = now + self._line_times[len(request.body)] + request.slack
        if self._look_at is None or due < self._look_at:
            self._look_at = due
            self._clock.at(due, self._look)

    def _look(self) -> None:
        now = self._clock.now
        if self._look_at is None or self._look_at > now:
            return  # one that an earlier one has made needless
        self._look_at = None
        request = self._outstanding()
        if request is None:
            return
        if self._due > now:
            # Another one than the look was for.
            self._look_at = self._due
            self._clock.at(self._due, self._look)
        elif self._unsent is not None and self._unsent():
            self.mind(request, now)
        else:
            self._silent(request)
