"""How long a tick lasts: from ticks of a node's timer to nanoseconds and back.

Owns the oscillator's error and the external clock. Nothing here knows what time it is: motion
counts in ticks, and whoever knows the time asks for their length.
Source: manual, "Timing", "clock", "xclk"; spec, "Units and clock".
"""

from dataclasses import dataclass, field
from functools import lru_cache
from math import gcd
from typing import Final, Self

import numpy as np

from sacbus.motion.drive import TICKS_PER_US
from sacbus.motion.ramp import Ticks64

FACTORY_XFREQ: Final = 1_000_000
"""Hz. All timing is in microseconds, so an external clock is taken to be of 1 MHz (manual)."""

MILLION: Final = 1_000_000

NS_PER_TICK: Final = 1_000 // TICKS_PER_US

_FITS: Final = 1 << 62
"""Products up to here fit int64."""


@dataclass(frozen=True, slots=True)
class Timebase:
    """`ticks` ticks last `ns` nanoseconds, exactly; no ticks: the clock stands still.

    Lengths of time in whole ns and ticks, from an instant at which a tick begins. A tick has begun
    at the first whole ns at or after its time: so `ticks_in(span(n))` is n, unless ticks are
    shorter than a ns.
    """

    ns: int = NS_PER_TICK
    ticks: int = 1
    runs: bool = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.ns < 1 or self.ticks < 0:
            raise ValueError(f"no clock has {self.ticks} ticks in {self.ns} ns")
        common = gcd(self.ns, self.ticks)
        derive = object.__setattr__
        derive(self, "ns", self.ns // common)
        derive(self, "ticks", self.ticks // common)
        derive(self, "runs", self.ticks > 0)

    @classmethod
    @lru_cache(maxsize=256)  # one for all nodes that are alike
    def internal(cls, ppm: int = 0) -> Self:
        """The node's own oscillator, whose frequency is `ppm` parts in a million too high."""
        return cls(NS_PER_TICK * MILLION, MILLION + ppm)

    @classmethod
    def external(cls, xfreq: int, hz: int) -> Self:
        """A clock of `hz` on a node that is told it were one of `xfreq` Hz; 0 Hz: no edges.

        A cycle then lasts cycle x xfreq / 1e6 edges. An xfreq of 0 acts as the factory's.
        """
        return cls(NS_PER_TICK * (xfreq or FACTORY_XFREQ), hz)

    def span(self, ticks: int) -> int:
        """Nanoseconds after which a tick begins; ZeroDivisionError when the clock stands still."""
        return -(-ticks * self.ns // self.ticks)

    def spans(self, ticks: Ticks64) -> Ticks64:
        """:meth:`span` of many at once; the results must fit int64, which are 292 years."""
        if self.ticks == 1:
            return ticks * self.ns
        if self.ns * self.ticks >= _FITS:
            return np.array([self.span(int(one)) for one in ticks], dtype=np.int64)
        whole, rest = np.divmod(ticks, self.ticks)
        begun: Ticks64 = whole * self.ns - -rest * self.ns // self.ticks
        return begun

    def ticks_in(self, ns: int) -> int:
        """Ticks that begin within some ns; none when the clock stands still."""
        return ns * self.ticks // self.ns
