"""From shares to legs: which stretch of which ramp each pulse of a command rides.

Owns the choice of ramp, the speed a cut ramp has reached, and the rule that deceleration never
runs faster than that.
Source: manual, "Profile Planning"; spec, "Profile".
"""

from typing import NamedTuple

from sacbus.language import Motion
from sacbus.motion.drive import NO_RAMP, Drive, Rpm
from sacbus.motion.harmonic import harmonic
from sacbus.motion.legs import Back, Even, Forth, Leg, State
from sacbus.motion.linear import LinearLaw, linear
from sacbus.motion.ramp import Ramp
from sacbus.motion.shares import Shares, linear_index


class Pace(NamedTuple):
    """How fast a pulse runs: nominal speed (see drive.py) and real period in ticks."""

    speed: int
    period: int


def harmonic_ramp(drive: Drive, start: int, slope: int) -> Ramp:
    """The table of a harmonic ramp from a speed; slope in hundredths of an RPM a step."""
    return harmonic(drive.rate, start, slope, drive.offset)


def linear_ramp(drive: Drive, acc100: int) -> Ramp:
    """The table of the linear ramp from standstill."""
    return linear(drive.steps_per_rev * drive.m, acc100, drive.rate, drive.offset)


def stopping_ramp(drive: Drive, dec100: int, *, linear: bool) -> Ramp:
    """The table that deceleration to a stop rides backwards."""
    return linear_ramp(drive, dec100) if linear else harmonic_ramp(drive, drive.slow_speed, dec100)


def cruise_pace(motion: Motion, drive: Drive) -> Pace:
    """Pace of the cruise: the period follows the cycle, the speed the integer RPM."""
    return Pace(drive.speed(motion.rpm), drive.cruise_period(motion.cycle_us))


def start_index(motion: Motion, drive: Drive, start_rpm: Rpm) -> int:
    """Pulse of the linear ramp at which a command with this start velocity begins; 0 = rest."""
    if start_rpm == 0 or not 0 < motion.acc100 < NO_RAMP:
        return 0
    start = max(start_rpm, drive.slow)
    return linear_index(start, motion.acc100, drive.steps_per_rev) * drive.m


def accelerate(motion: Motion, drive: Drive, start_rpm: Rpm, index: int, pulses: int) -> Leg:
    """The first `pulses` of the ramp from the start velocity towards the command's own.

    start_rpm in RPM, 0 = rest (harmonic ramps); index as `start_index` (linear ramps). A change
    down is an ACCEL ramp as well (manual, "Profile Planning").
    """
    if motion.linear:
        ramp = linear_ramp(drive, motion.acc100)
        target = linear_index(motion.rpm, motion.acc100, drive.steps_per_rev) * drive.m
        if target >= index:
            return Forth(State.ACCEL, ramp, index, pulses)
        return Back(State.ACCEL, ramp, index, pulses)
    start = drive.speed(max(start_rpm, drive.slow))
    upwards = start <= drive.speed(motion.rpm)
    slope = motion.acc100 if upwards else -motion.acc100
    return Forth(State.ACCEL, harmonic_ramp(drive, start, slope), 0, pulses)


def decelerate(drive: Drive, dec100: int, pulses: int, reached: Pace, *, linear: bool) -> list[Leg]:
    """The ramp that comes to `slow` (linear: to index 0) with its last pulse.

    Pulse j from the end runs at the ramp's own speed there, or at the speed reached where that is
    less; so a ramp that is longer than the speed asks for begins with an even stretch.
    """
    if not pulses:
        return []
    ramp = stopping_ramp(drive, dec100, linear=linear)
    if linear:
        ramped = _pulses_not_faster(ramp, pulses, reached.period)
    else:
        ramped = max(0, min(pulses, (reached.speed - drive.slow_speed) // dec100 + 1))
    legs: list[Leg] = []
    if ramped < pulses:
        legs.append(Even(State.DECEL, pulses - ramped, reached.period, reached.speed))
    if ramped:
        legs.append(Back(State.DECEL, ramp, ramped, ramped))
    return legs


def lay_out(motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares) -> tuple[Leg, ...]:
    """The legs of a command whose steps are shared out."""
    cruise = cruise_pace(motion, drive)
    n_acc, n_dec = shares.acc * shares.unit, shares.dec * shares.unit
    legs: list[Leg] = []
    reached = cruise
    if shares.accelerates:
        index = start_index(motion, drive, start_rpm) if motion.linear else 0
        # Where truncation left no step of the ramp, its first pulse is as far as it would get.
        ramp = accelerate(motion, drive, start_rpm, index, max(1, n_acc))
        if n_acc:
            legs.append(ramp)
        if shares.truncated:
            reached = pace_of(ramp, max(1, n_acc) - 1)
    n_cruise = shares.cruise_pulses
    if n_cruise != 0:
        legs.append(Even(State.CRUISE, n_cruise, cruise.period, cruise.speed))
    if shares.truncated:
        legs += decelerate(drive, motion.dec100, n_dec, reached, linear=motion.linear)
    elif n_dec:
        # A whole ramp comes down from the command's own speed and needs no holding back.
        down = stopping_ramp(drive, motion.dec100, linear=motion.linear)
        legs.append(Back(State.DECEL, down, n_dec, n_dec))
    return tuple(legs)


def pace_of(leg: Leg, pulse: int) -> Pace:
    """Pace of a pulse of a leg."""
    return Pace(leg.speed(pulse), leg.time(pulse + 1) - leg.time(pulse))


def linear_position(leg: Leg, pulse: int, acc100: int, drive: Drive) -> int:
    """Pulse of the linear ramp with acc100 that is as fast as a pulse of a leg.

    On a linear ramp v^2 is index x acc, so the index carries over exactly; elsewhere the velocity
    tells, in full steps as the device reckons, and is `slow` at least.
    """
    if isinstance(leg, Forth | Back) and isinstance(leg.ramp.law, LinearLaw):
        return leg.index(pulse) * leg.ramp.law.acc100 // acc100
    rpm = max(drive.rpm(leg.speed(pulse)), drive.slow)
    return linear_index(rpm, acc100, drive.steps_per_rev) * drive.m


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
