"""The linear ramp: constant angular acceleration (D. Austin, 2004).

Owns its law and its table cache. The truth is the sequential recurrence in IEEE doubles, in
ticks, each term truncated:

    c0 = 0.676 * sqrt(2 * alpha / acc),  c[n] = c[n-1] - 2 * c[n-1] / (4n + 1)

The head of a table walks it. Further on the closed form c[n] = K * gamma(n+3/4) / gamma(n+5/4)
tells at which pulse the recurrence passes each whole tick. The two drift apart by rounding, by
some 1e-16 * sqrt(n) of the value; where the crossing lies closer to a pulse than that, the
recurrence is walked to it.
Source: manual, "Profiles" and Appendix A, ref. 1; spec, "Profile".
"""

from collections.abc import Iterable
from functools import lru_cache
from math import gamma, pi, sqrt
from typing import Final

import numpy as np

from sacbus.motion.drive import TICKS_PER_MINUTE
from sacbus.motion.ramp import FAR, Ramp, Ticks64

FIRST_STEP: Final = 0.676
"""Correction of the first period (decision of the spec, fits a run timed by the companion)."""

GAMMA_RATIO: Final = gamma(5 / 4) / gamma(3 / 4)

DRIFT: Final = 16 * 2.0**-53
"""Relative drift of the recurrence is below DRIFT * sqrt(n + 1): sixteen times the deviation of a
random walk of half an ulp a term, and ample for the few ulps the closed form itself is off."""

WALK_MAX: Final = 1 << 22
"""The recurrence is not walked further than this: some 0.3 s. Beyond, a crossing that is too close
to call goes by the closed form, and one pulse may be a tick off."""

RAMPS_KEPT: Final = 512
"""Tables shared by all nodes; at most 16 MiB if every one of them were thousands of steps long."""


class LinearLaw:
    """Pulse n nominally lasts c[n], truncated; index 0 is standstill.

    pulses_per_rev: sprf x 2**ustep. acc100: rad/s2 x 100, > 0. rate as in drive.py.
    """

    __slots__ = ("_first", "_reached", "acc100", "falling", "pulses_per_rev", "rate")

    def __init__(self, pulses_per_rev: int, acc100: int, rate: int) -> None:
        alpha = 2 * pi / pulses_per_rev
        ticks_per_second = TICKS_PER_MINUTE // 60
        self._first = FIRST_STEP * sqrt(2 * alpha / (acc100 / 100)) * ticks_per_second
        self.rate: Final = rate
        self.pulses_per_rev: Final = pulses_per_rev
        self.acc100: Final = acc100
        self._reached = (0, self._first)
        self.falling: Final = True

    def periods(self, count: int) -> Iterable[int]:
        """The first `count` nominal periods, by the recurrence."""
        c = self._first
        for n in range(1, count + 1):
            yield int(c)
            c -= 2 * c / (4 * n + 1)

    def onsets(self, periods: Ticks64) -> Ticks64:
        """First n with c[n] < period + 1, from the closed form unless that is too close to call.

        With w = n + 1/2 the closed form is K / sqrt(w) * exp(-1/(64 w^2) + 5/(2048 w^4) - ...),
        which two rounds of substitution turn round.
        """
        bound = np.maximum(periods + 1, 1).astype(np.float64)
        plain = (self._first * GAMMA_RATIO / bound) ** 2
        w = plain
        for _ in range(2):
            w = plain * np.exp(-1 / (32 * w**2) + 5 / (1024 * w**4))
        crossing = w - 0.5
        onset = np.floor(crossing).astype(np.int64) + 1
        near = np.rint(crossing)
        # c falls by c / 2n a pulse: a drift of the value moves the crossing 2n times as far.
        doubt = np.abs(crossing - near) < 2 * w * DRIFT * np.sqrt(w)
        for at in np.flatnonzero(doubt & (near < WALK_MAX) & (periods >= 0)):
            n = int(near[at])
            onset[at] = n if self._walk(n) < bound[at] else n + 1
        return np.where(periods >= 0, np.minimum(onset, FAR), FAR)

    def speed(self, index: int, nominal: int) -> int:  # noqa: ARG002  only the period tells
        """Speed of the pulse, from its nominal period."""
        return self.rate // nominal

    def _walk(self, n: int) -> float:
        """c[n] by the recurrence, going on from where the last walk ended if it can."""
        at, c = self._reached
        if n < at:
            at, c = 0, self._first
        for k in range(at + 1, n + 1):
            c -= 2 * c / (4 * k + 1)
        self._reached = (n, c)
        return c


@lru_cache(maxsize=RAMPS_KEPT)
def linear(pulses_per_rev: int, acc100: int, rate: int, offset: int) -> Ramp:
    """The shared table of a linear ramp; it serves every stretch of it, up and down."""
    return Ramp(LinearLaw(pulses_per_rev, acc100, rate), offset)
