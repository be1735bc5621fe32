"""Transactions on a Super Stepper Bus: one message at a time, and what becomes of it.

Owns whose turn it is, when an answer is overdue, what may be sent again, and the pause after what
did not go well. Synchronous; a clock is handed in, bytes go out through a callable and come in
through :meth:`Exchanges.hear`. What may run twice is sent again after silence, a time-out's NAK or
a wrong checksum; a number of steps only after a NAK, since a module that says NAK has not acted.

SuperStepperError                  everything below; a MotherError
├── Nak                            the message did not come whole, every time; it was not executed
├── NoReply (TimeoutError)         silence, every time
└── BadChecksum                    an answer came damaged; the message was executed

Source: spec, superstepper; SS-MST67 manual, "Data Return".
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final
from typing import Protocol as Contract

from sacbus.kernel import MS, LineRate, Ns
from sacbus.mother.clock import Clock
from sacbus.mother.errors import BadRequest, LineLost, MotherError
from sacbus.mother.statistics import NodeStatistics
from sacbus.wire.superstepper import (
    ANSWER_SIZE,
    Answer,
    Message,
    MoveSteps,
    decode_answer,
    describe,
    encode,
    patience,
)

__all__ = [
    "SLACK",
    "SPEAKS",
    "Answered",
    "BadChecksum",
    "Exchanges",
    "Nak",
    "NoReply",
    "SuperStepperError",
    "Talk",
]

#: The protocols of these messages, as buses call them: without ninth bits, and with.
SPEAKS: Final = ("superstepper", "superstepper-9")

#: How late an answer may be beyond the line's own figures, on a line in this process; it covers the
#: turnaround, of which nothing is published.
SLACK: Final[Ns] = 10 * MS

#: Attempts for what may be repeated.
TRIES: Final = 3


class SuperStepperError(MotherError):
    """A message that was not answered as it should be: whose, which, how often it was sent."""

    verdict = ""

    def __init__(self, address: int, message: Message, attempts: int) -> None:
        self.address = address
        self.message = message
        self.attempts = attempts
        times = "once" if attempts == 1 else f"{attempts} times"
        super().__init__(f"module {address}: {describe(message)!r} sent {times}: {self.verdict}")


class Nak(SuperStepperError):
    """A time-out ended the message before it was whole, every time. It was not executed."""

    verdict = "NAK, it did not come whole and was not executed; check the line and its mode"


class NoReply(SuperStepperError, TimeoutError):
    """Silence. A message may have been executed, or not."""

    verdict = "no answer; nobody at that address, another baud rate, or another mode (8 or 9 bits)"


class BadChecksum(SuperStepperError):
    """Something came, but its checksum is wrong, or it is another's answer."""

    verdict = (
        "a damaged answer, or another module's; it was probably executed, look at the module, and "
        "check the mode (8 or 9 bits)"
    )


class Talk(Contract):
    """Bytes to the line; ``ninth``: a 0 or 1 for each, which a line without ninth bits ignores."""

    def __call__(self, data: bytes, ninth: bytes) -> object: ...


@dataclass(frozen=True, slots=True)
class Answered:
    """A module has a message: its answer, and the round trip, in ns, of the last attempt."""

    answer: Answer
    attempts: int
    round_trip: Ns


Done = Callable[[Answered | MotherError], None]


@dataclass(slots=True)
class _Request:
    address: int
    message: Message
    data: bytes
    done: Done
    may_repeat: bool
    attempts: int = 0
    sent_at: Ns = 0
    withdrawn: bool = False


