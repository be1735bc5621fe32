"""The harmonic ramp: speed changes by a constant per step.

Owns its law and its table cache. Everything is integer arithmetic and exact.
Source: manual, "Discussion" (the harmonic curve), "Profile Planning"; spec, "Profile".
"""

from collections.abc import Iterable
from functools import lru_cache
from typing import Final

import numpy as np

from sacbus.motion.ramp import FAR, Ramp, Ticks64

RAMPS_KEPT: Final = 512
"""Tables shared by all nodes; at most 16 MiB if every one of them were thousands of steps long."""


class HarmonicLaw:
    """Pulse k runs at speed `start + slope * k` and nominally lasts `rate // speed` ticks.

    rate and speed as in drive.py; slope is acc x 100 x the weight of the pulses, negative on the
    way down. A law on the way down ends where its speed would reach 0.
    """

    __slots__ = ("falling", "rate", "slope", "start")

    def __init__(self, rate: int, start: int, slope: int) -> None:
        self.rate: Final = rate
        self.start: Final = start
        self.slope: Final = slope
        self.falling: Final = slope > 0

    def periods(self, count: int) -> Iterable[int]:
        """The first `count` nominal periods; fewer when the law ends before."""
        rate, start, slope = self.rate, self.start, self.slope
        if slope < 0:
            count = min(count, (start - 1) // -slope + 1)
        return [rate // speed for speed in range(start, start + slope * count, slope)]

    def onsets(self, periods: Ticks64) -> Ticks64:
        """First pulse whose period has come down (up) to each of these; exact.

        rate // speed <= p  <=>  speed >= rate // (p + 1) + 1, and
        rate // speed >= p  <=>  speed <= rate // p.
        """
        if self.falling:
            limit = np.maximum(periods + 1, 1)
            first = -((self.start - 1 - self.rate // limit) // self.slope)
            return np.where(periods >= 0, first, FAR)
        first = -((self.rate // np.maximum(periods, 1) - self.start) // -self.slope)
        return np.where(periods > 0, first, 0)

    def speed(self, index: int, nominal: int) -> int:  # noqa: ARG002  the law knows it exactly
        """Speed of the pulse at `index`, exactly."""
        return self.start + self.slope * index


@lru_cache(maxsize=RAMPS_KEPT)
def harmonic(rate: int, start: int, slope: int, offset: int) -> Ramp:
    """The shared table of a harmonic ramp; it serves every target on its way."""
    return Ramp(HarmonicLaw(rate, start, slope), offset)
