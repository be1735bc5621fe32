"""The motor of an SS-MST67: the course that it runs, since when, and where it stands.

Owns the position and the arithmetic between bus time and the ticks of the 4 MHz timer. Which course
runs, and why, is the command processor's business. Nothing happens per step: positions are computed
when somebody asks.

Positions are signed, clockwise positive, from 0 at power-on: in pulses, of which each is a step of
the present microstepping, and in eighths of a full step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from nodes.superstepper.course import Course, Running, Stretch
from nodes.superstepper.plan import Entry
from sacbus.kernel import Ns
from sacbus.motion import Timebase

if TYPE_CHECKING:
    from nodes.superstepper.ramp import Ticks

__all__ = ["EIGHTHS", "NS_PER_TICK", "Engine", "Standing", "timer"]

#: A full step, in the smallest that the driver has.
EIGHTHS: Final = 8

#: The timer's 4 MHz (manual, "How to compute Speed").
NS_PER_TICK: Final = 250

_MILLION: Final = 1_000_000

#: What a period is told as that a command found running.
_Plan = Callable[[Entry | None], Sequence[Stretch]]


def timer(ppm: int = 0) -> Timebase:
    """The timer of a module whose crystal is so many parts in a million too fast."""
    return Timebase(NS_PER_TICK * _MILLION, _MILLION + ppm)


class Standing(NamedTuple):
    """All that tells where a motor stands and how it goes on, as long as nobody interferes.

    ``unit``: eighths of a full step in a pulse. ``sign``: the direction before the course.
    """

    clock: Timebase
    pulses: int
    eighths: int
    unit: int
    sign: int
    course: Course | None
    anchor: Ns


class Engine:
    """One motor."""

    __slots__ = (
        "_anchor",
        "_course",
        "_eighths",
        "_pulses",
        "_sign",
        "_steps",
        "clock",
        "end",
        "turns",
        "unit",
    )

    def __init__(self, clock: Timebase) -> None:
        self.clock = clock
        #: Eighths of a full step in a pulse.
        self.unit = EIGHTHS
        #: Where the present course's step 0 goes on from.
        self._pulses = 0
        self._eighths = 0
        #: Steps of all courses before the present one, whatever their direction.
        self._steps = 0
        #: The direction of the last period of these.
        self._sign = 1
        self._course: Course | None = None
        #: When the present course began.
        self._anchor: Ns = 0
        #: When its last period is over; None when it never is, or none runs.
        self.end: Ns | None = None
        #: When the direction changes next; None when it does not.
        self.turns: Ns | None = None

    @classmethod
    def of(cls, standing: Standing) -> Engine:
        """A motor that stands and goes on like this; to be asked, not to be driven."""
        engine = cls(standing.clock)
        engine.unit = standing.unit
        engine._pulses = standing.pulses
        engine._eighths = standing.eighths
        engine._sign = standing.sign
        if standing.course is not None:
            engine._take(standing.course, standing.anchor)
        return engine

    @property
    def standing(self) -> Standing:
        """Where it stands and how it goes on."""
        return Standing(
            self.clock,
            self._pulses,
            self._eighths,
            self.unit,
            self._sign,
            self._course,
            self._anchor,
        )

    @property
    def course(self) -> Course | None:
        """What runs, or has run out; None when nothing does."""
        return self._course

    # ---- driving ----

    def go(self, plan: _Plan, now: Ns) -> int:
        """Run what ``plan`` makes of how the motor runs now; steps until that takes over.

        The period that runs is finished first; ``plan`` is given None when the motor rests.
        """
        running = self.running(now)
        if running is None:
            self.finish(now)
            self._take(Course(plan(None)), now)
            return 0
        stretch = running.stretch
        value = stretch.value_of(running.number)
        issued = self._ticks(now) - running.begin >= running.half
        rest = Stretch(stretch.state, stretch.sign, value, stretch.divider, 1)
        following = plan(Entry(value, stretch.divider, stretch.sign))
        anchor = self._anchor + self.clock.span(running.begin)
        self._fold(running.begin - 1)
        self._take(Course((rest, *following)), anchor)
        return 0 if issued else 1

    def cut(self, now: Ns) -> None:
        """Stand still at once: no step follows."""
        self._fold(self._ticks(now))
        self._course = None
        self.end = self.turns = None

    def finish(self, now: Ns) -> None:
        """Have what has been count as position: a course that has run out, or one direction of it.

        So whoever tells of changes tells of the new direction.
        """
        if self.end is not None and now >= self.end:
            self.cut(self.end)
        elif self.turns is not None and now >= self.turns and self._course is not None:
            tick, rest = self._course.after_turn()
            anchor = self.when(tick)
            self._fold(tick - 1)
            self._take(rest, anchor)

    def set_unit(self, unit: int, now: Ns) -> None:
        """Pulses from now on are so many eighths of a full step."""
        travel = 0 if self._course is None else self._course.travel_at(self._ticks(now))
        self._eighths += travel * (self.unit - unit)
        self.unit = unit

    def _fold(self, tick: int) -> None:
        """What has been up to and with a tick goes into the position."""
        if self._course is None:
            return
        travel = self._course.travel_at(tick)
        self._pulses += travel
        self._eighths += travel * self.unit
        self._steps += self._course.steps_at(tick)
        self._sign = self._course.sign_at(tick, self._sign)

    def _take(self, course: Course, anchor: Ns) -> None:
        self._course = course
        self._anchor = anchor
        duration = course.duration
        self.end = None if duration is None else anchor + self.clock.span(duration)
        turn = course.turn
        self.turns = None if turn is None else anchor + self.clock.span(turn)

    # ---- asking ----

    def _ticks(self, now: Ns) -> int:
        return self.clock.ticks_in(now - self._anchor)

    def running(self, now: Ns) -> Running | None:
        """The period that runs; None when the motor rests."""
        if self._course is None or (self.end is not None and now >= self.end):
            return None
        return self._course.running(self._ticks(now))

    def position(self, now: Ns) -> int:
        """Pulses from where it was switched on."""
        if self._course is None:
            return self._pulses
        return self._pulses + self._course.travel_at(self._ticks(now))

    def eighths(self, now: Ns) -> int:
        """Where the motor stands, in eighths of a full step."""
        if self._course is None:
            return self._eighths
        return self._eighths + self._course.travel_at(self._ticks(now)) * self.unit

    def steps(self, now: Ns) -> int:
        """Steps that were ever issued, in both directions."""
        if self._course is None:
            return self._steps
        return self._steps + self._course.steps_at(self._ticks(now))

    def clockwise(self, now: Ns) -> bool:
        """The direction of the present period, or of the last one; clockwise before the first."""
        if self._course is None:
            return self._sign > 0
        return self._course.sign_at(self._ticks(now), self._sign) > 0

    def state(self, now: Ns) -> str:
        """ACCEL, CRUISE, DECEL; STANDBY when it rests."""
        running = self.running(now)
        return "STANDBY" if running is None else running.stretch.state

    def rpm(self, now: Ns, steps_per_revolution: int) -> float:
        """Velocity of the shaft, signed, clockwise positive."""
        running = self.running(now)
        if running is None:
            return 0.0
        per_minute = 60e9 * self.clock.ticks / self.clock.ns / (2 * running.half)
        turns = per_minute * self.unit / EIGHTHS / steps_per_revolution
        return running.stretch.sign * turns

    def clk(self, now: Ns) -> int:
        """The step output: high from each step on to the end of its period."""
        running = self.running(now)
        return int(running is not None and self._ticks(now) - running.begin >= running.half)

    def when(self, tick: int) -> Ns:
        """When a tick of the present course begins."""
        return self._anchor + self.clock.span(tick)

    def whens(self, ticks: Ticks) -> Ticks:
        """:meth:`when` of many."""
        return self._anchor + self.clock.spans(ticks)

    def tick_at(self, moment: Ns) -> int:
        """The first tick of the present course that does not begin before a moment."""
        return self._ticks(moment - 1) + 1
