"""The motion engine: the profile that is running, since when, and where the motor stands.

Owns the motor's position, the arithmetic between bus time and a profile's ticks, and the clock that
these are counted by. Which command runs, and why it ends, is the command processor's business.
Nothing here happens per pulse: positions are computed when somebody asks.

Positions are signed, clockwise positive, from 0 at power up: in pulses, as a counter at the clk pin
has them; in microsteps (of a full step's 2**ustep), of which a pulse is one except with auto-micro;
and the rotor's, which is another where the motor has stalled.
Source: manual, "Discussion" (the motion engine), "Timing", "clock".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from sacbus.kernel import Ns
from sacbus.motion import TICKS_PER_US, Entry, Profile, Slip, State, Timebase, lost, slips
from sacbus.motion.ramp import Ticks64

__all__ = ["FROM_REST", "Engine", "Standing", "Where"]

#: A tick of an oscillator without error.
NOMINAL: Final = Timebase()

#: Legs of a profile that are kept. Each new velocity of continuous motion adds two; beyond this
#: number what has been is folded into the position, so that it may go on changing for ever.
LEGS_KEPT: Final = 12


class Where(NamedTuple):
    """A position in pulses, in microsteps, and the rotor's in microsteps."""

    pulses: int = 0
    microsteps: int = 0
    rotor: int = 0


class _Left(NamedTuple):
    """How the last profile left the motor turning: until when, and how.

    rpm: signed, clockwise positive; 0 when it came to rest.
    """

    until: Ns = 0
    rpm: float = 0.0
    stalled: bool = False


class Standing(NamedTuple):
    """All that tells where an engine stands and how it goes on, as long as nobody interferes."""

    clock: Timebase
    rest: Where
    profile: Profile | None
    sign: int
    anchor: Ns
    tick: int
    started: Ns | None
    entry: Entry


#: What most engines hold most of the time, one for all of them.
_AT_ZERO: Final = Where()
_AT_REST: Final = _Left()
FROM_REST: Final = Entry()


