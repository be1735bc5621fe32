"""Look-ahead: how fast each stretch of a block may be run so that all of it can be.

Owns the velocities. A block begins and ends at rest: by a ramp in its first and in its last
stretch, where they have room for one, else by a jump. What lies between is run at constant
velocities, because a ramp between two velocities cannot be had from a node for all axes alike. So
a stretch is *flat*, or it is a *hump*: from the velocity that it is entered with up some stairs,
level, down some stairs. Every stair is a command; a hump has to be worth them.

Theory of operation. Every rule is an upper bound of one velocity by its neighbour's, and rises with
it: along a stretch (acceleration), and over a corner (`Corner`). So the highest velocities that
obey all of them are found by starting from the limits of each stretch and going over the block,
backwards and forwards, until nothing comes down any more. Two rounds nearly always do. Where two
rules of one corner go on bringing each other down in ever smaller steps, the path is made to go
through it without a change of velocity, which all of them allow.
Source: spec, mother ("G-code": look-ahead).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import ceil, inf, sqrt
from typing import Final

from sacbus.toolpath.corner import Corner
from sacbus.toolpath.law import Law, Phase
from sacbus.toolpath.line import CRUISE
from sacbus.toolpath.machine import Axis
from sacbus.toolpath.stretch import Stretch, jump_of

__all__ = ["has_room", "law_of", "must_rest", "worth_a_rest"]

RAMP_STEPS: Final = 12
"""A stretch with fewer steps on its busiest axis has no room: a ramp would end as it began."""

REST_BELOW: Final = 2.0
"""A corner that is not passed at more than this times the velocity of a start is no corner to save
a rest at: between stretches with room the path rests there. Two: it bends by some 30 degrees."""

STAIR_SECONDS: Final = 0.03
"""A hump saves as much for each of its stairs, or is none: 29 commands cost a rest, as below."""

WORTH: Final = 0.1
"""And this part of the stretch's time: what goes up and down all along an arc shows on the work."""

REST_SECONDS: Final = 0.25
"""What a rest costs, by estimate: the barrier itself, and the ramps of the neighbours."""

PATIENCE: Final = 3
"""Rounds before a corner that goes on bringing velocities down is gone through at one velocity."""

ROUNDS: Final = 64
"""Rounds come to an end by themselves; this many are not needed by any block."""

SETTLED: Final = 1e-6
"""A velocity that came down by less than this part did not come down."""


def must_rest(first: Stretch, corner: Corner, second: Stretch) -> bool:
    """Whether the path comes to rest between two stretches, and a block ends there."""
    if corner.through >= min(_top(first), _top(second)):
        return False
    if not (has_room(first) or has_room(second)):
        return False
    return corner.through < REST_BELOW * min(first.start, second.start)


def law_of(
    axes: Sequence[Axis], block: Sequence[Stretch], corners: Sequence[Corner], cap: float = inf
) -> Law:
    """The law of a block, from rest to rest; no faster than ``cap`` mm/s anywhere.

    ``corners``: those within the block, one fewer than stretches.
    """
    humps = [has_room(stretch, cap) for stretch in block]
    paces = _Paces(axes, block, corners, humps, cap)
    paces.settle()
    worth = [hump and paces.is_worth_a_hump(i) for i, hump in enumerate(humps)]
    if worth != humps:
        paces = _Paces(axes, block, corners, worth, cap)
        paces.settle()
    return tuple(phase for i in range(len(block)) for phase in paces.phases(i))


def worth_a_rest(block: Sequence[Stretch], law: Law) -> int | None:
    """The first stretch that would be over so much sooner between two rests that they pay."""
    seconds = [0.0] * len(block)
    for phase in law:
        seconds[phase.segment] += phase.seconds
    for i, stretch in enumerate(block):
        if seconds[i] > REST_SECONDS and seconds[i] > _alone(stretch) + REST_SECONDS:
            return i
    return None


def _alone(stretch: Stretch) -> float:
    """Seconds that a stretch takes from rest to rest."""
    top, acceleration, length = _top(stretch), stretch.acceleration, stretch.length
    if not has_room(stretch):
        return length / min(top, stretch.start)
    if top * top > acceleration * length:
        return 2 * sqrt(length / acceleration)
    return length / top + top / acceleration


