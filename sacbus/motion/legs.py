"""Stretches of a profile: at one speed, up a ramp, or back down it.

Owns the questions a profile asks of each of its parts, in ticks and pulses from the part's own
beginning. A leg is immutable and holds no times of its own: long or short, it costs the same.
"""

from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, Protocol

import numpy as np

from sacbus.motion.ramp import Ramp, Ticks64

_COUNT: Final = np.arange(1 << 14, dtype=np.int64)
"""0, 1, 2, ... for as many pulses as are written at a time: half of a processor's own cache."""


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
    def weight(self) -> int:
        """Finest microsteps that each pulse turns the motor by (see drive.py)."""

    @property
    def ticks(self) -> int | None:
        """When the last period has run out; None = never."""

    def time(self, pulse: int) -> int:
        """When a pulse is issued; `time(count)` is the end."""

    def running(self, ticks: int) -> int:
        """The pulse whose period runs at a time from 0 up to the end."""

    def write(self, first: int, out: Ticks64, shift: int) -> None:
        """Fill `out` with `shift + time(i)` for i from `first` on."""

    def speed(self, pulse: int) -> int:
        """Nominal speed (see drive.py) of a pulse."""

    def first(self, count: int) -> "Leg":
        """The leg cut off after its first `count` pulses, 0 < count."""

    def after(self, pulses: int) -> "Leg":
        """The leg without its first pulses; some are left."""


@dataclass(frozen=True, slots=True)
class Even:
    """Pulses that all last the same."""

    state: State
    count: int | None
    period: int
    nominal_speed: int
    weight: int = 1

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

    def write(self, first: int, out: Ticks64, shift: int) -> None:
        """Fill `out` with `shift + time(i)` for i from `first` on."""
        begin, period = first * self.period + shift, self.period
        if out.size == 1:  # a period that does not fit the array never comes twice
            out[0] = begin
            return
        for at in range(0, out.size, _COUNT.size):
            part = out[at : at + _COUNT.size]
            np.multiply(_COUNT[: part.size], period, out=part)
            part += begin + at * period

    def speed(self, pulse: int) -> int:  # noqa: ARG002  the same for all
        """Nominal speed of a pulse."""
        return self.nominal_speed

    def first(self, count: int) -> "Even":
        """The leg cut off after its first `count` pulses."""
        return replace(self, count=count)

    def after(self, pulses: int) -> "Even":
        """The leg without its first pulses."""
        return replace(self, count=None if self.count is None else self.count - pulses)


@dataclass(frozen=True, slots=True)
class Forth:
    """`count` pulses along a ramp, from its pulse `begin` on."""

    state: State
    ramp: Ramp
    begin: int
    count: int
    weight: int = 1

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

    def write(self, first: int, out: Ticks64, shift: int) -> None:
        """Fill `out` with `shift + time(i)` for i from `first` on."""
        begin = self.begin + first
        shift -= self.ramp.time(self.begin)
        done = 0
        for piece in self.ramp.pieces(begin, begin + out.size):
            np.add(piece, shift, out=out[done : done + piece.size])
            done += piece.size

    def speed(self, pulse: int) -> int:
        """Nominal speed of a pulse."""
        return self.ramp.speed(self.begin + pulse)

    def index(self, pulse: int) -> int:
        """Where on its ramp a pulse lies."""
        return self.begin + pulse

    def first(self, count: int) -> "Forth":
        """The leg cut off after its first `count` pulses."""
        return replace(self, count=count)

    def after(self, pulses: int) -> "Forth":
        """The leg without its first pulses."""
        return replace(self, begin=self.begin + pulses, count=self.count - pulses)


@dataclass(frozen=True, slots=True)
class Back:
    """`count` pulses of a ramp run backwards, beginning with its pulse `end - 1`."""

    state: State
    ramp: Ramp
    end: int
    count: int
    weight: int = 1

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

    def write(self, first: int, out: Ticks64, shift: int) -> None:
        """Fill `out` with `shift + time(i)` for i from `first` on."""
        last = self.end - first
        shift += self.ramp.time(self.end)
        left = out.size  # the ramp's own times come slowest first: they are put in from the back
        for piece in self.ramp.pieces(last - out.size + 1, last + 1):
            np.subtract(shift, piece[::-1], out=out[left - piece.size : left])
            left -= piece.size

    def speed(self, pulse: int) -> int:
        """Nominal speed of a pulse."""
        return self.ramp.speed(self.index(pulse))

    def index(self, pulse: int) -> int:
        """Where on its ramp a pulse lies."""
        return self.end - 1 - pulse

    def first(self, count: int) -> "Back":
        """The leg cut off after its first `count` pulses."""
        return replace(self, count=count)

    def after(self, pulses: int) -> "Back":
        """The leg without its first pulses."""
        return replace(self, end=self.end - pulses, count=self.count - pulses)