class Engine:
    """One motor.

    ``oscillator`` is the node's own; ``external`` the clock that pulses are timed by instead.
    """

    __slots__ = (
        "_anchor",
        "_entry",
        "_left",
        "_profile",
        "_rest",
        "_sign",
        "_slips",
        "_tick",
        "clock",
        "end",
        "oscillator",
        "started",
    )

    def __init__(self, oscillator: Timebase = NOMINAL, external: Timebase | None = None) -> None:
        #: The node's own clock.
        self.oscillator = oscillator
        #: What pulses are timed by. :meth:`set_clock` changes it.
        self.clock = external or oscillator
        #: Where the present profile's pulse 0 goes on from.
        self._rest = _AT_ZERO
        self._profile: Profile | None = None
        self._sign = 1
        #: An instant, and the profile's tick then: negative while the start wait runs.
        self._anchor: Ns = 0
        self._tick = 0
        self._left = _AT_REST
        #: How the motor comes into the present profile, and where it does not follow that; None:
        #: not looked at yet.
        self._entry = FROM_REST
        self._slips: list[Slip] | None = None
        #: When the present profile's first pulse is issued, it may be to come; None: never, as long
        #: as the clock stands still.
        self.started: Ns | None = 0
        #: When the present profile's last period runs out; None when it never does, or none runs.
        self.end: Ns | None = None

    @classmethod
    def of(cls, standing: Standing) -> Engine:
        """An engine that stands and goes on like this; to be asked, not to be driven."""
        engine = cls(standing.clock)
        engine._rest = standing.rest
        engine._sign = standing.sign
        engine._anchor = standing.anchor
        engine._tick = standing.tick
        engine.started = standing.started
        engine._entry = standing.entry
        engine._profile = standing.profile
        if standing.profile is not None and standing.profile.duration is not None:
            engine.end = engine.when(standing.profile.duration)
        return engine

    @property
    def standing(self) -> Standing:
        """Where it stands and how it goes on."""
        return Standing(
            self.clock,
            self._rest,
            self._profile,
            self._sign,
            self._anchor,
            self._tick,
            self.started,
            self._entry,
        )

    def stands_as(self, standing: Standing) -> bool:
        """Whether nothing has interfered since; cheap, as it is asked after whatever happens."""
        return (
            self._profile is standing.profile
            and self._rest is standing.rest
            and self.clock is standing.clock
        )

    def when(self, tick: int) -> Ns | None:
        """When a tick of the present profile begins; None while no clock comes."""
        return self._anchor + self.clock.span(tick - self._tick) if self.clock.runs else None

    def whens(self, ticks: Ticks64) -> Ticks64:
        """:meth:`when` of many ticks; the clock must run."""
        return self._anchor + self.clock.spans(ticks - self._tick)

    def ticks_before(self, moment: Ns) -> int:
        """The first tick of the present profile that does not begin before ``moment``."""
        # It begins at the first whole ns at or after its time, so strictly after the ns before.
        return self._ticks(moment - 1) + 1

    @property
    def profile(self) -> Profile | None:
        """What is running, or about to start; None when the motor stands."""
        return self._profile

    def begun(self, now: Ns) -> bool:
        """Whether the present profile's first pulse has come."""
        return self.started is not None and self.started <= now

    def processing(self, ticks: int) -> Ns:
        """What the node takes for something that its own oscillator times, whatever the clock."""
        return self.oscillator.span(ticks)

    def start(self, profile: Profile, at: Ns, wait: int = 0) -> None:
        """Run a profile ``wait`` ticks after ``at``.

        The motor must stand or have :meth:`finish`-ed. Without a clock it begins as many ticks
        after the clock's first edge.
        """
        self._anchor = at
        self._tick = -wait
        self._sign = 1 if profile.motion.cw else -1
        self.started = None
        self._profile = profile
        self._schedule()

    def replace(self, profile: Profile) -> None:
        """Have another profile begin when the present one would, which has not issued a pulse."""
        self._take(profile)

    def change(self, cut: Callable[[Profile, int], Profile], now: Ns) -> None:
        """Put the profile that ``cut`` makes of the present one at ``now`` (in ticks) in its place.

        Only once its first pulse has come; before that it is :meth:`discard`-ed.
        """
        if self._profile is None:
            return
        ticks = self._ticks(now)
        profile = cut(self._profile, ticks)
        self._slips = None
        if profile.duration is None and len(profile.course.legs) > LEGS_KEPT:
            profile = self._fold(profile, ticks)
        self._take(profile)

    def finish(self, at: Ns) -> None:
        """The present profile has run out, or was halted: the motor stands where it got to."""
        profile = self._profile
        if profile is None:
            return
        # Only continuous motion has no number of pulses, and that has no end to come to.
        pulses = profile.pulses or 0
        self._left = _AT_REST
        if profile.kept_rpm and profile.drive.pull_in_rpm is not None:
            entry = self._entry_after(profile, pulses)
            # It turns on for a period; what begins within that does not begin from rest.
            until = at + self.clock.span(profile.last_period)
            self._left = _Left(until, self._sign * entry.rpm, entry.stalled)
        self._rest = self._after(profile, pulses)
        self.discard()

    def discard(self) -> None:
        """Forget a profile that has not issued a pulse."""
        self._profile = None
        self._slips = None
        self.end = None

    def set_clock(self, clock: Timebase, now: Ns) -> None:
        """Time pulses by another clock from ``now`` on.

        Ticks that have been counted stand; the one that runs begins anew, as an edge of the new
        clock would have it (decision).
        """
        if not self.begun(now):
            self.started = None
        if now > self._anchor:
            self._tick = self._ticks(now)
            self._anchor = now
        self.clock = clock
        self._schedule()

    def step(self, pulses: int) -> None:
        """Single pulses, out of any profile, in their direction; only while the motor stands."""
        if pulses:
            self._sign = 1 if pulses > 0 else -1
        self._rest = Where(*(position + pulses for position in self._rest))

    def change_microsteps(self, before: int, after: int) -> None:
        """Count positions in microsteps of 2**-after full steps from now on; the motor stands.

        It stays where it is, to the nearest of them: that is where its driver holds it (decision).
        """
        pulses, *places = self._rest
        if after >= before:
            places = [place << after - before for place in places]
        else:
            half = 1 << before - after - 1
            places = [(place + half) >> before - after for place in places]
        self._rest = Where(pulses, *places)

    @property
    def clockwise(self) -> bool:
        """The direction of the last profile or single pulse; clockwise before the first."""
        return self._sign > 0

    def where(self, now: Ns) -> Where:
        """Positions at ``now``."""
        if self._profile is None or not self.begun(now):
            return self._rest
        return self._after(self._profile, self._profile.pulses_at(self._ticks(now)))

    def position(self, now: Ns) -> int:
        """Pulses from where the node was switched on, at ``now``."""
        if self._profile is None or not self.begun(now):
            return self._rest.pulses
        return self._rest.pulses + self._sign * self._profile.pulses_at(self._ticks(now))

    def clk(self, now: Ns) -> int:
        """The level of the clk pin: 1 from each pulse of a command on, for the pulse's width.

        Single pulses, which are of no command, are not shown.
        """
        profile = self._profile
        if profile is None or not self.begun(now):
            return 0
        ticks = self._ticks(now)
        pulse = profile.pulses_at(ticks) - 1
        following = profile.time_of(pulse + 1)
        falls = profile.time_of(pulse) + profile.drive.pulse_us * TICKS_PER_US
        return int(ticks < min(falls, following - 1))

    def rpm(self, now: Ns) -> float:
        """Velocity of the pulses at ``now`` in RPM, signed, clockwise positive."""
        if self._profile is None or not self.begun(now):
            return 0.0
        clock = self.clock
        pace = NOMINAL.ns * clock.ticks / clock.ns
        return self._sign * self._profile.velocity_at(self._ticks(now)) * pace

    def state(self, now: Ns) -> State:
        """ACCEL, CRUISE, DECEL; STOP before a profile's first pulse; STANDBY when none is there."""
        if self._profile is None:
            return State.STANDBY
        if not self.begun(now):
            return State.STOP
        return self._profile.state_at(self._ticks(now))

    def _ticks(self, now: Ns) -> int:
        """The present profile's tick at ``now``."""
        return self._tick + self.clock.ticks_in(now - self._anchor)

    def _take(self, profile: Profile) -> None:
        self._profile = profile
        self._slips = None
        self._schedule()

    def _schedule(self) -> None:
        """Work out when the present profile begins, unless it has, and when it ends."""
        self.end = None
        if self._profile is None or not self.clock.runs:
            return
        span, tick = self.clock.span, self._tick
        if self.started is None:
            self.started = self._anchor + span(-tick)
            self._entry = FROM_REST
            left = self._left
            if left is not _AT_REST and self.started <= left.until:
                self._entry = Entry(self._sign * left.rpm, left.stalled)
        duration = self._profile.duration
        if duration is not None:
            self.end = self._anchor + span(duration - tick)

    def _fold(self, profile: Profile, ticks: int) -> Profile:
        """The profile from about now on; what it did before goes into the position."""
        first, tail = profile.tail(ticks)
        entry = self._entry_after(profile, first) if first else self._entry
        self._rest = self._after(profile, first)
        self._entry = entry
        self._tick -= profile.time_of(first)
        return tail

    def _after(self, profile: Profile, pulses: int) -> Where:
        """Where the first so many pulses of a profile bring the motor."""
        drive = profile.drive
        travel = profile.course.travel(pulses) if drive.auto_micro else pulses
        rotor = travel
        if drive.pull_in_rpm is not None:
            rotor -= lost(profile.course, self._slips_in(profile), pulses)
        sign, rest = self._sign, self._rest
        return Where(
            rest.pulses + sign * pulses, rest.microsteps + sign * travel, rest.rotor + sign * rotor
        )

    def _entry_after(self, profile: Profile, pulses: int) -> Entry:
        """How the motor comes out of the first so many pulses of a profile."""
        last = pulses - 1
        pace = profile.course.place_of(last).pace
        stalled = any(
            slip.first <= last and (slip.until is None or last < slip.until)
            for slip in self._slips_in(profile)
        )
        return Entry(profile.drive.real_rpm(pace.period, pace.weight), stalled)

    def _slips_in(self, profile: Profile) -> list[Slip]:
        """Where the motor does not follow a profile that began as the present one did."""
        if self._slips is None:
            self._slips = slips(profile.course, profile.drive, self._entry)
        return self._slips
