"""Hosts of the kernel: who moves its clock. Real time, scaled time, virtual time.

Owns the relation between bus time and an asyncio loop. Everything that waits for the world (links,
mother's coroutines, signals) runs on the loop; everything on the bus runs in the kernel, when the
host says so.

- *Real* (:class:`RealHost`): bus time follows the loop's clock, times ``speed``, against one
  absolute anchor, so that a late wake-up delays one event and never shifts those that follow. It is
  as precise as the loop it runs on (``selector.py`` makes precise ones), and measures how late it
  runs its events. Quiet ones (``kernel.py``) wait for each other, since waking the process costs
  more than what is done at them: up to ``LEISURE``, and no longer than until somebody looks or
  something comes in. With ``line_free_at`` the line does not wait for the clock.
- *Virtual* (:class:`VirtualLoop`): an event loop whose clock *is* the kernel's. When nothing else
  is ready it jumps to the next event or timer. The same run every time, as fast as it computes.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from contextvars import Context
from math import inf
from typing import TYPE_CHECKING, Any, Final, TypeVar, TypeVarTuple
from typing import Protocol as Contract

from sacbus.kernel import MS, SECOND, US, Kernel, Ns
from sacbus.lateness import Lateness

if TYPE_CHECKING:
    from _typeshed import FileDescriptorLike

__all__ = [
    "BEHIND",
    "LEAD",
    "LEISURE",
    "Host",
    "RealHost",
    "Standstill",
    "VirtualHost",
    "VirtualLoop",
    "run_virtual",
]

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")

#: Without pace, bus time runs ahead until the line has been idle for this long: longer than any
#: turnaround (0.92 ms) and link latency (1 ms), so that no answer waits for the clock.
_IDLE: Final[Ns] = 2 * MS

#: Wall time that a quiet event may wait for others. A wake-up costs a process some 30 to 100 us; at
#: 762 of them a second, 5 ms make one of four. More would save little, and what comes in from the
#: world waits for all that are overdue.
LEISURE: Final[Ns] = 5 * MS

#: Wall time before an event that is not quiet, at which quiet ones that are due are run rather than
#: right before it: four take up to 0.2 ms, which it would be late by, and a process that sleeps is
#: back 0.1 to 0.2 ms after its time.
LEAD: Final[Ns] = 500 * US

#: Later than this, ns of wall time, an event is worth a word: no scheduler that has nothing better
#: to do is, and programs that time each other on the line begin to notice.
BEHIND: Final[Ns] = 10 * MS

#: Later than any event.
_FOR_EVER: Final[Ns] = 2**63

#: Seconds from one word about lateness to the next.
_SPARE: Final = 1.0


class Host(Contract):
    """What links and the daemon need of a host."""

    kernel: Kernel
    #: How late events ran, in wall time; empty where they cannot be late.
    lateness: Lateness
    #: Told of it when the machine cannot keep up, as :class:`RealHost` does.
    late_watcher: Callable[[Ns], object] | None

    def arrive(self, callback: Callable[..., object], *arguments: object) -> None:
        """Something came in from the world: bring bus time up to date, then take it in."""
        ...

    def catch_up(self) -> Ns:
        """Bring bus time up to date; what it is now."""
        ...

    def spare(self) -> float:
        """Seconds of wall time until the next event that is not quiet; ``inf`` without one."""
        ...

    def close(self) -> None:
        """Stop moving the clock; idempotent."""
        ...


class RealHost:
    """Bus time follows ``loop``'s clock. Constructed within a running loop or given one.

    ``speed`` scales: 10 lets ten bus seconds pass in one. ``line_free_at``, when given, says when
    the line was last, or will be, free: then bus time runs ahead of the clock while the line is in
    use (``serve --no-pace``), and by as much motion is ahead too; otherwise it keeps the clock's.

    ``lateness`` tells how long after its time by the clock each event ran, in ns of wall time
    whatever the speed; events of one instant count once, those that ran ahead and quiet ones, which
    are late on purpose, not at all.
    """

    def __init__(
        self,
        kernel: Kernel,
        loop: asyncio.AbstractEventLoop,
        *,
        speed: float = 1.0,
        line_free_at: Callable[[], Ns | None] | None = None,
    ) -> None:
        if not speed > 0:
            raise ValueError(f"speed: expected more than 0, got {speed}")
        self.kernel = kernel
        self.lateness = Lateness()
        #: Called with the worst lateness since the last call, in ns of wall time, when an event ran
        #: more than :data:`BEHIND` late; once a second at most.
        self.late_watcher: Callable[[Ns], object] | None = None
        self._untold: Ns = 0
        self._spared_until = -inf
        self._loop = loop
        self._speed = speed
        #: Both in bus time.
        self._leisure: Ns = round(LEISURE * speed)
        self._lead: Ns = round(LEAD * speed)
        self._line_free_at = line_free_at
        self._wall_anchor = loop.time()
        self._bus_anchor = kernel.now
        self._timer: asyncio.TimerHandle | None = None
        self._timer_for: Ns | None = None
        self._closed = False
        #: True while the kernel runs, or what arrived is taken in.
        self._busy = False
        self._arm()

    def bus_now(self) -> Ns:
        """The bus time that the clock shows now."""
        elapsed = (self._loop.time() - self._wall_anchor) * self._speed
        # Rounded: truncated, a timer of the loop would find its event one ns short of its time.
        return self._bus_anchor + round(elapsed * SECOND)

    def arrive(self, callback: Callable[..., object], *arguments: object) -> None:
        """Bring bus time up to date, call back, and see to what follows from it.

        The loop's timer is armed whatever comes out of that.
        """
        if self._closed:
            return
        kernel = self.kernel
        if self._busy:
            # From within an event: bus time is up to date, and the event is finished first.
            kernel.at(kernel.now, callback, *arguments)
            return
        self._busy = True
        try:
            now = self.bus_now()
            if not kernel.pass_until(now):  # it mostly does when bytes come in
                self._catch_up(now)
            callback(*arguments)
            if self._line_free_at is not None:
                self._run_ahead(self._line_free_at, now)
        finally:
            self._busy = False
            self._arm()

    def catch_up(self) -> Ns:
        """Bus time, up to date with the clock."""
        self.arrive(_nothing)
        return self.kernel.now

    def spare(self) -> float:
        """Seconds until the next event that is not quiet; 0 when one is due, ``inf`` without."""
        when = self.kernel.next_loud_at()
        if when is None or self._closed:
            return inf
        return max((when - self.bus_now()) / SECOND / self._speed, 0.0)

    def close(self) -> None:
        """Stop; no event runs any more."""
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _due(self) -> None:
        self._timer = None
        self.arrive(_nothing)

    def _catch_up(self, limit: Ns) -> None:
        """Run what is due by now, ``limit``, and note how late it is, unless it is quiet."""
        kernel = self.kernel
        worst = 0
        # The limit stays, so that whatever the events cost, the loop gets its turn.
        while (when := kernel.next_at()) is not None and when <= limit:
            if when == kernel.next_loud_at():
                # Asked anew: one event may have held up the next.
                late = int((self.bus_now() - when) / self._speed)
                self.lateness.note(late)
                if late > worst:
                    worst = late
            kernel.run_until(when)
        kernel.run_until(limit)
        if worst > BEHIND:
            self._tell_of(worst)

    def _tell_of(self, late: Ns) -> None:
        self._untold = max(self._untold, late)
        now = self._loop.time()
        if self.late_watcher is not None and now >= self._spared_until:
            self._spared_until = now + _SPARE
            told, self._untold = self._untold, 0
            self.late_watcher(told)

    def _run_ahead(self, line_free_at: Callable[[], Ns | None], now: Ns) -> None:
        """Run the line's events without waiting, and move the anchor by what that gained."""
        kernel = self.kernel
        # Each round may put the line to use for longer; the clock stays at the last event.
        while (
            (when := kernel.next_at()) is not None
            and (free_at := line_free_at()) is not None
            and when <= free_at + _IDLE
        ):
            kernel.run_due(free_at + _IDLE)
        # From when this began: what the clock has gone on meanwhile passes on the bus too.
        if kernel.now > now:
            self._bus_anchor += kernel.now - now
            self._timer_for = None  # the timer that stands would fire too late now

    def _arm(self) -> None:
        """Have the loop call when the next event is due, or a quiet one has waited long enough."""
        when = self._next_wake_up()
        if self._timer is not None:
            if self._timer_for is not None and when is not None and self._timer_for <= when:
                return  # it fires early enough, finds nothing due, and arms again
            self._timer.cancel()
            self._timer = None
        if when is None or self._closed:
            return
        self._timer_for = when
        wait = (when - self._bus_anchor) / SECOND / self._speed
        self._timer = self._loop.call_at(self._wall_anchor + wait, self._due)

    def _next_wake_up(self) -> Ns | None:
        """When the clock must be moved next, in bus time; None: not before something comes in."""
        when = self.kernel.next_at()
        if when is None or when == (loud := self.kernel.next_loud_at()):
            return when
        # It is quiet.
        latest = when + self._leisure
        return latest if loud is None else min(latest, max(when, loud - self._lead))


