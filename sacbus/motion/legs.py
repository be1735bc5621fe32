"""Stretches of a profile: at one speed, up a ramp, or back down it.

Owns the questions a profile asks of each of its parts, in ticks and pulses from the part's own
beginning. A leg is immutable and holds no times of its own: long or short, it costs the same.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from sacbus.motion.ramp import Ramp, Ticks64


class State(Enum):
    """The five states of the motion engine (manual, "Profile Planning")."""

    ACCEL = "ACCEL"
    CRUISE = "CRUISE"
    DECEL = "DECEL"
    STOP = "STOP"
    STANDBY = "STANDBY"


class Leg(Protocol):
    """Some pulses in a row; times in ticks from the first of them."""

    @property
    def state(self) -> State:
        """The state the node is in meanwhile."""

    @property
    def count(self) -> int | None:
        """Pulses, at least one; None = for ever."""

    @property
    def ticks(self) -> int | None:
        """When the last period has run out; None = never."""

    def time(self, pulse: int) -> int:
        """When a pulse is issued; `time(count)` is the end."""

    def running(self, ticks: int) -> int:
        """The pulse whose period runs at a time from 0 up to the end."""

    def times(self, first: int, last: int) -> Ticks64:
        """`time(i)` for i in [first, last)."""

    def speed(self, pulse: int) -> int:
        """Nominal speed (see drive.py) of a pulse."""

    def first(self, count: int) -> "Leg":
        """The leg cut off after its first `count` pulses, 0 < count."""


@dataclass(frozen=True, slots=True)
class Even:
    """Pulses that all last the same."""

    state: State
    count: int | None
    period: int
    nominal_speed: int

    @property
    def ticks(self) -> int | None:
        """When the last period has run out; None = never."""
        return None if self.count is None else self.count * self.period

    def time(self, pulse: int) -> int:
        """When a pulse is issued."""
        return pulse * self.period

    def running(self, ticks: int) -> int:
        """The pulse whose period runs."""
        return ticks // self.period

    def times(self, first: int, last: int) -> Ticks64:
        """`time(i)` for i in [first, last)."""
        return np.arange(first, last, dtype=np.int64) * self.period

    def speed(self, pulse: int) -> int:  # noqa: ARG002  the same for all
        """Nominal speed of a pulse."""
        return self.nominal_speed

    def first(self, count: int) -> "Even":
        """The leg cut off after its first `count` pulses."""
        return Even(self.state, count, self.period, self.nominal_speed)


@dataclass(frozen=True, slots=True)
class Forth:
    """`count` pulses along a ramp, from its pulse `begin` on."""

    state: State
    ramp: Ramp
    begin: int
    count: int

    @property
    def ticks(self) -> int:
        """When the last period has run out."""
        return self.time(self.count)

    def time(self, pulse: int) -> int:
        """When a pulse is issued."""
        return self.ramp.time(self.begin + pulse) - self.ramp.time(self.begin)

    def running(self, ticks: int) -> int:
        """The pulse whose period runs."""
        began = self.ramp.time(self.begin)
        return self.ramp.index(began + ticks, self.begin + self.count) - self.begin

    def times(self, first: int, last: int) -> Ticks64:
        """`time(i)` for i in [first, last)."""
        return self.ramp.times(self.begin + first, self.begin + last) - self.ramp.time(self.begin)

    def speed(self, pulse: int) -> int:
        """Nominal speed of a pulse."""
        return self.ramp.speed(self.begin + pulse)

    def index(self, pulse: int) -> int:
        """Where on its ramp a pulse lies."""
        return self.begin + pulse

    def first(self, count: int) -> "Forth":
        """The leg cut off after its first `count` pulses."""
        return Forth(self.state, self.ramp, self.begin, count)


@dataclass(frozen=True, slots=True)
class Back:
    """`count` pulses of a ramp run backwards, beginning with its pulse `end - 1`."""

    state: State
    ramp: Ramp
    end: int
    count: int

    @property
    def ticks(self) -> int:
        """When the last period has run out."""
        return self.time(self.count)

    def time(self, pulse: int) -> int:
        """When a pulse is issued."""
        return self.ramp.time(self.end) - self.ramp.time(self.end - pulse)

    def running(self, ticks: int) -> int:
        """The pulse whose period runs."""
        # On the ramp read forwards the same instant lies `left` ticks after its beginning, and the
        # pulse that runs there is the last one that begins strictly earlier.
        left = self.ramp.time(self.end) - ticks
        return self.end - 1 - self.ramp.index(left - 1, self.end)

    def times(self, first: int, last: int) -> Ticks64:
        """`time(i)` for i in [first, last)."""
        forwards = self.ramp.times(self.end - last + 1, self.end - first + 1)
        return self.ramp.time(self.end) - forwards[::-1]

    def speed(self, pulse: int) -> int:
        """Nominal speed of a pulse."""
        return self.ramp.speed(self.index(pulse))

    def index(self, pulse: int) -> int:
        """Where on its ramp a pulse lies."""
        return self.end - 1 - pulse

    def first(self, count: int) -> "Back":
        """The leg cut off after its first `count` pulses."""
        return Back(self.state, self.ramp, self.end, count)
