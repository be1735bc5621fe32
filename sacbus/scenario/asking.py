"""What a master is asked for in a scenario again and again.

Owns the pace of polling. Synchronous; an exchange costs an appointment or two and no task of a
loop.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.kernel import Ns
from sacbus.mother.masters import Came
from sacbus.scenario.bench import Bench
from sacbus.scenario.values import Outcome, Poll

__all__ = ["Polling", "outcome_of"]

#: Failures of one polling step that are told one by one; of the rest only how many there were.
TOLD: Final = 3


class Polling:
    """Lines sent in turn, one every so often, each once the one before it has come to its end.

    Where that took longer than the pace allows, the next ones follow at once until it is made up
    for. A line costs one appointment besides those of its exchange, and no task of a loop.

    What is sent is what comes due before its time is over, by the pace and by the answers and not
    by when an appointment is kept, which in real time is a little late: so the lines are as many in
    every run. It is over, and ``over`` is called, with the answer to the last of them.
    """

    def __init__(
        self,
        bench: Bench,
        poll: Poll,
        failed: Callable[[str, str], None],
        over: Callable[[], object],
    ) -> None:
        self._bench = bench
        self._poll = poll
        self._failed = failed
        self._over = over
        self._next = 0
        self._due: Ns = 0
        #: None: it goes on to the end.
        self._until: Ns | None = None
        self._failures = 0
        self._goes_on: Callable[[], bool] = lambda: True
        #: The answer to the last line is in.
        self._settled = False
        self._time_is_up = False

    def begin(self, goes_on: Callable[[], bool]) -> None:
        """Ask from now on, as long as ``goes_on()`` holds."""
        clock = self._bench.clock
        self._goes_on = goes_on
        self._due = now = clock.now
        if self._poll.lasting is not None:
            self._until = now + self._poll.lasting
        self._ask()
        if self._until is not None:
            clock.at(self._until, self._end_of_time)

    def _ask(self) -> None:
        if not self._goes_on():
            return
        self._due += self._poll.every
        self._bench.master.ask(self._poll.lines[self._next], self._done)

    def _done(self, came: Came) -> None:
        wanted = self._poll.outcome
        if wanted not in ("any", outcome_of(came)):
            self._failures += 1
            if self._failures <= TOLD:
                line = self._poll.lines[self._next]
                more = ", and is not told of again" if self._failures == TOLD else ""
                self._failed(f"poll {line!r} to end in {wanted}", f"{came}{more}")
        self._next = (self._next + 1) % len(self._poll.lines)
        clock = self._bench.clock
        when = max(self._due, clock.now)
        if self._until is None or when < self._until:
            clock.at(when, self._ask)
            return
        self._settled = True
        if self._time_is_up:
            self._over()

    def _end_of_time(self) -> None:
        self._time_is_up = True
        if self._settled:
            self._over()


def outcome_of(came: Came) -> Outcome:
    """In the words of a scenario: what nobody answers has come to all that it can."""
    return "ack" if came.outcome == "sent" else came.outcome
