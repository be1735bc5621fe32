"""A ramp of the SS-MST67: the speed value that falls by Rate at every beat of the time base.

Owns which periods a ramp is made of. A period is one (micro)step: twice the speed value, by the
divider, in ticks of the 4 MHz timer; its value is what stands there as it begins, and stays until
it is over. The value falls at each beat, counted from the ramp's beginning, until it is the
target's: then the ramp is over, at the end of the period that runs. Slowing down is a ramp read
backwards.

Nothing here happens per step: between two beats all periods are alike, so a ramp is a table of runs
of them, and a ramp that many motions have in common is one object.
Source: manual, "How to compute Speed", "Computing Stepper Acceleration and Deceleration"; spec.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Ticks = NDArray[np.int64]

__all__ = ["TICKS_PER_MS", "Pace", "Ramp", "ramp"]

#: The timer runs at 4 MHz.
TICKS_PER_MS: Final = 4_000


class Pace(NamedTuple):
    """How the value changes. ``rate`` per beat, 0: at once; a beat is ``beat`` ticks."""

    rate: int
    beat: int

    @classmethod
    def of(cls, rate: int, time_base: int) -> Pace:
        """From the registers: (TimeBase + 1) ms a beat."""
        return cls(rate, (time_base + 1) * TICKS_PER_MS)


class Ramp:
    """From the speed value ``slow`` to the smaller ``fast``, by a pace.

    Periods count from 0; ticks from the beginning of period 0.
    """

    __slots__ = (
        "_begins",
        "_firsts",
        "_values",
        "divider",
        "duration",
        "fast",
        "pace",
        "periods",
        "slow",
    )

    def __init__(self, slow: int, fast: int, pace: Pace, divider: int) -> None:
        self.slow = slow
        self.fast = fast
        self.pace = pace
        self.divider = divider
        #: Runs of periods that are alike: the first one's tick, its number, and their value.
        self._begins = array("q")
        self._firsts = array("q")
        self._values = array("q")
        tick = number = 0
        rate, beat = pace
        beats = -(-(slow - fast) // rate) if rate and slow > fast else 0
        over = beats * beat
        while tick < over:
            at = tick // beat
            value = slow - at * rate
            period = 2 * divider * value
            count = -(-((at + 1) * beat - tick) // period)
            self._begins.append(tick)
            self._firsts.append(number)
            self._values.append(value)
            tick += count * period
            number += count
        #: How many there are, and what they take together.
        self.periods = number
        self.duration = tick

    def begin(self, number: int) -> int:
        """When a period begins; the number of all of them: when the last is over."""
        if number >= self.periods:
            return self.duration
        run = bisect_right(self._firsts, number) - 1
        period = 2 * self.divider * self._values[run]
        return self._begins[run] + (number - self._firsts[run]) * period

    def begins(self, numbers: Ticks) -> Ticks:
        """:meth:`begin` of many; of a ramp that has any."""
        firsts, begins, values = (
            np.frombuffer(one, dtype=np.int64) for one in (self._firsts, self._begins, self._values)
        )
        run = np.searchsorted(firsts, numbers, side="right") - 1
        found: Ticks = begins[run] + (numbers - firsts[run]) * (2 * self.divider * values[run])
        return np.where(numbers >= self.periods, self.duration, found)

    def number_at(self, tick: int) -> int:
        """The period that runs at a tick from 0 on; beyond the end the number of all of them."""
        if tick >= self.duration:
            return self.periods
        run = bisect_right(self._begins, tick) - 1
        period = 2 * self.divider * self._values[run]
        return self._firsts[run] + (tick - self._begins[run]) // period

    def begun_before(self, tick: int) -> int:
        """How many periods begin before a tick."""
        if tick <= 0:
            return 0
        return min(self.number_at(tick - 1) + 1, self.periods)

    def value(self, number: int) -> int:
        """The speed value of a period; behind the last one the target's."""
        if number >= self.periods:
            return self.fast
        return self._values[bisect_right(self._firsts, number) - 1]

    @property
    def runs(self) -> int:
        """How many runs of periods that are alike there are."""
        return len(self._firsts)

    def run(self, index: int) -> tuple[int, int]:
        """The number of a run's first period, and the value of its periods."""
        return self._firsts[index], self._values[index]


#: One object for all motions that have a ramp in common.
ramp = lru_cache(maxsize=64)(Ramp)
