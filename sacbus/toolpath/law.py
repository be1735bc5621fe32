"""The law of motion of a block: how fast the tool goes along its path, from rest to rest.

Owns the law as a value, made of phases of constant acceleration. Which velocities a path allows is
worked out beside it; how an axis follows a law with commands, too.
Source: spec, mother ("Straight lines").
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Law", "Phase"]


@dataclass(frozen=True, slots=True)
class Phase:
    """A part of a segment that is run at constant acceleration.

    segment: its index in the block. begin, end: where the part begins and ends, as fractions of
    the segment, 0 to 1, rising. seconds: how long it takes. v0, v1: mm/s along the path at its
    ends.
    """

    segment: int
    begin: float
    end: float
    seconds: float
    v0: float
    v1: float


Law = tuple[Phase, ...]
"""The phases of a block, one after the other; at both ends rest, or one jump from it."""
