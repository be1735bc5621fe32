"""From shares to legs: which stretch of which ramp each pulse of a command rides.

Owns the choice of ramp, the speed a cut ramp has reached, and the rule that deceleration never
runs faster than that. Counts of pulses are in finest microsteps (drive.py) throughout; what that
makes of them with auto-micro is decided in gears.py.
Source: manual, "Profile Planning"; spec, "Profile".
"""

from functools import partial
from typing import NamedTuple

from sacbus.language import Motion
from sacbus.motion.drive import Drive, Rpm, has_ramp
from sacbus.motion.gears import RampOf, cruise_weight, shifts_gears, stretches
from sacbus.motion.harmonic import harmonic
from sacbus.motion.legs import Back, Even, Forth, Leg, State
from sacbus.motion.linear import LinearLaw, linear
from sacbus.motion.ramp import Ramp
from sacbus.motion.shares import Shares, linear_index


class Pace(NamedTuple):
    """How fast a pulse runs: nominal speed, real period in ticks, and weight (see drive.py)."""

    speed: int
    period: int
    weight: int = 1


def harmonic_ramp(drive: Drive, start: int, slope: int, weight: int = 1) -> Ramp:
    """The table of a harmonic ramp from a speed; slope in hundredths of an RPM a step."""
    rate = drive.rate if weight == 1 else drive.rate_of(weight)
    return harmonic(rate, start, slope * weight, drive.offset)


