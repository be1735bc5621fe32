"""The commands of one axis in a block as they are added, with their exact times.

Owns how a piece of motion is worded as a command, and what of two pieces fits into one: a ramp and
the cruise behind it, a cruise and the ramp down. When each begins is `sacbus.motion`'s to say.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

from sacbus.language import Motion
from sacbus.motion import (
    NO_RAMP,
    TICKS_PER_US,
    Left,
    Profile,
    begin,
    load_ticks,
    plan,
    release,
)
from sacbus.toolpath.block import AxisRun
from sacbus.toolpath.machine import Axis

__all__ = ["Commands"]

#: With this deceleration a command of constant velocity comes to rest without a step of a ramp, at
#: any speed below 75 RPM: so it keeps nothing for whatever the node does next.
_AT_ONCE: Final = 99_800


class _Added(NamedTuple):
    """A command, when it is loaded, its first pulse, its end, and what it leaves."""

    motion: Motion
    loaded: int
    start: int
    profile: Profile
    end: int
    left: Left


class Commands:
    """The commands of an axis, the first held and released at tick 0."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._drive = axis.drive
        self._added: list[_Added] = []
        self._cw = True
        #: The start wait of the next command.
        self._wait_us = 0
        #: :attr:`next`, until something changes: it is asked for more often than that.
        self._next: int | None = None

    @property
    def motions(self) -> tuple[Motion, ...]:
        """All of them."""
        return tuple(added.motion for added in self._added)

    @property
    def next(self) -> int:
        """The tick at which a command of constant velocity that is added now would begin."""
        if self._next is None:
            draft = self._motion(1, 1, 0)
            draft = replace(draft, wait_us=self._wait_us)
            if self._added:
                last = self._added[-1]
                self._next = begin(draft, last.left, last.end).start
            else:
                self._next = release(draft, 0).start
        return self._next

    def run(self, axis: int, steps: int) -> AxisRun:
        """All of them as a part of a block."""
        return AxisRun(
            axis,
            self.motions,
            tuple(added.start for added in self._added),
            tuple(added.loaded for added in self._added),
            self._added[-1].end,
            steps,
        )

    def turn(self, *, forward: bool) -> None:
        """Go this way from the next command on."""
        self._cw = forward is not self._axis.inverted

    def wait(self, due: float) -> None:
        """Have the next command begin at a tick, if it is not too late for that."""
        self._wait_us, self._next = 0, None
        if not self._added:
            self._wait_us = max(0, round(due / TICKS_PER_US))
            return
        load = load_ticks(acceleration_changes=True)
        self._wait_us = max(0, round((due - self._added[-1].end - load) / TICKS_PER_US))

    def climb(self, steps: int, rpm: int, acc100: int) -> None:
        """A ramp from rest."""
        if self._added:
            self.come_to_rest()  # however soon it comes
        self._add(replace(self._motion(steps, self._cycle_of(rpm), rpm), acc100=acc100))

    def even(self, steps: int, cycle_us: int) -> None:
        """Some steps at a cycle; after a ramp to that very velocity in the same command."""
        rpm = 60_000_000 // (self._drive.steps_per_rev * cycle_us)
        last = self._last_to_go_on()
        if last is not None and last.motion.rpm == rpm and last.profile.n_cruise == 0:
            self._added.pop()
            whole = (last.motion.steps or 0) + steps
            self._put(replace(last.motion, steps=whole, cycle_us=cycle_us))
        else:
            self._add(self._motion(steps, cycle_us, rpm))

    def brake(self, steps: int, rpm: int, dec100: int) -> Motion:
        """A ramp to rest, for :meth:`come_down`."""
        return replace(self._motion(steps, self._cycle_of(rpm), rpm), dec100=dec100)

    def come_down(self, brake: Motion) -> None:
        """Come down to rest; at the end of the last command if that has the very velocity."""
        last = self._last_to_go_on()
        if last is not None and last.motion.rpm == brake.rpm:
            self._added.pop()
            steps = (last.motion.steps or 0) + (brake.steps or 0)
            self._put(replace(last.motion, steps=steps, dec100=brake.dec100))
        else:
            self._add(brake)

    def come_to_rest(self) -> None:
        """Have the last command leave nothing to what comes after the block."""
        if self._added[-1].motion.dec100 == NO_RAMP:
            last = self._added.pop()
            self._put(replace(last.motion, dec100=_AT_ONCE))

    def _last_to_go_on(self) -> _Added | None:
        """The last command, if what follows may be a part of it."""
        last = self._added[-1] if self._added else None
        if last is None or self._wait_us:
            return None
        same_way = last.motion.cw is self._cw
        return last if same_way and last.motion.dec100 == NO_RAMP else None

    def _motion(self, steps: int, cycle_us: int, rpm: int) -> Motion:
        return Motion(steps, self._cw, rpm, cycle_us, NO_RAMP, NO_RAMP, linear=True, by_cycle=True)

    def _cycle_of(self, rpm: int) -> int:
        return 60_000_000 // (self._drive.steps_per_rev * rpm)

    def _add(self, motion: Motion) -> None:
        """Add a command; it has the start wait that was asked for, and the first one is held."""
        wait, self._wait_us = self._wait_us, 0
        self._put(replace(motion, wait_us=wait, sync=not self._added))

    def _put(self, motion: Motion) -> None:
        if self._added:
            last = self._added[-1]
            beginning = begin(motion, last.left, last.end)
        else:
            beginning = release(motion, 0)
        profile = plan(motion, self._drive, beginning.start_rpm)
        assert profile.duration is not None  # it has steps
        end = beginning.start + profile.duration
        left = Left.by(profile)
        self._next = None
        self._added.append(_Added(motion, *beginning[:2], profile, end, left))
