"""What can go wrong between mother and a node; one small tree, with what a caller may expect.

MotherError                        everything below
├── BadRequest (ValueError)        we were asked to send what no node could receive
├── Refused                        the node answered NAK, every time
├── NoAnswer (TimeoutError)        silence, and what was asked may safely be asked again
├── UnknownOutcome (TimeoutError)  silence: the node may have acted, or not, and must not twice
├── NotStarted                     of several that were to start together, none has
├── Stopped                        an emergency stop came before its turn; never sent
└── LineLost (ConnectionError)     the link is gone

What only one file raises is there: NoSoftOp (calibration), LostTrack (queue streams), StreamBroken
and WrongNode (streams of blocks), and of BadRequest RowRefused (queue files) and NotStreamable.
"""

from __future__ import annotations

__all__ = [
    "BadRequest",
    "LineLost",
    "MotherError",
    "NoAnswer",
    "NotStarted",
    "Refused",
    "Stopped",
    "UnknownOutcome",
]


class MotherError(Exception):
    """Something that mother was asked for did not happen, or may not have."""


class BadRequest(MotherError, ValueError):
    """The line cannot be sent as asked; nothing was sent."""


class _Unanswered(MotherError):
    """Fields common to what can come of a request: who, what, how often, and what came last."""

    #: What it says of the outcome; in the subclasses.
    verdict = ""

    def __init__(self, node: int, line: str, attempts: int, last: str) -> None:
        self.node = node
        self.line = line
        self.attempts = attempts
        self.last = last
        times = "once" if attempts == 1 else f"{attempts} times"
        what = repr(line) if line else "the empty line"
        super().__init__(f"node {node}: {what} sent {times}, last answer {last}: {self.verdict}")


class Refused(_Unanswered):
    """NAK: the packet arrived damaged, every time. The node has not acted."""

    verdict = "not executed; check the line, or the node's CRC setting"


class NoAnswer(_Unanswered, TimeoutError):
    """Silence, and ``refusals`` times NAK. What was asked may be asked again without harm."""

    verdict = "nobody at that address, its ACK is switched off, or the baud rate is another"

    def __init__(self, node: int, line: str, attempts: int, last: str, refusals: int = 0) -> None:
        self.refusals = refusals
        if refusals:
            # Somebody is there: it is the line that is bad.
            self.verdict = (
                f"NAK {refusals} of {attempts} times, and silence; "
                "check the line, and send it again, which does no harm"
            )
        super().__init__(node, line, attempts, last)


class UnknownOutcome(_Unanswered, TimeoutError):
    """Silence, and the node may have executed the command, which must not run twice, or not.

    SAC has no sequence numbers, so a lost ACK cannot be told from a lost packet.
    """

    verdict = "it may have been executed; look at the node before you send it again"


class NotStarted(MotherError):
    """Of several nodes that were to start together none has: ``node`` failed, ``cause`` says how.

    ``still_held``: nodes that may be held at sync, since they did not acknowledge the S that was
    sent to them then; they would start with the next ``y``.
    """

    def __init__(self, node: int, cause: MotherError, still_held: tuple[int, ...] = ()) -> None:
        self.node = node
        self.cause = cause
        self.still_held = still_held
        told = f"nothing was started: {cause}"
        if still_held:
            which = ", ".join(map(str, still_held))
            told += f"; {which} may still be held at sync, send S before the next y"
        super().__init__(told)


class Stopped(MotherError):
    """An emergency stop came while this waited for its turn: it has not been sent, and will not be.

    ``node`` is 0 for a broadcast. Without a ``line``: what was waited for is not going to happen.
    """

    def __init__(self, node: int, line: str) -> None:
        self.node = node
        self.line = line
        whom = f"node {node}" if node else "all nodes"
        told = f"{whom}: {line!r} was not sent: an emergency stop came first; send it again"
        if not line:
            told = "an emergency stop came first: the motion is not over; begin again"
        super().__init__(f"{told} once the machine may move")


class LineLost(MotherError, ConnectionError):
    """The link to the line is gone."""
