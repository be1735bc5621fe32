"""An axis follows a law: the commands whose pulses come when the ideal motion asks for them.

Owns how an axis's share of a law becomes commands: real ramps from rest and to rest where the motor
is faster than its slow speed, pieces of constant velocity elsewhere, start waits where it stands
still. Pulse k of a sweep is due when its ideal place is k + 1/2 pulses.
Source: spec, mother ("Straight lines"); docs/lines.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from math import inf
from typing import Final

from sacbus.motion import NO_RAMP, TICKS_PER_US, plan
from sacbus.toolpath.block import AxisRun
from sacbus.toolpath.climb import Climb, climb
from sacbus.toolpath.commands import Commands
from sacbus.toolpath.cruise import cycle_least, split
from sacbus.toolpath.law import Law
from sacbus.toolpath.machine import Axis
from sacbus.toolpath.share import TICKS_PER_SECOND, Part, Sweep, sweeps

__all__ = ["COMMANDS_MAX", "follow"]

#: The queue has 30 positions, and that behind a block's last command must hold.
COMMANDS_MAX: Final = 29

#: Full steps by which pieces of constant velocity may be off an ideal acceleration to either side,
#: and a cruise off its mean for its two cycles. Where that takes too many commands, twice as much,
#: and so on, up to what can be of no use.
_APART: Final = 0.1
_USELESS: Final = 1_000.0

#: rad/s2 that no command's acceleration reaches: 999 is none.
_STEEPEST: Final = 998.0

#: Ticks by which the last period may run out after the ideal end: else the last step is given a
#: shorter one. Nobody can tell that a period runs out, but everybody waits for it.
_LATE: Final = 30_000 * TICKS_PER_US

#: Part of an axis's jump by which the law's velocities may differ that one command stands for: else
#: two jumps of the law would become one.
_ALIKE: Final = 0.25

#: Part of an axis's jump by which it goes faster or slower than its share to be on time again: what
#: a command cannot make good by then is left to the next one.
_AHEAD: Final = 0.5


def follow(
    axis: Axis,
    index: int,
    steps: Sequence[int],
    law: Law,
    *,
    acceleration: float | None = None,
    commands_max: int = COMMANDS_MAX,
) -> AxisRun | None:
    """What an axis of a block does; None if it does not move.

    index: of the axis in its machine. steps: signed full steps in each segment. acceleration: what
    its ramps have at most, in rad/s2, besides what its motor bears. Where it would take more than
    ``commands_max`` commands it follows less closely; where that does not help, there are more.
    """
    found = sweeps(steps, law)
    if not found:
        return None
    limits = (acceleration, axis.max_acceleration, _STEEPEST)
    top100 = int(min(limit for limit in limits if limit is not None) * 100 + 1e-6)
    apart = _APART
    while True:
        commands = Commands(axis)
        for sweep, following in zip_longest(found, found[1:]):
            _Follower(axis, commands, sweep, following, apart, max(1, top100)).follow()
        commands.come_to_rest()
        if len(commands.motions) <= commands_max or apart > _USELESS:
            return commands.run(index, sum(steps))
        apart *= 2


class _Follower:
    """One sweep of an axis on its way to commands.

    done: full steps of it that have theirs. following: the next sweep of the axis, if there is one.
    """

    def __init__(
        self,
        axis: Axis,
        commands: Commands,
        sweep: Sweep,
        following: Sweep | None,
        apart: float,
        top100: int,
    ) -> None:
        self._drive = axis.drive
        self._commands = commands
        self._sweep = sweep
        self._apart = apart
        self._top100 = top100
        self._least_us = cycle_least(axis.drive, axis.max_rpm)
        self._done = 0
        # Full steps a tick.
        jump = max(axis.jump, 1) * axis.drive.steps_per_rev / 60 / TICKS_PER_SECOND
        #: Velocities that are taken for one, and how far they may be from those of the law.
        self._alike, self._ahead = _ALIKE * jump, _AHEAD * jump
        #: Half a pulse, in full steps.
        self._half = 0.5 / axis.drive.m
        #: When the last period is to be over: lest the next sweep begins late.
        self._over = sweep.end + _LATE
        if following is not None:
            self._over = min(self._over, following.time(self._half))

    def follow(self) -> None:
        """Add the commands of the sweep."""
        sweep, commands = self._sweep, self._commands
        first, last = sweep.parts[0], sweep.parts[-1]
        # Ramps are not exact: each may take half of what lies between them.
        between = sweep.steps - first.way - last.way if len(sweep.parts) > 1 else 0.0
        up = down = None
        if first.v1 > first.v0:
            up = self._climb(first, sweep.steps, between)
        if last.v0 > last.v1 and (last is not first or up is None):
            left = sweep.steps - (up.steps if up else 0)
            down = self._climb(last, left, between, down=True)
        commands.turn(forward=sweep.forward)
        if up is None:
            commands.wait(sweep.time(self._half))
        else:
            commands.wait(first.begin + up.after)
            commands.climb(up.steps, up.rpm, up.acc100)
            self._done = up.steps
        if down is None:
            self._go_on(sweep.steps, None)
        else:
            brake = commands.brake(down.steps, down.rpm, down.acc100)
            ramp = plan(replace(brake, acc100=NO_RAMP), self._drive, down.rpm).duration
            assert ramp is not None  # it has steps
            self._go_on(sweep.steps - down.steps, sweep.end - down.after - ramp)
            commands.come_down(brake)

    def _climb(self, part: Part, most: int, between: float, *, down: bool = False) -> Climb | None:
        """The ramp at an end of the sweep, where it is one that takes steps."""
        most = min(most, round(part.way + between / 2.2) + 1)
        return climb(self._drive, part, most, self._top100, down=down)

    # ---- pieces of constant velocity ----

    def _go_on(self, upto: int, until: float | None) -> None:
        """Pieces of constant velocity up to a full step, which is due at a time.

        Each is aimed from the tick at which it really begins: what rounding has left of the one
        before is made good by the next, and never added up. Without a time, they end the sweep.
        """
        while self._done < upto:
            steps = self._reach(upto, until)
            ticks = self._borne(steps, self._due(steps, upto, until) - self._commands.next)
            for even in split(self._drive, steps, ticks, self._least_us, self._apart):
                self._commands.even(even.steps, even.cycle_us)
            self._done += steps

    def _borne(self, steps: int, ticks: float) -> float:
        """The time in which some full steps are made, if they should be in ``ticks``.

        An axis that is late or early by a step would make a jump of its own otherwise, when a
        single step is all that it has to make it good.
        """
        slowest, fastest = self._sweep.pace(self._done, self._done + steps)
        most = steps / (slowest - self._ahead) if slowest > self._ahead else inf
        return min(max(ticks, steps / (fastest + self._ahead)), most)

    def _reach(self, upto: int, until: float | None) -> int:
        """How many full steps one velocity will do for."""
        most = upto - self._done
        good, bad = 1, most + 1
        while good < most and bad > most:
            tried = min(2 * good, most)
            if self._does(tried, upto, until):
                good = tried
            else:
                bad = tried
        while bad - good > 1 and bad <= most:
            middle = (good + bad) // 2
            if self._does(middle, upto, until):
                good = middle
            else:
                bad = middle
        return good

    def _does(self, steps: int, upto: int, until: float | None) -> bool:
        """Whether an even motion over some full steps stays near the ideal one."""
        sweep, begin = self._sweep, self._done + self._half
        now, due = self._commands.next, self._due(steps, upto, until)
        if due <= now:
            return True
        cut = sweep.steps + self._half - sweep.at(due) if due == self._over else 0.0
        if cut > self._apart and steps > 1:
            return False  # it would show; so the last step is a command of its own
        if sweep.spread(begin, begin + steps - 2 * self._half) > self._alike:
            return False
        # What it is off at its ends is given; only what comes in between is this velocity's fault.
        off0 = sweep.at(now) - begin
        off1 = 0.0 if due > sweep.end else sweep.at(due) - begin - steps
        for place in sweep.between(begin, begin + steps):
            part = (place - begin) / steps
            off = sweep.at(now + part * (due - now)) - place
            if abs(off - off0 - part * (off1 - off0)) > 2 * self._apart:
                return False
        return True

    def _due(self, steps: int, upto: int, until: float | None) -> float:
        """When the step behind some more full steps is due."""
        sweep, behind = self._sweep, self._done + steps
        if behind < upto:
            return self._best_time(behind + self._half)
        if until is not None:
            return until
        if sweep.parts[-1].v1:
            return min(sweep.time(upto + self._half), self._over)
        # It slows down to rest: the last pulse tells how long the steps take. Its period runs out
        # when it does, if that is not further from the end than half of it, nor much too late.
        pulses = steps * self._drive.m
        if pulses == 1:
            return sweep.end
        now = self._commands.next
        natural = now + (sweep.time(upto - self._half) - now) * pulses / (pulses - 1)
        part = 0.5 / pulses
        early = (sweep.end + now * part) / (1 + part)
        late = (sweep.end - now * part) / (1 - part)
        return min(max(natural, early), late, self._over)

    def _best_time(self, place: float) -> float:
        """When a pulse is best issued where two pieces meet.

        An even motion between two places of an accelerated one is ahead of it, and behind a slowed
        one; so it begins and ends as much to the other side.
        """
        part = self._sweep.part(place)
        if part.v0 == part.v1:
            return part.time(place)
        aside = self._apart if part.v1 > part.v0 else -self._apart
        return part.time(min(max(place + aside, part.place), part.place + part.way))
