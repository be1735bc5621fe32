"""Transactions: one request at a time on a half-duplex line, and what becomes of it.

Owns whose turn it is, what may be asked again, the pause after each packet, and what an emergency
stop does to those who wait; when an answer is overdue is ``overdue.py``'s business. Synchronous; a
clock is handed in (the kernel, or a loop's), bytes go out through a callable and come in through
:meth:`Caller.hear`.
Source: spec, mother ("Transactions", "Safety").
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from typing import Final

from sacbus.kernel import MS, LineRate, Ns
from sacbus.language import repeatable
from sacbus.mother.clock import Clock
from sacbus.mother.errors import LineLost, MotherError
from sacbus.mother.estop import EmergencyStop
from sacbus.mother.outcome import Acknowledged, Done, Sent
from sacbus.mother.overdue import Overdue
from sacbus.mother.pending import Pending
from sacbus.mother.request import checked_address, safe_packet
from sacbus.mother.soft_ops import SoftOpHeard, soft_op
from sacbus.mother.statistics import NodeStatistics
from sacbus.wire import (
    GENERAL_CALL,
    MOTHER,
    Answer,
    LineFault,
    Packet,
    PacketReceiver,
    encode,
)
from sacbus.wire.times import MOTHER_GAP

__all__ = ["SLACK", "TRIES", "Caller"]

#: How long an answer may be late beyond the line's own figures, on a line in this process, once
#: the packet is out of the port: it covers what an answer may wait for besides its turnaround.
SLACK: Final[Ns] = 10 * MS

#: Attempts for what may be repeated.
TRIES: Final = 3


class Caller:
    """Requests in order, one outstanding. ``send`` takes the bytes of a packet.

    ``slack`` is how much later than the line's own figures an answer may come. ``unsent``, where it
    can be known, tells how many bytes still wait for the line: while any do, no answer is late.
    ``gap`` is left free after every answer and broadcast, for a SAC is deaf then: 0 only where no
    node is (``deaf_time`` off), or nothing but speed matters.
    """

    def __init__(
        self,
        clock: Clock,
        send: Callable[[bytes], None],
        *,
        rate: LineRate | None = None,
        slack: Ns = SLACK,
        unsent: Callable[[], int] | None = None,
        tries: int = TRIES,
        gap: Ns = MOTHER_GAP,
    ) -> None:
        self._clock = clock
        self._send = send
        self._rate = rate or LineRate()
        self._slack = slack
        self._unsent = unsent
        self._tries = tries
        self._gap = gap
        self._receiver = PacketReceiver()
        self._waiting: deque[Pending] = deque()
        self._outstanding: Pending | None = None
        self._overdue = Overdue(
            clock, self._rate, lambda: self._outstanding, self._silent, self._unsent
        )
        #: Nodes that were given up before all of the slack was over, and when that is.
        self._unsettled: dict[int, Ns] = {}
        #: True while the pause after a packet lasts, or a broadcast is on its way.
        self._pausing = False
        self._broadcasting: Pending | None = None
        #: The emergency stop that is under way, and who waits for its end.
        self._stop: EmergencyStop | None = None
        self._stopping: list[Done] = []
        #: Why nothing can be sent any more; None while it can.
        self.lost: LineLost | None = None
        self.statistics: defaultdict[int, NodeStatistics] = defaultdict(NodeStatistics)
        #: Packets of others, answers that nobody waits for, and line faults, counted.
        self.overheard = 0
        self.strays = 0
        self.faults = 0
        #: Emergency stops so far: who is in the middle of several calls sees by it that one came.
        self.stops = 0
        #: Called with each soft op of a node's. Empty it is no more than counted.
        self.soft_op_listeners: list[Callable[[SoftOpHeard], object]] = []
        #: Called with the node of each answer to mother that nobody waits for.
        self.stray_watchers: list[Callable[[int], object]] = []

    def call(
        self,
        node: int,
        line: bytes,
        done: Done,
        *,
        accept_duplicates: bool = False,
    ) -> None:
        """Have ``node`` receive ``line``; ``done`` is called once, with what became of it.

        Silence is followed by another attempt only if the line may be repeated, or the caller
        accepts that it may run twice; NAK always is, since a node that says NAK has not acted.
        :class:`BadRequest` at once for what cannot be sent.
        """
        body, data = safe_packet(checked_address(node), line)
        self._enqueue(Pending(node, body, data, done, accept_duplicates, self._tries, self._slack))

    def probe(self, node: int, slack: Ns, done: Done) -> None:
        """Ask once, with the empty line, whether anybody is at ``node``, and wait ``slack`` only.

        An answer that comes later is a stray. Nothing else is sent to that node before the usual
        slack is over, so that it is never taken for the answer to that.
        """
        checked_address(node)
        data = encode(node, MOTHER, b"")
        self._enqueue(
            Pending(node, b"", data, done, may_repeat=True, tries=1, slack=min(slack, self._slack))
        )

    def broadcast(self, line: bytes, done: Done) -> None:
        """Have everybody receive ``line``; nobody answers. ``done`` comes when the line is free."""
        body, data = safe_packet(GENERAL_CALL, line)
        self._enqueue(Pending(GENERAL_CALL, body, data, done, may_repeat=False, tries=1, slack=0))

    def estop(self, done: Done) -> None:
        """Have everybody stop now: S at once and twice more, whatever is outstanding.

        Nothing is waited for. What waits for its turn is not sent any more and ends as
        :class:`Stopped`, or, where it was sent before, as what is known of that; what is
        outstanding ends as it does, but is not sent again. ``done`` comes when the line is free.
        What is asked from now on has its turn after that.
        """
        if self.lost is not None:
            done(self.lost)
            return
        self.stops += 1
        self._stopping.append(done)
        if self._stop is None:
            self._stop = EmergencyStop(
                self._clock, self._send_stop, self._rate, self._unsent, self._stopped
            )
            on_its_way = self._outstanding or self._broadcasting
            self._stop.begin(
                0
                if on_its_way is None
                else on_its_way.sent_at + self._rate.span(len(on_its_way.data))
            )
        else:
            self._stop.again()
        if self._outstanding is not None:
            self._outstanding.withdrawn = True
        waiting = tuple(self._waiting)
        self._waiting.clear()
        # Only now, for those who are told may ask for more.
        for request in waiting:
            request.done(request.failure())

    def withdraw(self, done: Done) -> None:
        """Nobody waits any more for the request of this ``done``.

        What has not been sent never will be. What has cannot be called back: the line stays taken
        until its answer is in or overdue, but it is not sent again.
        """
        for request in self._waiting:
            if request.done == done:
                self._waiting.remove(request)
                return
        if self._outstanding is not None and self._outstanding.done == done:
            self._outstanding.withdrawn = True

    def hear(self, data: bytes) -> None:
        """Bytes from the line."""
        for event in self._receiver.receive(data):
            if type(event) is Answer:
                self._answered(event)
            elif type(event) is LineFault:
                self.faults += 1
            elif type(event) is Packet and event.src != MOTHER:
                self.overheard += 1
                if self.soft_op_listeners:
                    self._tell_soft_op(event)

    def lose(self, why: str) -> None:
        """The line is gone: everything that waits fails, and so does all that is asked later."""
        self.lost = LineLost(why)
        waiting = [self._outstanding, self._broadcasting, *self._waiting]
        self._outstanding = self._broadcasting = None
        self._waiting.clear()
        if self._stop is not None:
            self._stop.end()
        self._end_stop(self.lost)
        for request in waiting:
            if request is not None:
                request.done(self.lost)

    def _enqueue(self, request: Pending) -> None:
        if self.lost is not None:
            request.done(self.lost)
            return
        self._waiting.append(request)
        self._next()

    def _next(self) -> None:
        """Send the next request if the line is ours."""
        if (
            self._waiting
            and self._outstanding is None
            and not self._pausing
            and self._stop is None
            and not (self._unsettled and self._may_still_answer(self._waiting[0].node))
        ):
            self._attempt(self._waiting.popleft())

    def _may_still_answer(self, node: int) -> bool:
        """Whether an answer of ``node`` to a probe may yet come; then it is waited for first."""
        until = self._unsettled.pop(node, 0)
        if until <= self._clock.now:
            return False
        self._pausing = True
        self._clock.at(until, self._pause_over)
        return True

    def _attempt(self, request: Pending) -> None:
        request.attempts += 1
        clock = self._clock
        request.sent_at = now = clock.now
        statistics = self.statistics[request.node]
        statistics.sent += 1
        if request.attempts > 1:
            statistics.retries += 1
        if request.node == GENERAL_CALL:
            self._pausing = True
            self._broadcasting = request
            line_time = self._rate.span(len(request.data))
            clock.at(now + line_time + self._gap, self._broadcast_over)
        else:
            self._outstanding = request
            self._overdue.mind(request, now)
        self._send(request.data)

    def _tell_soft_op(self, packet: Packet) -> None:
        heard = soft_op(packet, self._clock.now)
        if heard is not None:
            for listener in tuple(self.soft_op_listeners):
                listener(heard)

    def _answered(self, answer: Answer) -> None:
        request = self._outstanding
        if request is None or answer.dest != MOTHER or answer.src != request.node:
            self.strays += 1
            if answer.dest == MOTHER:
                for watcher in tuple(self.stray_watchers):
                    watcher(answer.src)
            return
        self._outstanding = None
        statistics = self.statistics[request.node]
        if answer.accepted:
            round_trip = self._clock.now - request.sent_at
            statistics.acks += 1
            statistics.round_trips.append(round_trip)
            self._pause()
            request.done(Acknowledged(request.node, request.attempts, round_trip))
            return
        statistics.naks += 1
        request.last = "NAK"
        request.refusals += 1
        if request.again:
            self._waiting.appendleft(request)
            self._pause()
        else:
            self._pause()
            request.done(request.failure())

    def longest_call(self, body: int) -> Ns:
        """How long a call may take once it is its turn, if every attempt but the last fails.

        For a line of ``body`` bytes; on a line that takes at once what it is given.
        """
        attempt = self._overdue.line_time(body) + self._slack + self._gap
        return self._gap + self._tries * attempt

    def _silent(self, request: Pending) -> None:
        self._outstanding = None
        self.statistics[request.node].timeouts += 1
        request.last = "silence"
        request.may_repeat = request.may_repeat or repeatable(request.body)
        if request.slack < self._slack:
            self._unsettled[request.node] = self._clock.now + self._slack - request.slack
        if request.may_repeat and request.again:
            self._waiting.appendleft(request)
        else:
            request.done(request.failure())
        self._next()

    def _pause(self) -> None:
        """Leave the node the time in which it is deaf, then go on."""
        if self._gap:
            self._pausing = True
            self._clock.at(self._clock.now + self._gap, self._pause_over)
        else:
            self._next()

    def _pause_over(self) -> None:
        self._pausing = False
        self._next()

    def _broadcast_over(self) -> None:
        self._pausing = False
        request, self._broadcasting = self._broadcasting, None
        if request is not None:
            request.done(Sent())
        self._next()

    def _send_stop(self, data: bytes) -> None:
        self.statistics[GENERAL_CALL].sent += 1
        self._send(data)

    def _stopped(self) -> None:
        """The last S is out, and every node hears again."""
        self._end_stop(Sent())
        self._next()

    def _end_stop(self, outcome: Sent | MotherError) -> None:
        self._stop = None
        waiting, self._stopping = self._stopping, []
        for done in waiting:
            done(outcome)
