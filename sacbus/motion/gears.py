"""Auto-micro: microsteps as the speed allows, changed like an automobile's gears.

Owns the choice of the exponent. Each full step is made of the most microsteps, up to the node's own
ustep, with which its shortest pulse still lasts LONG_ENOUGH_US; of none where even that is quicker.
It changes between full steps only; a velocity that deceleration holds (layout.py) keeps the
exponent in which it was reached. A command that does not count in full steps (pulse mode, or with U
pulses) leaves them, and runs at the node's ustep throughout.

A pulse's *weight* (drive.py) stands for the exponent: 2 ** (ustep - exponent), from 1 at the
finest microsteps to `drive.m` at full steps.
Source: manual, "Micro-stepping" (auto-micro is mentioned, not specified); spec, the commands of a
SAC, "Auto-micro" (decision).
"""

from bisect import bisect_left
from collections.abc import Callable
from typing import Final, NamedTuple

from sacbus.language import Motion
from sacbus.motion.drive import TICKS_PER_US, Drive
from sacbus.motion.ramp import Ramp

LONG_ENOUGH_US: Final = 200
"""Real period of a pulse down to which more microsteps are taken (decision of the spec)."""

LONG_ENOUGH: Final = LONG_ENOUGH_US * TICKS_PER_US

RampOf = Callable[[int], Ramp]
"""The table of one and the same ramp for pulses of some weight."""


class Stretch(NamedTuple):
    """Full steps of a ramp, by their number on it, that are made of pulses of the same weight."""

    begin: int
    end: int
    weight: int


def shifts_gears(motion: Motion, drive: Drive) -> bool:
    """True when a command runs with auto-micro."""
    return drive.auto_micro and not (motion.pulses or motion.extra_pulses)


def cruise_weight(drive: Drive, cycle_us: int) -> int:
    """Weight of the pulses of a cruise."""
    weight = 1
    while weight < drive.m and drive.cruise_period(cycle_us, weight) < LONG_ENOUGH:
        weight *= 2
    return weight


def stretches(ramp_of: RampOf, drive: Drive, begin: int, end: int) -> list[Stretch]:
    """The full steps [begin, end) of a ramp by the weight of their pulses, in the ramp's order.

    Periods change one way along a ramp, so the steps of one weight lie together.
    """
    found: list[Stretch] = []
    weight = 1
    while begin < end:
        ramp = ramp_of(weight)
        fits = end - begin
        if weight < drive.m:
            fits = _steps_that_fit(ramp, drive.m // weight, begin, end)
        if ramp.law.falling:
            stretch = Stretch(begin, begin + fits, weight)
            begin += fits
        else:
            stretch = Stretch(end - fits, end, weight)
            end -= fits
        if fits:
            found.append(stretch)
        weight *= 2
    return sorted(found)


def _steps_that_fit(ramp: Ramp, per_step: int, begin: int, end: int) -> int:
    """How many of some full steps, from the slow end of the ramp on, have pulses long enough."""

    def too_short(step: int) -> bool:
        shortest = (begin + step + 1) * per_step - 1
        if not ramp.law.falling:
            shortest = (end - step - 1) * per_step
        return ramp.period(shortest) < LONG_ENOUGH

    return bisect_left(range(end - begin), x=True, key=too_short)
