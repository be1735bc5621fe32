"""Mother as the master of a protocol: lines that begin with an address, ``85m3000a2d1``, ``0y``.

Owns what becomes of them in the terms of ``masters.py``; the transactions are ``caller.py``'s.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final

from sacbus.kernel import LineRate, Ns
from sacbus.language.line import quoted
from sacbus.mother.caller import SLACK, Caller
from sacbus.mother.clock import Clock
from sacbus.mother.errors import BadRequest, NoAnswer, Refused, UnknownOutcome
from sacbus.mother.masters import Addressed, Came, MasterBase, Speak
from sacbus.mother.mother import addressed_line
from sacbus.mother.outcome import Acknowledged, Outcome, Sent
from sacbus.mother.request import checked_address, safe_body

__all__ = ["SAC_MASTER", "SacMaster", "SacMasterKind"]

#: Lines that are kept taken apart: who polls says the same to each node again and again.
LINES: Final = 1_024


class SacMaster(MasterBase[Caller]):
    """Mother's transactions, asked in lines."""

    def ask(
        self, line: str, done: Callable[[Came], object], *, accept_duplicates: bool = False
    ) -> None:
        """As :class:`~sacbus.mother.masters.Master` has it."""
        to, body = _taken_apart(line)

        def came(outcome: Outcome) -> None:
            done(_came(to, outcome))

        if to.everybody:
            self._transactions.broadcast(body, came)
        else:
            self._transactions.call(to.node, body, came, accept_duplicates=accept_duplicates)


class SacMasterKind:
    """The entry point ``sac`` of the group ``sacbus.masters``."""

    #: ACK and NAK are all that a SAC answers.
    answers_in_words = False

    def read(self, line: str) -> Addressed:
        """An address, and the command right behind it."""
        to, body = _taken_apart(line)
        if not to.everybody:
            checked_address(to.node)
        safe_body(body)
        return to

    def create(
        self,
        clock: Clock,
        speak: Speak,
        rate: LineRate,
        *,
        slack: Ns | None = None,
        unsent: Callable[[], int] | None = None,
    ) -> SacMaster:
        """Mother on a line."""

        def send(data: bytes) -> None:
            speak(data, None)

        late = SLACK if slack is None else slack
        return SacMaster(Caller(clock, send, rate=rate, slack=late, unsent=unsent))


@lru_cache(LINES)
def _taken_apart(line: str) -> tuple[Addressed, bytes]:
    node, command = addressed_line(line)
    try:
        body = command.encode("latin-1")
    except UnicodeEncodeError as fault:
        raise BadRequest(f"line {quoted(line)}: expected characters of one byte") from fault
    return Addressed(node, command, node == 0), body


def _came(to: Addressed, outcome: Outcome) -> Came:
    match outcome:
        case Acknowledged(attempts=attempts):
            return Came(to, "ack", attempts)
        case Sent():
            return Came(to, "sent")
        case Refused(attempts=attempts):
            return Came(to, "nak", attempts, str(outcome))
        case NoAnswer(attempts=attempts):
            return Came(to, "no answer", attempts, str(outcome))
        case UnknownOutcome(attempts=attempts):
            return Came(to, "unknown", attempts, str(outcome))
        case _:
            return Came(to, "lost", words=str(outcome))


SAC_MASTER: Final = SacMasterKind()
