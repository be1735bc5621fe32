"""A corner: which velocities before it and after it its axes bear without a ramp.

Owns that rule for two stretches that follow each other: no axis changes its velocity by more than
its jump. Velocities are mm/s along the path, which may differ on the two sides.
Source: spec, mother ("G-code": seamless "up to the speed that the corner allows").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from sacbus.toolpath.machine import Axis
from sacbus.toolpath.stretch import Stretch, jump_of

__all__ = ["Corner", "corner_of"]


@dataclass(frozen=True, slots=True)
class Corner:
    """The rule of one corner.

    through: the velocity at which the path may go through it without a change. before, after: what
    the two sides never exceed: for axes that turn round, begin or end there, and because what one
    axis would gain by a higher velocity on the other side is more than another one bears. shared:
    of each axis that goes on in its direction, (jump in RPM, RPM for each mm/s before, and after).
    """

    through: float
    before: float
    after: float
    shared: tuple[tuple[float, float, float], ...]

    def leaves(self, arriving: float) -> float:
        """The highest velocity after the corner if it is reached at ``arriving``."""
        highest = self.after
        for jump, before, after in self.shared:
            highest = min(highest, (jump + arriving * before) / after)
        return highest

    def reaches(self, leaving: float) -> float:
        """The highest velocity before the corner if it is left at ``leaving``."""
        highest = self.before
        for jump, before, after in self.shared:
            highest = min(highest, (jump + leaving * after) / before)
        return highest


def corner_of(axes: Sequence[Axis], first: Stretch, second: Stretch) -> Corner:
    """The corner between two stretches."""
    through = before = after = inf
    shared = []
    for axis, rate, next_rate in zip(axes, first.rates, second.rates, strict=True):
        jump = jump_of(axis)
        change = abs(rate - next_rate)
        if change * through > jump:
            through = jump / change
        if rate * next_rate > 0:
            shared.append((jump, abs(rate), abs(next_rate)))
            continue
        # It stops, starts or turns round: both velocities together are the jump.
        if rate:
            before = min(before, jump / change)
        if next_rate:
            after = min(after, jump / change)
    for jump, slowing, slowed in shared:
        for other_jump, quickening, quickened in shared:
            # One axis bears so much less after than before, the other so much more.
            excess = slowing * quickened - quickening * slowed
            if excess > 0:
                before = min(before, (jump * quickened + other_jump * slowed) / excess)
                after = min(after, (jump * quickening + other_jump * slowing) / excess)
    return Corner(through, before, after, tuple(shared))