def linear_ramp(drive: Drive, acc100: int, weight: int = 1) -> Ramp:
    """The table of the linear ramp from standstill."""
    rate = drive.rate if weight == 1 else drive.rate_of(weight)
    return linear(drive.steps_per_rev * drive.m // weight, acc100, rate, drive.offset)


def stopping_ramp(drive: Drive, dec100: int, *, linear: bool) -> RampOf:
    """The tables that deceleration to a stop rides backwards, by the weight of a pulse."""
    if linear:
        return partial(linear_ramp, drive, dec100)
    return partial(harmonic_ramp, drive, drive.slow_speed, dec100)


def cruising(motion: Motion, drive: Drive, pulses: int | None) -> Even:
    """The cruise: its period follows the cycle, its speed the integer RPM."""
    weight = cruise_weight(drive, motion.cycle_us) if shifts_gears(motion, drive) else 1
    period = drive.cruise_period(motion.cycle_us, weight)
    count = None if pulses is None else pulses // weight
    return Even(State.CRUISE, count, period, drive.speed(motion.rpm), weight)


def start_index(motion: Motion, drive: Drive, start_rpm: Rpm) -> int:
    """Pulse of the linear ramp at which a command with this start velocity begins; 0 = rest."""
    if start_rpm == 0 or not has_ramp(motion.acc100):
        return 0
    start = max(start_rpm, drive.slow)
    return linear_index(start, motion.acc100, drive.steps_per_rev) * drive.m


def accelerate(motion: Motion, drive: Drive, start_rpm: Rpm, index: int, pulses: int) -> list[Leg]:
    """The first `pulses` of the ramp from the start velocity towards the command's own.

    start_rpm in RPM, 0 = rest (harmonic ramps); index as `start_index` (linear ramps). A change
    down is an ACCEL ramp as well (manual, "Profile Planning").
    """
    geared = shifts_gears(motion, drive)
    if motion.linear:
        ramp_of = partial(linear_ramp, drive, motion.acc100)
        target = linear_index(motion.rpm, motion.acc100, drive.steps_per_rev) * drive.m
        if target < index:
            return ride(State.ACCEL, ramp_of, drive, index - pulses, index, geared, back=True)
        return ride(State.ACCEL, ramp_of, drive, index, index + pulses, geared)
    start = drive.speed(max(start_rpm, drive.slow))
    upwards = start <= drive.speed(motion.rpm)
    slope = motion.acc100 if upwards else -motion.acc100
    return ride(State.ACCEL, partial(harmonic_ramp, drive, start, slope), drive, 0, pulses, geared)


def ride(
    state: State,
    ramp_of: RampOf,
    drive: Drive,
    begin: int,
    end: int,
    geared: bool,
    *,
    back: bool = False,
) -> list[Leg]:
    """The legs of a ramp between two of its pulses, forwards or back.

    With auto-micro (geared) both are at full steps of the ramp.
    """
    if not geared:
        ramp = ramp_of(1)
        if back:
            return [Back(state, ramp, end, end - begin)]
        return [Forth(state, ramp, begin, end - begin)]
    legs: list[Leg] = []
    m = drive.m
    for first, last, weight in stretches(ramp_of, drive, begin // m, end // m):
        per_step = m // weight
        ramp, count = ramp_of(weight), (last - first) * per_step
        if back:
            legs.append(Back(state, ramp, last * per_step, count, weight))
        else:
            legs.append(Forth(state, ramp, first * per_step, count, weight))
    return legs[::-1] if back else legs


def decelerate(
    drive: Drive, dec100: int, pulses: int, reached: Pace, *, linear: bool, geared: bool
) -> list[Leg]:
    """The ramp that comes to `slow` (linear: to index 0) with its last pulse.

    Pulse j from the end runs at the ramp's own speed there, or at the speed reached where that is
    less; so a ramp that is longer than the speed asks for begins with an even stretch. Up to the
    first full step of the ramp itself (geared) pulses keep the weight that was reached.
    """
    weight = reached.weight
    count = pulses // weight
    if not count:
        return []
    ramp_of = stopping_ramp(drive, dec100, linear=linear)
    ramp = ramp_of(weight)
    if linear:
        ramped = _pulses_not_faster(ramp, count, reached.period)
    else:
        over = reached.speed - drive.slow_speed
        ramped = max(0, min(count, over // (dec100 * weight) + 1))
    legs: list[Leg] = []
    if ramped < count:
        even = Even(State.DECEL, count - ramped, reached.period, reached.speed, weight)
        legs.append(even)
    whole = ramped
    if geared:
        whole -= ramped % (drive.m // weight)
        if whole < ramped:
            legs.append(Back(State.DECEL, ramp, ramped, ramped - whole, weight))
    if whole:
        legs += ride(State.DECEL, ramp_of, drive, 0, whole * weight, geared, back=True)
    return legs


def lay_out(motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares) -> tuple[Leg, ...]:
    """The legs of a command whose steps are shared out."""
    geared = shifts_gears(motion, drive)
    n_acc, n_dec = shares.acc * shares.unit, shares.dec * shares.unit
    legs: list[Leg] = []
    if shares.accelerates and n_acc:
        index = start_index(motion, drive, start_rpm) if motion.linear else 0
        legs += accelerate(motion, drive, start_rpm, index, n_acc)
    cruise = shares.cruise_pulses
    if cruise != 0:
        legs.append(cruising(motion, drive, cruise))
    if n_dec and not shares.truncated:
        # A whole ramp comes down from the command's own speed and needs no holding back.
        down = stopping_ramp(drive, motion.dec100, linear=motion.linear)
        legs += ride(State.DECEL, down, drive, 0, n_dec, geared, back=True)
    elif n_dec:
        reached = _reached(motion, drive, start_rpm, shares, legs)
        legs += decelerate(
            drive, motion.dec100, n_dec, reached, linear=motion.linear, geared=geared
        )
    return tuple(legs)


def _reached(motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares, legs: list[Leg]) -> Pace:
    """How fast a truncated command has become when its deceleration begins."""
    if legs:
        return pace_of(legs[-1], (legs[-1].count or 1) - 1)
    if not shares.accelerates:
        return pace_of(cruising(motion, drive, None), 0)
    # Truncation left no step of the ramp: its first pulse is as far as it would get.
    index = start_index(motion, drive, start_rpm) if motion.linear else 0
    return pace_of(accelerate(motion, drive, start_rpm, index, drive.m)[0], 0)


def pace_of(leg: Leg, pulse: int) -> Pace:
    """Pace of a pulse of a leg."""
    return Pace(leg.speed(pulse), leg.time(pulse + 1) - leg.time(pulse), leg.weight)


def rides_linear(leg: Leg) -> bool:
    """True on a linear ramp, which goes down to standstill and not to `slow`."""
    return isinstance(leg, Forth | Back) and isinstance(leg.ramp.law, LinearLaw)


def _pulses_not_faster(ramp: Ramp, pulses: int, period: int) -> int:
    """How many of a ramp's first pulses last at least `period`; periods only shrink along it."""
    if ramp.period(pulses - 1) >= period:
        return pulses
    low, high = 0, pulses - 1
    while low < high:
        middle = (low + high) // 2
        if ramp.period(middle) >= period:
            low = middle + 1
        else:
            high = middle
    return low