def has_room(stretch: Stretch, cap: float = inf) -> bool:
    """Whether a stretch is long enough for ramps, and asks for a velocity that needs any."""
    return stretch.most_steps >= RAMP_STEPS and _top(stretch, cap) > stretch.start


def _top(stretch: Stretch, cap: float = inf) -> float:
    return min(stretch.feed, stretch.limit, cap)


@dataclass(slots=True)
class _Paces:
    """The velocities at both ends of each stretch, in mm/s.

    A flat stretch has the same at both, but for the one that begins, or ends, at rest with a ramp.
    """

    axes: Sequence[Axis]
    block: Sequence[Stretch]
    corners: Sequence[Corner]
    humps: Sequence[bool]
    cap: float
    entry: list[float] = field(init=False)
    leave: list[float] = field(init=False)
    _rigid: list[bool] = field(init=False)

    def __post_init__(self) -> None:
        tops = [_top(stretch, self.cap) for stretch in self.block]
        self.entry, self.leave = tops, tops.copy()
        # From rest, and to rest, with a ramp or by one jump.
        first, last = self.block[0], self.block[-1]
        ramped = has_room(first, self.cap), has_room(last, self.cap)
        self.entry[0] = 0.0 if ramped[0] else min(tops[0], first.start)
        self.leave[-1] = 0.0 if ramped[1] else min(self.leave[-1], last.start)
        self._rigid = [not hump for hump in self.humps]
        self._rigid[0] &= not ramped[0]
        self._rigid[-1] &= not ramped[1]

    def settle(self) -> None:
        """Bring the velocities down to where they obey all rules."""
        for i, corner in enumerate(self.corners):
            if not (self._rigid[i] or self._rigid[i + 1]):
                self._level(i, corner)
        for spent in range(ROUNDS):
            lowered = self._backwards() | self._forwards()
            if not lowered:
                return
            if spent >= PATIENCE:
                for i in lowered:
                    self._level(i, self.corners[i])

    def _level(self, i: int, corner: Corner) -> None:
        """Have a corner gone through at one velocity, but for what may be jumped from rest."""
        level = max(corner.through, min(self.block[i].start, self.block[i + 1].start))
        self.leave[i] = min(self.leave[i], level)
        self.entry[i + 1] = min(self.entry[i + 1], level)

    def _backwards(self) -> set[int]:
        """Go over the block from its end; the corners before which a velocity came down."""
        lowered = set()
        entry, leave = self.entry, self.leave
        for i in range(len(self.block) - 1, -1, -1):
            entry[i] = min(entry[i], self._along(i, leave[i]))
            if i:
                before = leave[i - 1]
                bound = min(
                    self.corners[i - 1].reaches(entry[i]),
                    self._over(i - 1, entry[i], self.block[i - 1].start),
                )
                if bound < before:
                    leave[i - 1] = bound
                    if bound < before * (1 - SETTLED):
                        lowered.add(i - 1)
        return lowered

    def _forwards(self) -> set[int]:
        """Go over the block from its beginning; the corners behind which a velocity came down."""
        lowered = set()
        entry, leave = self.entry, self.leave
        for i in range(len(self.block)):
            leave[i] = min(leave[i], self._along(i, entry[i]))
            if i + 1 < len(self.block):
                before = entry[i + 1]
                bound = min(
                    self.corners[i].leaves(leave[i]),
                    self._over(i, leave[i], self.block[i + 1].start),
                )
                if bound < before:
                    entry[i + 1] = bound
                    if bound < before * (1 - SETTLED):
                        lowered.add(i)
        return lowered

    def _along(self, i: int, other_end: float) -> float:
        """The highest velocity at one end of a stretch, given that at the other."""
        if self._rigid[i]:
            return other_end
        stretch = self.block[i]
        return sqrt(other_end * other_end + 2 * stretch.acceleration * stretch.length)

    def _over(self, i: int, other_side: float, start: float) -> float:
        """The highest velocity on one side of corner ``i`` by the acceleration, given the other's.

        A flat stretch stands for a ramp through its middle. Up to ``start``, which is borne from
        rest, nothing is asked.
        """
        first, second = self.block[i], self.block[i + 1]
        between = 0.0
        if self._rigid[i]:
            between += first.length / 2
        if self._rigid[i + 1]:
            between += second.length / 2
        acceleration = min(first.acceleration, second.acceleration)
        return max(start, sqrt(other_side * other_side + 2 * acceleration * between))

    def is_worth_a_hump(self, i: int) -> bool:
        """Whether a stretch saves enough time by a hump for what its stairs cost."""
        stretch, peak = self.block[i], self._peak(i)
        lasts = stairs = 0.0
        flat = min(self.entry[i], self.leave[i]) or max(self.entry[i], self.leave[i])
        if not flat:
            return True
        for slow in (self.entry[i], self.leave[i]):
            lasts += (peak - slow) / stretch.acceleration
            stairs += self._stairs(i, slow, peak) if slow else 0
        level = stretch.length - sum(
            self._ramp(i, slow, peak) for slow in (self.entry[i], self.leave[i])
        )
        lasts += level / peak
        flatly = stretch.length / flat
        if not (self.entry[i] and self.leave[i]):
            flatly += flat / stretch.acceleration / 2
        return flatly - lasts > max(STAIR_SECONDS * stairs, WORTH * flatly)

    def _peak(self, i: int) -> float:
        """The highest velocity of a hump."""
        stretch = self.block[i]
        slower = self.entry[i] ** 2 + self.leave[i] ** 2
        ramps = stretch.length
        if not (self.entry[i] and self.leave[i]):
            ramps *= 1 - CRUISE
        reached = sqrt(stretch.acceleration * ramps + slower / 2)
        return max(self.entry[i], self.leave[i], min(_top(stretch, self.cap), reached))

    def _ramp(self, i: int, slow: float, fast: float) -> float:
        """The length of a ramp between two velocities."""
        return (fast * fast - slow * slow) / (2 * self.block[i].acceleration)

    def _stairs(self, i: int, slow: float, fast: float) -> int:
        """How many jumps, none of them too high for any axis, lead from one to the other."""
        highest = max(
            abs(rate) / jump_of(axis)
            for axis, rate in zip(self.axes, self.block[i].rates, strict=True)
        )
        return ceil((fast - slow) * highest - 1e-9)

    def phases(self, i: int) -> list[Phase]:
        """What a stretch does, from its beginning to its end."""
        entry, leave = self.entry[i], self.leave[i]
        if self.humps[i]:
            peak = self._peak(i)
        else:
            peak = min(entry, leave) or max(entry, leave) or self._peak(i)
        stretch = self.block[i]
        up, down = self._climb(i, entry, peak), self._climb(i, leave, peak)[::-1]
        climbs = sum(seconds * (v0 + v1) / 2 for seconds, v0, v1 in (*up, *down))
        level = max(0.0, stretch.length - climbs)
        parts = [*up, (level / peak, peak, peak), *((dt, v1, v0) for dt, v0, v1 in down)]
        phases: list[Phase] = []
        begin, gone = 0.0, 0.0
        for seconds, v0, v1 in parts:
            gone += seconds * (v0 + v1) / 2
            end = min(1.0, gone / stretch.length)
            if end - begin > SETTLED:
                phases.append(Phase(i, begin, end, seconds, v0, v1))
                begin = end
        if phases[-1].end != 1.0:
            phases[-1] = replace(phases[-1], end=1.0)
        return phases

    def _climb(self, i: int, slow: float, peak: float) -> list[tuple[float, float, float]]:
        """From a velocity to the peak, as (s, from mm/s, to mm/s): a ramp from rest, else stairs.

        The middles of the stairs lie on the ramp they stand for; the highest is the level itself.
        """
        if slow >= peak:
            return []
        seconds = (peak - slow) / self.block[i].acceleration
        if not slow:
            return [(seconds, 0.0, peak)]
        count = self._stairs(i, slow, peak)
        stairs = []
        for k in range(count):
            pace = slow + (peak - slow) * k / count
            stairs.append((seconds / count / (1 if k else 2), pace, pace))
        return stairs
