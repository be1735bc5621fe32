"""Steps of whatever moves: the pulses of several axes as one stream, some at a time.

Owns how long a stretch of time is looked at, so that memory stays the same however long it all is.
What moves is anything that knows its pulses, such as a node's track in a recording.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, Protocol

from sacbus.simad.steps import Steps, merge

if TYPE_CHECKING:
    from sacbus.simad.steps import Times

__all__ = ["Moves", "steps_of"]

#: Steps that are handed out at a time, about, and the shortest and longest time looked at, in ns.
MANY: Final = 200_000
SHORTEST: Final = 1_000_000
LONGEST: Final = 600_000_000_000


class Moves(Protocol):
    """An axis that knows when it stepped, and which way."""

    def pulses(self, since: int, until: int) -> Times:
        """When it stepped in [since, until), rising: ns."""
        ...

    def directions(self, since: int, until: int) -> Times:
        """For each of these +1 for clockwise, else -1."""
        ...


def steps_of(axes: Sequence[Moves], since: int, until: int) -> Iterator[Steps]:
    """All steps in [since, until), ns, in the order of time; an axis is its place in ``axes``."""
    span = 1_000_000_000
    while since < until:
        end = min(since + span, until)
        steps = merge(
            [axis.pulses(since, end) for axis in axes],
            [axis.directions(since, end) for axis in axes],
        )
        if steps.count:
            yield steps
        if steps.count > MANY:
            span = max(span // 2, SHORTEST)
        elif steps.count < MANY // 4:
            span = min(span * 2, LONGEST)
        since = end
