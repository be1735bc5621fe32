"""The event queue and the only clock of the core, and the units of time.

Owns *when* things happen on the bus: a queue of (time, order, callback) in integer nanoseconds of
bus time; and what a byte takes on a line. Knows neither asyncio nor the wall clock; ``host.py``
runs it in real, scaled or virtual time. Everything below (medium, nodes, mother's transactions) is
plain synchronous code that is called from here and asks for its next appointment here.

Some events are *quiet*: nobody outside the process can tell when they ran, as long as they run
before whatever comes after them. They stand in a heap of their own for one reason: so that a host
can ask when the next one is due that is not. Order is one for both.

Rules for whoever edits this file: events of one instant run in the order in which they were
scheduled, quiet or not, on every machine and in every run; ``now`` never goes back; nothing here
may ask what time it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush
from typing import Any, Final

__all__ = [
    "MS",
    "NINE_BITS",
    "PLAIN_BITS",
    "SECOND",
    "US",
    "Appointment",
    "Kernel",
    "LineRate",
    "Ns",
]

Ns = int
"""Nanoseconds of bus time since the kernel's start. Always an int."""

US: Final = 1_000
MS: Final = 1_000_000
SECOND: Final = 1_000_000_000

#: Bits of a byte on a line: start, eight, stop; and on one with ninth bits.
PLAIN_BITS: Final = 10
NINE_BITS: Final = 11