class Standstill(RuntimeError):
    """Virtual time cannot go on: coroutines wait, and nothing on the bus or the loop is due."""


def _nothing() -> None:
    """What an event of the clock's own takes in."""


class _VirtualSelector(selectors.DefaultSelector):
    """Instead of waiting, moves the kernel. Descriptors are looked at, never waited for."""

    kernel: Kernel
    #: True while only asyncio's own wake-up pipe is registered: nothing comes from outside.
    alone = True
    #: True once the loop has been asked to run something in a thread, which may take its time.
    threads = False
    #: True once the loop has been asked to mind a signal, which comes by the wake-up pipe.
    signals = False

    def register(
        self, fileobj: FileDescriptorLike, events: int, data: object = None
    ) -> selectors.SelectorKey:
        key = super().register(fileobj, events, data)
        self.alone = len(self.get_map()) <= 1
        return key

    def unregister(self, fileobj: FileDescriptorLike) -> selectors.SelectorKey:
        key = super().unregister(fileobj)
        self.alone = len(self.get_map()) <= 1
        return key

    def select(self, timeout: float | None = None) -> list[Any]:
        alone = self.alone and not self.threads
        busy = timeout is not None and timeout <= 0
        # With something to do already the loop learns nothing from its wake-up pipe but of signals.
        ready = [] if alone and busy and not self.signals else super().select(0)
        if ready or busy:
            return ready
        kernel = self.kernel
        when = kernel.next_at()
        limit = None
        if timeout is not None:
            # Rounded up: a timer must not find itself a nanosecond short of its time.
            limit = kernel.now + int(timeout * SECOND) + 1
            if when is None or when > limit:
                kernel.run_until(limit)
                return []
        elif when is None:
            if alone:
                raise Standstill(
                    "virtual time stands still: coroutines wait for something that no event on the "
                    "bus, no timer and no descriptor will ever bring"
                )
            return super().select(None)
        if alone:
            # To go round the loop for each instant would take longer than most of them do. The loop
            # ends this when it has been given something to do, which time must not run away from.
            kernel.run_due(_FOR_EVER if limit is None else limit, pausable=True)
        else:
            kernel.run_due(when)
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    """An asyncio loop in virtual time: ``loop.time()`` is the kernel's clock, in seconds."""

    def __init__(self, kernel: Kernel) -> None:
        selector = _VirtualSelector()
        selector.kernel = kernel
        self.kernel = kernel
        self._virtual_selector = selector
        super().__init__(selector)
        self._clock_resolution = 1 / SECOND

    def time(self) -> float:
        """Bus time in seconds."""
        return self.kernel.now / SECOND

    # Whatever gives the loop something to do passes through one of these, but for descriptors and
    # signals, which the selector sees.

    def call_soon(
        self,
        callback: Callable[[*_Ts], object],
        *args: *_Ts,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """As asyncio's."""
        self.kernel.pause()
        return super().call_soon(callback, *args, context=context)

    def call_at(
        self,
        when: float,
        callback: Callable[[*_Ts], object],
        *args: *_Ts,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """As asyncio's."""
        self.kernel.pause()
        return super().call_at(when, callback, *args, context=context)

    def call_soon_threadsafe(
        self,
        callback: Callable[[*_Ts], object],
        *args: *_Ts,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """As asyncio's."""
        self.kernel.pause()
        return super().call_soon_threadsafe(callback, *args, context=context)

    def stop(self) -> None:
        """As asyncio's."""
        self.kernel.pause()
        super().stop()

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts
    ) -> asyncio.Future[_T]:
        """As asyncio's. Bus time stands still while nothing else is due and a thread works."""
        self._virtual_selector.threads = True
        return super().run_in_executor(executor, func, *args)

    def add_signal_handler(self, sig: int, callback: Callable[..., object], *args: object) -> None:
        """As asyncio's."""
        self._virtual_selector.signals = True
        super().add_signal_handler(sig, callback, *args)


class VirtualHost:
    """The host of a bus inside a :class:`VirtualLoop`, whose selector moves the clock."""

    def __init__(self, kernel: Kernel) -> None:
        self.kernel = kernel
        self.lateness = Lateness()
        self.late_watcher: Callable[[Ns], object] | None = None

    def arrive(self, callback: Callable[..., object], *arguments: object) -> None:
        """Bus time is up to date already."""
        callback(*arguments)

    def catch_up(self) -> Ns:
        """It always is up to date."""
        return self.kernel.now

    def spare(self) -> float:
        """No event is held up by what takes no bus time."""
        return inf

    def close(self) -> None:
        """Nothing to stop: without the loop, no time passes."""


def run_virtual(kernel: Kernel, main: Coroutine[Any, Any, _T]) -> _T:
    """``asyncio.run`` in the virtual time of ``kernel``; gives what ``main`` returns."""
    with asyncio.Runner(loop_factory=lambda: VirtualLoop(kernel)) as runner:
        return runner.run(main)
