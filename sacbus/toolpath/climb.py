"""Linear ramps that follow an ideal one: which acceleration, up to which RPM, and when.

Owns the choice of a ramp from rest, or to rest. The device's ramp is not the ideal one. It takes
whole RPM and hundredths of a rad/s2; it cuts every period off to whole ticks; its first period is
shortened; and its pulse k comes at about sqrt(k), where that of a motion at constant acceleration
is due at sqrt(k + 1/2). So it can only be laid beside the ideal one, as close as may be:
accelerations near the ideal one are tried, each so that its fastest pulse is on time, and that
whose worst pulse is least away is taken.
Source: manual, "Profiles" and Appendix A, ref. 1 (D. Austin); docs/lines.md.
"""

from __future__ import annotations

from math import gamma, pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sacbus.motion import Drive
from sacbus.motion.linear import FIRST_STEP, GAMMA_RATIO
from sacbus.motion.shares import linear_index
from sacbus.toolpath.share import TICKS_PER_SECOND, Part

__all__ = ["Climb", "climb", "leaning"]

Reals = NDArray[np.float64]
Counts = NDArray[np.int64]

#: Samples of a ramp's pulses, and accelerations that are tried.
_SAMPLES: Final = 28
_TRIED: Final = 12

#: Full steps by which a ramp that needs a command of its own must be better.
_A_COMMAND: Final = 0.03

#: Gamma(k + 3/4) / Gamma(k + 1/4) of the first k, where its series is not good enough.
_FEW: Final = tuple(gamma(k + 3 / 4) / gamma(k + 1 / 4) for k in range(4))


class Climb(NamedTuple):
    """A ramp between rest and speed.

    acc100, rpm, steps: of the command; full steps. after: ticks from the beginning of the ideal
    ramp to the first pulse; downwards from the end of the last period to the end of the ideal one.
    worst: full steps by which a pulse is early or late at most, as samples of them tell.
    """

    acc100: int
    rpm: int
    steps: int
    after: float
    worst: float


def climb(drive: Drive, ideal: Part, most: int, top100: int, *, down: bool = False) -> Climb | None:
    """The ramp that follows an ideal one best, of at most so many steps and such an acceleration.

    None where the device takes no ramp: up to `slow`, where its acceleration gets it there within
    a step, and where not even a step fits.
    """
    speed = ideal.v0 if down else ideal.v1
    rpm = speed * TICKS_PER_SECOND * 60 / drive.steps_per_rev
    per_rad = drive.steps_per_rev / (2 * pi)
    nominal100 = abs(ideal.acceleration) * TICKS_PER_SECOND**2 / per_rad * 100
    reached = int(rpm + 1e-9)
    nominal = linear_index(reached, max(1, round(nominal100)), drive.steps_per_rev)
    if reached <= drive.slow or not nominal:
        return None
    pulses, period = ideal.way * drive.m, 1 / (speed * drive.m)
    middle = nominal100 * (1 + leaning(drive, pulses, period, down=down))
    spread = nominal100 * (2 / (pulses + 4) + 0.3 / period)
    tried = [
        (acc100, whole, steps)
        for whole in sorted({reached, round(rpm)})
        for acc100 in _accelerations(middle - spread, middle + spread, top100)
        if 1 <= (steps := linear_index(whole, acc100, drive.steps_per_rev)) <= most
    ]
    if not tried:
        return None
    after, worst = _laid_beside(drive, ideal, tried, down=down)
    # An RPM that is rounded up costs a command of its own.
    dear = np.array([whole for _, whole, _ in tried]) > rpm
    at = int(np.argmin(worst + _A_COMMAND * dear))
    return Climb(*tried[at], float(after[at]), float(worst[at]))


def leaning(drive: Drive, pulses: float, period: float, *, down: bool) -> float:
    """By which part the acceleration is best chosen higher than the ideal one.

    pulses: of the ramp. period: ticks of its fastest pulse. Found by trial: it makes up for the
    half pulse that the device's law lacks, or downwards has too many, and for what is cut off of
    every period, or added to it.
    """
    lacking = -2.3 / (pulses + 11) if down else 2.4 / (pulses + 4)
    return lacking + 1.45 * (drive.offset - 0.5) / period


def _accelerations(low: float, high: float, top100: int) -> list[int]:
    """Hundredths of a rad/s2 that the device can be told: whole ones, above 100 whole rad/s2."""
    unit = 1 if high < 10_000 else 100
    first = max(1, min(round(low / unit), top100 // unit))
    last = max(first, min(round(high / unit), top100 // unit))
    tried = min(_TRIED, last - first + 1)
    return sorted({round(one) * unit for one in np.linspace(first, last, tried)})


def _laid_beside(
    drive: Drive, ideal: Part, tried: list[tuple[int, int, int]], *, down: bool
) -> tuple[Reals, Reals]:
    """For each ramp (acceleration, RPM, steps) the best shift, and how far it is off then."""
    m = drive.m
    rest, speed = (ideal.v1, ideal.v0) if down else (ideal.v0, ideal.v1)
    acceleration = abs(ideal.acceleration)
    last = _column([steps * m for _, _, steps in tried])
    pulses = np.minimum(_samples(int(last.max())), last)
    taken = _sums(drive, _column([acc100 for acc100, _, _ in tried]), pulses)
    # Upwards pulse k, from 0, is due half a pulse behind its place; downwards the k-th from the
    # end, from 1, half a pulse before the end is reached. Read backwards that is the same motion.
    places = (pulses + (-0.5 if down else 0.5)) / m
    if down:
        places, taken = places[:, 1:], taken[:, 1:]
    within = np.minimum(places, ideal.way)
    velocity = np.sqrt(rest**2 + 2 * acceleration * within)
    due = (velocity - rest) / acceleration + (places - within) / speed
    # The fastest pulse is on time: so both ramps of a line meet in a cruise that is the ideal one.
    shift = (due - taken)[:, -1]
    return shift, np.abs(velocity * (shift[:, None] - (due - taken))).max(axis=1)


def _sums(drive: Drive, acc100: Counts, pulses: Counts) -> Reals:
    """Ticks of the first pulses of the device's ramp; half a tick of each is cut off."""
    angle = 2 * pi / (drive.steps_per_rev * drive.m)
    first = FIRST_STEP * np.sqrt(2 * angle / (acc100 / 100)) * TICKS_PER_SECOND
    root: Reals = np.sqrt(pulses)
    ratio = root * (1 + 1 / (64 * np.maximum(pulses, 1) ** 2))
    for few, exact in enumerate(_FEW):
        ratio = np.where(pulses == few, exact, ratio)
    ramp: Reals = 2 * GAMMA_RATIO * first * (ratio - _FEW[0])
    return ramp + (drive.offset - 0.5) * pulses


def _column(figures: list[int]) -> Counts:
    return np.array(figures, dtype=np.int64)[:, None]


def _samples(last: int) -> Counts:
    """Pulses at which a ramp is looked at: the first ones, then ever fewer, and the last."""
    rising = np.geomspace(1, last + 1, _SAMPLES) - 1
    chosen: Counts = np.unique(np.append(rising.round(), range(min(6, last)))).astype(np.int64)
    return chosen