@dataclass(frozen=True, slots=True)
class LineRate:
    """How long bytes take: ``bits`` each (PLAIN_BITS or NINE_BITS) at ``baud``."""

    baud: int = 38_400
    bits: int = PLAIN_BITS
    #: The spans of short runs: every packet asks for several.
    _short: tuple[Ns, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        spans = tuple(count * self.bits * SECOND // self.baud for count in range(64))
        object.__setattr__(self, "_short", spans)

    @property
    def nine(self) -> bool:
        """Whether bytes have a ninth bit."""
        return self.bits == NINE_BITS

    def span(self, count: int) -> Ns:
        """Line time of ``count`` bytes in a row, ns, truncated once for all of them together."""
        if count < 64:
            return self._short[count]
        return count * self.bits * SECOND // self.baud

    def bytes_begun(self, elapsed: Ns) -> int:
        """How many bytes of a gapless run have begun (strictly) before ``elapsed`` ns."""
        if elapsed <= 0:
            return 0
        begun = elapsed * self.baud // (self.bits * SECOND)
        return begun + 1 if self.span(begun) < elapsed else begun


#: [when, order, callback or None when cancelled or done, arguments, whether it is quiet]. A list,
#: because heapq compares it in C and the unique order means that callbacks are never compared.
#: ``Any``: the callback's own parameters, which the kernel passes on and never looks at.
Appointment = list[Any]


#: Cancelled appointments that lie about before it is worth looking for them: when they are more
#: than half of all. What is far in the future would otherwise stay for as long.
_WORTH_CLEARING: Final = 64


class Kernel:
    """A queue of appointments and the clock that they move.

    Times are ints, ns since the start. Benchmarked against a bare heapq loop (``make bench``).
    """

    __slots__ = (
        "_cancelled",
        "_limit",
        "_loud",
        "_order",
        "_pausable",
        "_paused",
        "_quiet",
        "now",
        "ran",
        "running",
    )

    def __init__(self, start: Ns = 0) -> None:
        #: Heaps, each with appointments of one kind.
        self._loud: list[Appointment] = []
        self._quiet: list[Appointment] = []
        self._order = 0
        #: Cancelled appointments that may still lie in the heaps.
        self._cancelled = 0
        #: Bus time, ns. Read by everybody, written by the kernel alone.
        self.now: Ns = start
        #: Events run so far.
        self.ran = 0
        #: Whether an event is running now: what it sets going must wait until it is over.
        self.running = False
        #: Up to when the run that is under way goes, and whether :meth:`pause` may end it, or was
        #: called since the outermost one began.
        self._limit: Ns = start
        self._pausable = False
        self._paused = False

    def at(self, when: Ns, callback: Callable[..., object], *arguments: object) -> Appointment:
        """Have ``callback(*arguments)`` run at ``when``; a time that has passed means now.

        Returns the appointment, which :meth:`cancel` takes.
        """
        if when < self.now:
            when = self.now
        self._order = order = self._order + 1
        appointment: Appointment = [when, order, callback, arguments, False]
        heappush(self._loud, appointment)
        return appointment

    def at_leisure(
        self, when: Ns, callback: Callable[..., object], *arguments: object
    ) -> Appointment:
        """As :meth:`at`, for a quiet event: a host in real time need not be punctual with it.

        In bus time, and among all other events, it runs exactly as from :meth:`at`.
        """
        if when < self.now:
            when = self.now
        self._order = order = self._order + 1
        appointment: Appointment = [when, order, callback, arguments, True]
        heappush(self._quiet, appointment)
        return appointment

    def hasten(self, appointment: Appointment) -> None:
        """Have a quiet event no longer be quiet, at its time and its place in the order.

        One that is not quiet, has run, or was cancelled, is left in peace.
        """
        if appointment[2] is None or not appointment[4]:
            return
        appointment[4] = False
        # It stays in the other heap as well, where it counts as cancelled: being the same, it is
        # never less than itself, so the one that is not quiet runs.
        self._cancelled += 1
        heappush(self._loud, appointment)

    def cancel(self, appointment: Appointment) -> None:
        """Forget an appointment. One that has run, or was cancelled, is left in peace."""
        if appointment[2] is None:
            return
        appointment[2] = None
        self._cancelled += 1
        standing = len(self._loud) + len(self._quiet)
        if self._cancelled > _WORTH_CLEARING and self._cancelled * 2 > standing:
            self._loud[:] = [one for one in self._loud if one[2] is not None]
            self._quiet[:] = [one for one in self._quiet if one[2] is not None and one[4]]
            heapify(self._loud)
            heapify(self._quiet)
            self._cancelled = 0

    def next_at(self) -> Ns | None:
        """When the next event is due; None when nothing is."""
        loud = self._loud
        when: Ns | None = loud[0][0] if loud and loud[0][2] is not None else self._first_of(loud)
        if self._quiet:
            quiet = self._first_of(self._quiet)
            if when is None or (quiet is not None and quiet < when):
                return quiet
        return when

    def next_loud_at(self) -> Ns | None:
        """When the next event is due that is not quiet; None when none is."""
        return self._first_of(self._loud)

    def _first_of(self, heap: list[Appointment]) -> Ns | None:
        while heap:
            if heap[0][2] is not None:
                when: Ns = heap[0][0]
                return when
            heappop(heap)
            self._cancelled -= 1
        return None

    def pass_until(self, limit: Ns) -> bool:
        """Move the clock to ``limit``, unless an event may be due by then; False if one may."""
        loud, quiet = self._loud, self._quiet
        if (loud and loud[0][0] <= limit) or (quiet and quiet[0][0] <= limit):
            return False
        if limit > self.now:
            self.now = limit
        return True

    def run_until(self, limit: Ns) -> int:
        """Run every event due at or before ``limit``, then move the clock there; how many ran."""
        ran = 0 if self.pass_until(limit) else self.run_due(limit)
        if limit > self.now:
            self.now = limit
        return ran

    def run_due(self, limit: Ns, *, pausable: bool = False) -> int:
        """Run every event due at or before ``limit``; the clock stays at the last one.

        Events may schedule others, which run too if they are due. Returns how many ran. An
        exception of a callback is a defect of ours: it leaves the clock at its event and comes out.
        ``pausable``: one of the events may end the run by :meth:`pause`.
        """
        loud, quiet = self._loud, self._quiet
        ran = 0
        around = self._limit, self._pausable, self.running
        if not self.running:
            self._paused = False
        self._limit, self._pausable, self.running = limit, pausable, True
        try:
            while True:
                heap = quiet if quiet and (not loud or quiet[0] < loud[0]) else loud
                if not heap or heap[0][0] > self._limit:
                    break
                appointment = heappop(heap)
                when, _, callback, arguments, _ = appointment
                if callback is None:
                    self._cancelled -= 1
                    continue
                appointment[2] = None
                self.now = when
                ran += 1
                callback(*arguments)
        finally:
            self._limit, self._pausable, self.running = around
            if self._paused and self._pausable:
                self._limit = self.now  # asked for in a run within this one, which it ends too
            self.ran += ran
        return ran

    def pause(self) -> None:
        """End a pausable run behind the present instant: somebody else has something to do.

        It ends those that this one is within as well. Nothing happens outside of one.
        """
        self._paused = True
        if self._pausable:
            self._limit = self.now

    def run_next(self) -> bool:
        """Run all events of the next instant that has any; False when nothing is due ever."""
        when = self.next_at()
        if when is None:
            return False
        self.run_until(when)
        return True

    def run(self) -> int:
        """Run until nothing is due, which never comes while motion is endless; events run."""
        before = self.ran
        while self.run_next():
            pass
        return self.ran - before
