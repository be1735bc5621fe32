"""A request on its way: what was asked, how often it was sent, and what is known of it in the end.

Owns the verdict on what went wrong; what is done about it meanwhile is ``caller.py``'s.
"""

from __future__ import annotations

from dataclasses import dataclass

from sacbus.kernel import Ns
from sacbus.mother.errors import MotherError, NoAnswer, Refused, Stopped, UnknownOutcome
from sacbus.mother.outcome import Done

__all__ = ["Pending"]


@dataclass(slots=True)
class Pending:
    """One packet for ``node`` (0: all), sent up to ``tries`` times; ``done`` is told the outcome.

    ``slack``: how late its answer may be, beyond the line's own figures.
    """

    node: int
    body: bytes
    data: bytes
    done: Done
    #: Whether it may run twice: the caller said so, or, as looked up at silence, the line may.
    may_repeat: bool
    tries: int
    slack: Ns
    attempts: int = 0
    refusals: int = 0
    sent_at: Ns = 0
    last: str = "none"
    #: It is not to be sent again: nobody waits for it any more, or an emergency stop has come.
    withdrawn: bool = False

    @property
    def again(self) -> bool:
        """Whether it may be sent once more, as far as the number of attempts goes."""
        return self.attempts < self.tries and not self.withdrawn

    def failure(self) -> MotherError:
        """What is known in the end: NAK says that it was not executed, silence says nothing.

        One that was never sent has been stopped.
        """
        # As it was asked for, without the space that its CRC may have needed.
        line = self.body.decode("latin-1").rstrip(" ")
        if not self.attempts:
            return Stopped(self.node, line)
        if self.refusals == self.attempts:
            return Refused(self.node, line, self.attempts, self.last)
        if self.may_repeat:
            return NoAnswer(self.node, line, self.attempts, self.last, self.refusals)
        return UnknownOutcome(self.node, line, self.attempts, self.last)
