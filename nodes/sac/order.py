"""The order of commands: where they come from, and what interferes with it to what effect.

Owns the table of that, which is the whole truth: the command processor does what it says, and
docs/command-processor.md shows it. Source: manual, "Loop", "xRef", "Continuous", "S/s", "N/s",
Appendix C; spec, "Loops and references".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

__all__ = ["RULES", "Cue", "LoopFate", "Present", "Rule", "Source"]


class Source(Enum):
    """Where the command comes from that runs, waits for its start or is held at sync."""

    STANDBY = "nowhere: nothing runs"
    CONTINUOUS = "M without steps"
    ONCE = "X: a referenced or a throw-away command"
    LOOP = "a loop, over the queue or the xRef array"
    QUEUE = "the queue"


class Cue(Enum):
    """What interferes with the order. A command that is put into the queue does not."""

    CONTINUOUS = "M without steps"
    ONCE = "Xnn, XM"
    NEXT = "N, n"
    END = "L"
    STOP = "S, s, e-stop, $"


class Present(Enum):
    """What becomes of the command that runs."""

    GOES_ON = "goes on to its end"
    CUT = "ends with its present pulse, its velocity kept"
    ENDS = "ends: N with its present pulse, n with its own deceleration"
    SLOWS = "ends with its own deceleration"
    STOPS = "ends: s with the session's deceleration, else at once"


class LoopFate(Enum):
    """What becomes of the loop, if there is one."""

    GOES_ON = "goes on"
    ONE_MORE = "goes on for one more command"
    ENDS = "ends"


@dataclass(frozen=True, slots=True)
class Rule:
    """What a cue does: to the present command, to the loop, to what waits in the queue.

    ``waits``: whether pending commands stay pending.
    """

    present: Present
    loop: LoopFate
    waits: bool = True


_GO_BEFORE: Final = Rule(Present.CUT, LoopFate.GOES_ON)
_NEXT: Final = Rule(Present.ENDS, LoopFate.GOES_ON)
_END: Final = Rule(Present.GOES_ON, LoopFate.ENDS)
_STOP: Final = Rule(Present.STOPS, LoopFate.ENDS, waits=False)

#: Continuous motion is an on/off switch, "not interrupt-and-return" (manual, "Continuous"): what
#: ends it decides about what it interrupted. X does return, so it leaves loop and queue alone.
RULES: Final[Mapping[tuple[Source, Cue], Rule]] = {
    **{(source, Cue.CONTINUOUS): _GO_BEFORE for source in Source},
    **{(source, Cue.ONCE): _GO_BEFORE for source in Source},
    **{(source, Cue.NEXT): _NEXT for source in Source},
    (Source.CONTINUOUS, Cue.NEXT): Rule(Present.ENDS, LoopFate.ONE_MORE),
    **{(source, Cue.END): _END for source in Source},
    (Source.CONTINUOUS, Cue.END): Rule(Present.SLOWS, LoopFate.ENDS, waits=False),
    **{(source, Cue.STOP): _STOP for source in Source},
}