class Exchanges:
    """Messages in order, one outstanding. ``talk`` takes the bytes of a message.

    ``slack`` is how much later than the line's own figures an answer may come. ``unsent``, where it
    can be known, tells how many bytes still wait for the line: while any do, no answer is late.
    """

    def __init__(
        self,
        clock: Clock,
        talk: Talk,
        rate: LineRate,
        *,
        slack: Ns = SLACK,
        unsent: Callable[[], int] | None = None,
    ) -> None:
        self._clock = clock
        self._talk = talk
        self._rate = rate
        self._slack = slack
        self._unsent = unsent
        #: She waits as long before the next message as modules do, where the last went wrong.
        self._patience = patience(rate.span(1))
        self._waiting: deque[_Request] = deque()
        self._outstanding: _Request | None = None
        self._heard = bytearray()
        #: The number of the attempt whose end is appointed.
        self._attempt = 0
        self._pausing = False
        self._lost: LineLost | None = None
        #: By address. What came damaged counts as a time-out: the answer was waited for in vain.
        self.statistics: defaultdict[int, NodeStatistics] = defaultdict(NodeStatistics)
        #: Bytes that came when nothing was asked.
        self.strays = 0

    @property
    def lost(self) -> LineLost | None:
        """Why nothing can be sent any more; None while it can."""
        return self._lost

    def call(
        self, address: int, message: Message, done: Done, *, accept_duplicates: bool = False
    ) -> None:
        """Have a module execute a message; ``done`` is called once, with what became of it.

        ``accept_duplicates``: after silence send again even a number of steps. BadRequest at once
        for what cannot be sent.
        """
        try:
            data = encode(address, message)
        except ValueError as fault:
            raise BadRequest(f"module {address}: {fault}") from fault
        if self._lost is not None:
            done(self._lost)
            return
        may_repeat = accept_duplicates or not isinstance(message, MoveSteps)
        self._waiting.append(_Request(address, message, data, done, may_repeat))
        self._next()

    def withdraw(self, done: Done) -> None:
        """Nobody waits any more for the message of this ``done``: it is not sent any more."""
        self._waiting = deque(one for one in self._waiting if one.done != done)
        if self._outstanding is not None and self._outstanding.done == done:
            self._outstanding.withdrawn = True

    def hear(self, data: bytes) -> None:
        """Bytes from the modules."""
        request = self._outstanding
        if request is None:
            self.strays += len(data)
            return
        self._heard += data
        if len(self._heard) < ANSWER_SIZE:
            return
        answer = decode_answer(bytes(self._heard[:ANSWER_SIZE]))
        if answer is None or answer.address != request.address:
            self._failed(request, BadChecksum)
        elif not answer.positive:
            self._failed(request, Nak, may_repeat=True)
        else:
            self._outstanding = None
            self.strays += len(self._heard) - ANSWER_SIZE
            round_trip = self._clock.now - request.sent_at
            statistics = self.statistics[request.address]
            statistics.acks += 1
            statistics.round_trips.append(round_trip)
            request.done(Answered(answer, request.attempts, round_trip))
            self._next()

    def lose(self, why: str) -> None:
        """The line is gone: everything that waits fails, and so does all that is asked later."""
        self._lost = LineLost(why)
        waiting = [self._outstanding, *self._waiting]
        self._outstanding = None
        self._waiting.clear()
        for request in waiting:
            if request is not None:
                request.done(self._lost)

    def _next(self) -> None:
        if self._outstanding is None and not self._pausing and self._waiting:
            self._send(self._waiting.popleft())

    def _send(self, request: _Request) -> None:
        request.attempts += 1
        request.sent_at = self._clock.now
        statistics = self.statistics[request.address]
        statistics.sent += 1
        if request.attempts > 1:
            statistics.retries += 1
        self._outstanding = request
        self._heard.clear()
        self._attempt += 1
        self._appoint()
        # The header is marked; each message is one.
        self._talk(request.data, bytes((1, *bytes(len(request.data) - 1))))

    def _appoint(self) -> None:
        assert self._outstanding is not None  # whoever appoints has just asked
        size = len(self._outstanding.data) + ANSWER_SIZE
        due = self._clock.now + self._rate.span(size) + self._patience + self._slack
        self._clock.at(due, self._overdue, self._attempt)

    def _overdue(self, attempt: int) -> None:
        request = self._outstanding
        if request is None or attempt != self._attempt:
            return
        if self._unsent is not None and self._unsent():
            self._appoint()
        else:
            self._failed(request, BadChecksum if self._heard else NoReply)

    def _failed(
        self, request: _Request, kind: type[SuperStepperError], *, may_repeat: bool = False
    ) -> None:
        self._outstanding = None
        # Whatever a module has of it is given up by then. Before ``done``, which may ask again.
        self._pausing = True
        self._clock.at(self._clock.now + self._patience, self._pause_over)
        if kind is Nak:
            self.statistics[request.address].naks += 1
        else:
            self.statistics[request.address].timeouts += 1
        may_repeat = (may_repeat or request.may_repeat) and not request.withdrawn
        if may_repeat and request.attempts < TRIES:
            self._waiting.appendleft(request)
        else:
            request.done(kind(request.address, request.message, request.attempts))

    def _pause_over(self) -> None:
        self._pausing = False
        self._next()
