"""A profile: one command's pulses, asked about at any time.

Owns the answers; what a cut leaves is worked out in cuts.py. A profile is immutable: cutting into
one gives another, which equals the first up to the cut. Times are ticks (0.5 us) from the first
pulse, totals are Python ints. An instant belongs to what begins at it: a pulse issued at tick t
counts as done at t, and a cut at t leaves it standing.
Source: spec, "What an implementation must be able to answer".
"""

from functools import lru_cache
from typing import Final, Self

import numpy as np

from sacbus.language import Motion
from sacbus.motion.course import Course, Place
from sacbus.motion.cuts import retargeted, rpm_of, slowed_down
from sacbus.motion.drive import TICKS_PER_US, Drive, Rpm, has_ramp
from sacbus.motion.layout import lay_out
from sacbus.motion.legs import Leg, State
from sacbus.motion.limits import COARSE_ABOVE_RPM, Caution, cautions, harmless, of_velocity
from sacbus.motion.ramp import Ticks64
from sacbus.motion.shares import Shares

WINDOW_END: Final = 1 << 62
"""Pulse times are handed out as int64; a window beyond this many ticks is refused (spec)."""


class Profile:
    """What a command does, pulse by pulse, without any pulse being kept.

    motion, drive, start_rpm: what was planned. shares: how it was shared out. duration: ticks to
    the end of the last period, None when continuous. kept_rpm: the velocity left for the next
    command, 0 when it ends decelerated.
    """

    __slots__ = ("_course", "drive", "duration", "kept_rpm", "motion", "shares", "start_rpm")

    def __init__(
        self,
        motion: Motion,
        drive: Drive,
        start_rpm: Rpm,
        shares: Shares,
        duration: int | None,
        kept_rpm: Rpm,
        course: Course | None = None,
    ) -> None:
        """For `plan` and the cuts, which see to it that the parts agree."""
        self.motion: Final = motion
        self.drive: Final = drive
        self.start_rpm: Final = start_rpm
        self.shares: Final = shares
        self.duration: Final = duration
        self.kept_rpm: Final = kept_rpm
        self._course = course

    @classmethod
    def laid_out(
        cls, motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares, kept_rpm: Rpm
    ) -> Self:
        """A profile whose duration its legs tell."""
        course = Course(lay_out(motion, drive, start_rpm, shares))
        duration = None if shares.cruise is None else course.began[-1]
        return cls(motion, drive, start_rpm, shares, duration, kept_rpm, course)

    @classmethod
    def of_legs(
        cls, motion: Motion, drive: Drive, legs: list[Leg], duration: int | None
    ) -> "Profile":
        """A profile of known legs, as :mod:`sacbus.motion.stored` reads one back.

        It answers what is asked about its pulses; what is kept for the next command is not known.
        """
        course = Course(legs)
        acc, dec = course.pulses_in(State.ACCEL), course.pulses_in(State.DECEL)
        cruise = None if course.pulses is None else course.pulses_in(State.CRUISE)
        shares = Shares(acc, cruise, dec, 0, 1, accelerates=acc > 0, truncated=False)
        return cls(motion, drive, 0, shares, duration, 0, course)

    @property
    def is_laid_out(self) -> bool:
        """Whether its legs are there: of one that was cut into, or asked about its pulses."""
        return self._course is not None

    @property
    def course(self) -> Course:
        """The legs, laid out when first asked for."""
        course = self._course
        if course is None:
            legs = lay_out(self.motion, self.drive, self.start_rpm, self.shares)
            course = self._course = Course(legs)
        return course

    @property
    def n_acc(self) -> int:
        """Steps of acceleration: full steps, or pulses in pulse mode and of a profile cut into."""
        return self.shares.acc

    @property
    def n_cruise(self) -> int | None:
        """Steps at speed, extra pulses apart; None = for ever."""
        return self.shares.cruise

    @property
    def n_dec(self) -> int:
        """Steps of deceleration."""
        return self.shares.dec

    @property
    def pulses(self) -> int | None:
        """All pulses, extra ones included; None = for ever."""
        # With auto-micro the steps do not tell how many pulses they are made of.
        return self.course.pulses if self.drive.auto_micro else self.shares.pulses

    @property
    def peak_rpm(self) -> float:
        """The fastest the motor turns, by the real periods of its pulses; 0 without a pulse."""
        paces = (
            Place(leg, at).pace for leg in self.course.legs for at in (0, (leg.count or 1) - 1)
        )
        return max((self.drive.real_rpm(pace.period, pace.weight) for pace in paces), default=0.0)

    @property
    def last_period(self) -> int:
        """Real ticks of the last pulse, against which GAP is measured; 0 without a pulse.

        Of a continuous profile that of its cruise.
        """
        legs = self.course.legs
        return Place(legs[-1], (legs[-1].count or 1) - 1).pace.period if legs else 0

    @property
    def warnings(self) -> tuple[Caution, ...]:
        """What the command asks of the hardware that it cannot give; found when asked for."""
        motion, drive = self.motion, self.drive
        asked = motion, drive, self.start_rpm, self.shares
        if harmless(*asked):
            found: tuple[Caution, ...] = ()
        elif self._course is None:
            found = _planned_cautions(*asked)
        else:
            found = tuple(cautions(*asked, self._course))
        if motion.rpm > COARSE_ABOVE_RPM and self.pulses != 0:
            found += tuple(of_velocity(motion, drive))
        return found

    def time_of(self, pulse: int) -> int:
        """When a pulse is issued; that of the first pulse not issued is the end.

        IndexError for a pulse the command does not have.
        """
        pulses = self.pulses
        if pulse < 0 or (pulses is not None and pulse > pulses):
            raise IndexError(f"the profile has {pulses} pulses, asked for number {pulse}")
        if pulse == pulses and self.duration is not None:
            return self.duration
        return self.course.time(pulse)

    def pulses_at(self, ticks: int) -> int:
        """Pulses done at a time: all that are issued until then, the instant included."""
        if ticks < 0:
            return 0
        if self.duration is not None and ticks >= self.duration:
            return self.pulses or 0
        return self.course.pulse_running(ticks) + 1

    def travel_at(self, ticks: int) -> int:
        """How far the pulses done at a time turn the motor, in the finest microsteps (drive.py).

        As many as there are pulses, except with auto-micro.
        """
        return self.course.travel(self.pulses_at(ticks))

    def state_at(self, ticks: int) -> State:
        """The state at a time: STOP at the instant the command ends, STANDBY before and after."""
        if ticks == self.duration:
            return State.STOP
        return self.course.place_at(ticks).leg.state if self._moves(ticks) else State.STANDBY

    def velocity_at(self, ticks: int) -> float:
        """RPM at a time, by the real period of the pulse that runs; 0 before and after."""
        if not self._moves(ticks):
            return 0.0
        pace = self.course.place_at(ticks).pace
        return self.drive.real_rpm(pace.period, pace.weight)

    def ustep_at(self, ticks: int) -> int:
        """The exponent of the microsteps at a time; the drive's own before and after.

        Auto-micro changes it on the way.
        """
        weight = self.course.place_at(ticks).leg.weight if self._moves(ticks) else 1
        return self.drive.ustep - weight.bit_length() + 1

    def pulse_times(self, since: int, until: int) -> Ticks64:
        """The times of all pulses in [since, until), rising, as int64.

        ValueError for a window that reaches beyond 2**62 ticks: some 73 000 years.
        """
        if until > WINDOW_END:
            raise ValueError(f"pulse times end at 2**62 ticks, asked for some until {until}")
        return self.course.times(since, until)

    def clk_falls(self, since: int, until: int) -> Ticks64:
        """When clk falls again after each of `pulse_times(since, until)`.

        The width of the pulse later, but one tick before the next pulse where that would be too
        late (decision).
        """
        rises = self.pulse_times(since, until)
        if not rises.size:
            return rises
        falls = rises + self.drive.pulse_us * TICKS_PER_US
        following = self.course.time(self.pulses_at(int(rises[-1])))
        falls[-1] = min(int(falls[-1]), following - 1)
        np.minimum(falls[:-1], rises[1:] - 1, out=falls[:-1])
        return falls

    def halt(self, ticks: int) -> "Profile":
        """Stopped with prejudice (S, e-stop): no pulse after `ticks`, ended there, nothing kept."""
        return self if self._over(ticks) else self._ended(self.pulses_at(ticks), ticks, 0)

    def cut(self, ticks: int) -> "Profile":
        """Ended for the next command (N, X): the present pulse is the last, its velocity kept.

        The period of that pulse still runs out, so that the next pulse comes no closer to it.
        """
        if self._over(ticks):
            return self
        pulses = self.pulses_at(ticks)
        return self._ended(pulses, self.course.time(pulses), self._rpm_of(pulses - 1))

    def slow_down(self, ticks: int, dec100: int, *, linear: bool) -> "Profile":
        """Ended with grace (s, n, bare L): decelerated from the velocity at `ticks`.

        dec100 in hundredths, RPM a step or rad/s2; 999 ends it without a ramp and keeps the
        velocity. In full-step mode the motor ends on a full step, counted from the command's
        beginning; the pulses up to it run no faster than the velocity reached.
        """
        issued = self.pulses_at(ticks)
        if self._over(ticks) or issued == self.pulses:
            return self
        legs = slowed_down(self.course, issued, self.motion, self.drive, dec100, linear=linear)
        return self._with(self.motion, legs, 0 if has_ramp(dec100) else self._rpm_of(issued - 1))

    def retarget(self, ticks: int, motion: Motion) -> "Profile":
        """Continuous motion given a new velocity: an ACCEL ramp from the one it has at `ticks`.

        ValueError unless both this profile and the motion are continuous.
        """
        if self.duration is not None or motion.steps is not None:
            raise ValueError("only continuous motion takes a new velocity while it runs")
        return self._with(
            motion, retargeted(self.course, self.pulses_at(ticks), motion, self.drive), 0
        )

    def tail(self, ticks: int) -> tuple[int, "Profile"]:
        """Continuous motion from a pulse at or before `ticks` on: that pulse, and the profile.

        Its tick 0 is the pulse's. What re-targeting has piled up before is not in it. The pulse is
        the first of a full step, counted from the command's beginning, so that what counts from
        there goes on doing so.
        """
        course, m = self.course, self.drive.m
        running = course.pulse_running(ticks)
        first = course.pulse_after(course.travel(running) // m * m)
        cut = self._with(self.motion, course.legs_after(first), 0)
        start_rpm = self._rpm_of(first)
        return first, Profile(self.motion, self.drive, start_rpm, cut.shares, None, 0, cut.course)

    def _rpm_of(self, pulse: int) -> Rpm:
        return rpm_of(self.course.place_of(pulse), self.drive)

    def _ended(self, pulses: int, duration: int, kept_rpm: Rpm) -> "Profile":
        """Cut off after some pulses; a cut profile counts its shares in pulses."""
        course = Course(self.course.legs_of_first(pulses))
        return self._of(self.motion, course, course.pulses_in(State.CRUISE), duration, kept_rpm)

    def _with(self, motion: Motion, legs: list[Leg], kept_rpm: Rpm) -> "Profile":
        """Gone on with other legs, to their end if they have one."""
        course = Course(legs)
        if legs[-1].count is None:
            return self._of(motion, course, None, None, kept_rpm)
        cruise = course.pulses_in(State.CRUISE)
        return self._of(motion, course, cruise, course.began[-1], kept_rpm)

    def _of(
        self,
        motion: Motion,
        course: Course,
        cruise: int | None,
        duration: int | None,
        kept_rpm: Rpm,
    ) -> "Profile":
        acc, dec = course.pulses_in(State.ACCEL), course.pulses_in(State.DECEL)
        shares = Shares(acc, cruise, dec, 0, 1, accelerates=acc > 0, truncated=False)
        return Profile(motion, self.drive, self.start_rpm, shares, duration, kept_rpm, course)

    def _moves(self, ticks: int) -> bool:
        return ticks >= 0 and (self.duration is None or ticks < self.duration)

    def _over(self, ticks: int) -> bool:
        """True when a cut comes too late; ValueError when it comes too early."""
        if ticks < 0:
            raise ValueError(f"a command cannot be cut into before its first pulse, at {ticks}")
        return self.duration is not None and ticks >= self.duration


@lru_cache(maxsize=1_024)
def _planned_cautions(
    motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares
) -> tuple[Caution, ...]:
    """What may not work of a profile as it was planned: of a loop's the same each time."""
    course = Course(lay_out(motion, drive, start_rpm, shares))
    return tuple(cautions(motion, drive, start_rpm, shares, course))
