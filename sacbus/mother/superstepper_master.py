"""The master of a Super Stepper Bus as the master of a protocol: lines as ``sacbus ss`` has them.

Owns what becomes of them in the terms of ``masters.py``; the transactions are ``exchanges.py``'s,
the words ``superstepper_words.py``'s.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from sacbus.kernel import LineRate, Ns
from sacbus.mother.clock import Clock
from sacbus.mother.errors import MotherError
from sacbus.mother.exchanges import SLACK, Answered, BadChecksum, Exchanges, Nak, NoReply
from sacbus.mother.masters import Addressed, Came, MasterBase, Speak
from sacbus.mother.superstepper_words import Order, meaning, read_line

__all__ = ["SUPER_STEPPER_MASTER", "SuperStepperMaster", "SuperStepperMasterKind"]

_OUTCOMES: Final[Mapping[type, str]] = {
    Nak: "nak",
    NoReply: "no answer",
    BadChecksum: "unknown",
}


class SuperStepperMaster(MasterBase[Exchanges]):
    """Messages in order, asked in lines."""

    def ask(
        self, line: str, done: Callable[[Came], object], *, accept_duplicates: bool = False
    ) -> None:
        """As :class:`~sacbus.mother.masters.Master` has it."""
        order = read_line(line)

        def came(outcome: Answered | MotherError) -> None:
            done(_came(order, outcome))

        self._transactions.call(
            order.address, order.message, came, accept_duplicates=accept_duplicates
        )


class SuperStepperMasterKind:
    """The entry points ``superstepper`` and ``superstepper-9`` of the group ``sacbus.masters``."""

    #: Each answer brings a value, or at least what the module has seen of the line.
    answers_in_words = True

    def read(self, line: str) -> Addressed:
        """An address and a command: ``3 stop``. There is no message for all modules."""
        order = read_line(line)
        return Addressed(order.address, order.text)

    def create(
        self,
        clock: Clock,
        speak: Speak,
        rate: LineRate,
        *,
        slack: Ns | None = None,
        unsent: Callable[[], int] | None = None,
    ) -> SuperStepperMaster:
        """A master on a line, in the mode that its bytes tell."""
        nine = rate.nine

        def talk(data: bytes, ninth: bytes) -> None:
            speak(data, ninth if nine else None)

        late = SLACK if slack is None else slack
        return SuperStepperMaster(Exchanges(clock, talk, rate, slack=late, unsent=unsent))


def _came(order: Order, outcome: Answered | MotherError) -> Came:
    to = Addressed(order.address, order.text)
    if isinstance(outcome, Answered):
        said = meaning(order.command, outcome.answer)
        return Came(to, "ack", outcome.attempts, said.words, said.mere)
    attempts = getattr(outcome, "attempts", 1)
    return Came(to, _OUTCOMES.get(type(outcome), "lost"), attempts, str(outcome))


SUPER_STEPPER_MASTER: Final = SuperStepperMasterKind()
