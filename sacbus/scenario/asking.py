"""What mother is asked for in a scenario, once or again and again, and what came of it in words.

Owns the way from a line to mother's transactions. Synchronous; an exchange costs an appointment or
two and no task of a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from sacbus.kernel import Ns
from sacbus.mother import (
    Acknowledged,
    MotherError,
    NoAnswer,
    Refused,
    Sent,
    UnknownOutcome,
    addressed_line,
)
from sacbus.scenario.bench import Bench
from sacbus.scenario.values import Outcome, Poll

__all__ = ["Polling", "ask", "outcome_of", "told"]

#: Failures of one polling step that are told one by one; of the rest only how many there were.
TOLD: Final = 3

_OUTCOMES: Final[Mapping[type, Outcome]] = {
    Acknowledged: "ack",
    Sent: "ack",
    Refused: "nak",
    NoAnswer: "no answer",
    UnknownOutcome: "unknown",
}


class Polling:
    """Lines sent in turn, one every so often, each once the one before it has come to its end.

    Where that took longer than the pace allows, the next ones follow at once until it is made up
    for. A line costs one appointment besides those of its exchange, and no task of a loop.
    """

    def __init__(self, bench: Bench, poll: Poll, failed: Callable[[str, str], None]) -> None:
        self._bench = bench
        self._poll = poll
        self._failed = failed
        self._requests = [(*addressed_line(line), line) for line in poll.lines]
        self._next = 0
        self._due: Ns = 0
        self._failures = 0
        self._goes_on: Callable[[], bool] = lambda: True
        self._stopped = False

    def begin(self, goes_on: Callable[[], bool]) -> None:
        """Ask from now on, as long as ``goes_on()`` holds and nobody stops it."""
        self._goes_on = goes_on
        self._due = self._bench.clock.now
        self._ask()

    def stop(self) -> None:
        """Ask no more."""
        self._stopped = True

    def _ask(self) -> None:
        if self._stopped or not self._goes_on():
            return
        node, command, _ = self._requests[self._next]
        self._due += self._poll.every
        caller = self._bench.caller
        body = command.encode("latin-1")
        if node == 0:
            caller.broadcast(body, self._done)
        else:
            caller.call(node, body, self._done)

    def _done(self, outcome: Acknowledged | Sent | MotherError) -> None:
        wanted = self._poll.outcome
        if wanted not in ("any", outcome_of(outcome)):
            self._failures += 1
            if self._failures <= TOLD:
                line = self._requests[self._next][2]
                more = ", and is not told of again" if self._failures == TOLD else ""
                self._failed(f"poll {line!r} to end in {wanted}", f"{told(outcome)}{more}")
        self._next = (self._next + 1) % len(self._requests)
        clock = self._bench.clock
        clock.at(max(self._due, clock.now), self._ask)


def ask(
    bench: Bench,
    line: str,
    done: Callable[[Acknowledged | Sent | MotherError], None],
    *,
    accept_duplicates: bool,
) -> None:
    node, command = addressed_line(line)
    body = command.encode("latin-1")
    if node == 0:
        bench.caller.broadcast(body, done)
    else:
        bench.caller.call(node, body, done, accept_duplicates=accept_duplicates)


def outcome_of(outcome: Acknowledged | Sent | MotherError) -> Outcome:
    return _OUTCOMES.get(type(outcome), "lost")


def told(outcome: Acknowledged | Sent | MotherError) -> str:
    """An outcome in words."""
    if isinstance(outcome, MotherError):
        return f"{outcome_of(outcome)} ({outcome})"
    return outcome_of(outcome)
