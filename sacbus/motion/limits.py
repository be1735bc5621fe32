"""What a command asks of the hardware that the hardware cannot give, as warnings.

Owns the limits and their wording. The node obeys all the same, as SAC would ("SAC is not
forgiving"); plan, trace and dashboard show what is found here.
Source: manual, "Discussion" (linear ramps), "Slow speed", "V"; spec, "Limits of the hardware".
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from sacbus.language import Motion
from sacbus.motion.course import Course, Place
from sacbus.motion.drive import TICKS_PER_US, Drive, Rpm
from sacbus.motion.layout import rides_linear
from sacbus.motion.legs import Back, State
from sacbus.motion.motor import Entry, slips
from sacbus.motion.shares import Shares

SHORTEST_PERIOD_US: Final = 2
"""A driver wants a pulse of 1 us and a rest of 1 us (manual, "Slow speed")."""

LINEAR_COMPUTING_US: Final = 52
"""What a step of the linear ramp takes to compute (manual, "Discussion")."""

COARSE_ABOVE_RPM: Final = 600
"""Beyond it a velocity is better given as a cycle (manual, "Discussion")."""


class Limit(Enum):
    """Which limit a command runs into."""

    PERIOD = "period"
    FLOOR = "floor"
    CLOCK = "clock"
    LINEAR = "linear"
    TARGET = "target"
    FALL = "fall"
    PULL_IN = "pull-in"
    STALL = "stall"
    COARSE = "coarse"


@dataclass(frozen=True, slots=True)
class Caution:
    """A limit that a command runs into, and a sentence for people."""

    limit: Limit
    text: str

    def __str__(self) -> str:
        return self.text


def harmless(motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares) -> bool:
    """True when a glance tells that a command's pulses run into no limit, as nearly all do.

    A whole command that does not come down from a higher speed is nowhere faster than its cruise.
    """
    least = LINEAR_COMPUTING_US if motion.linear else SHORTEST_PERIOD_US
    period = drive.cruise_period(motion.cycle_us)
    return (
        not shares.truncated
        and start_rpm <= motion.rpm
        and drive.pull_in_rpm is None
        and period >= TICKS_PER_US * least
        and period > TICKS_PER_US * drive.pulse_us
    )


def of_velocity(motion: Motion, drive: Drive) -> Iterator[Caution]:
    """Whether the velocity of a command, above COARSE_ABOVE_RPM, could be said better."""
    cycle_us = 60_000_000 // (drive.steps_per_rev * motion.rpm)
    if motion.cycle_us == cycle_us and not motion.by_cycle:
        yield Caution(
            Limit.COARSE,
            f"V{motion.rpm} is coarser than a cycle; VC{cycle_us} says the same and can be tuned",
        )


def cautions(
    motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares, course: Course
) -> Iterator[Caution]:
    """All that the pulses of a planned command run into."""
    legs = course.legs
    if not legs:
        return
    ends = [Place(leg, at) for leg in legs for at in (0, (leg.count or 1) - 1)]
    yield from _of_fastest(min(place.pace.period for place in ends), drive)
    ramped = [place.pace.period for place in ends if rides_linear(place.leg)]
    if ramped and min(ramped) < LINEAR_COMPUTING_US * TICKS_PER_US:
        yield Caution(
            Limit.LINEAR,
            f"a linear ramp comes to a pulse period of {_us(min(ramped))}; "
            f"computing one takes {LINEAR_COMPUTING_US} µs",
        )
    if shares.truncated:
        if shares.accelerates:
            yield Caution(
                Limit.TARGET,
                f"{_steps(motion.steps)} too few for the ramps: {motion.rpm} RPM is not reached",
            )
        yield from _of_fall(drive, start_rpm, course)
    yield from _of_motor(drive, start_rpm, course)


def _steps(count: int | None) -> str:
    return "1 step is" if count == 1 else f"{count} steps are"


def _of_fastest(period: int, drive: Drive) -> Iterator[Caution]:
    if period < SHORTEST_PERIOD_US * TICKS_PER_US:
        yield Caution(
            Limit.PERIOD,
            f"pulses follow each other after {_us(period)}; "
            f"a driver wants {SHORTEST_PERIOD_US} µs at least",
        )
    if period == 1:
        yield Caution(Limit.FLOOR, "pulse periods are down to one tick, the least there is")
    if period <= drive.pulse_us * TICKS_PER_US:
        yield Caution(
            Limit.CLOCK,
            f"clk is {drive.pulse_us} µs wide, but the next pulse comes after {_us(period)}: "
            "it falls one tick before that",
        )


def _of_motor(drive: Drive, start_rpm: Rpm, course: Course) -> Iterator[Caution]:
    """Where the motor does not follow, if it is known what it can."""
    for slip in slips(course, drive, Entry(float(start_rpm))):
        if start_rpm or slip.first:
            yield Caution(Limit.STALL, f"the motor stalls at pulse {slip.first}: {slip.why}")
        else:
            yield Caution(
                Limit.PULL_IN,
                f"{slip.why}: the motor pulls in up to {drive.pull_in_rpm} RPM and may stall",
            )


def _of_fall(drive: Drive, start_rpm: Rpm, course: Course) -> Iterator[Caution]:
    """Deceleration that sets in further below the velocity before it than a step of it makes up."""
    at = next((n for n, leg in enumerate(course.legs) if leg.state is State.DECEL), None)
    if at is None or not isinstance(down := course.legs[at], Back):
        return
    if at:
        above = course.legs[at - 1]
        before = above.speed((above.count or 1) - 1)
    elif start_rpm:
        before = drive.speed(max(start_rpm, drive.slow))
    else:
        return
    if before > down.ramp.speed(down.end + drive.m // down.weight):
        yield Caution(
            Limit.FALL,
            f"deceleration sets in at {float(drive.rpm(down.speed(0))):.0f} RPM, "
            f"straight from {float(drive.rpm(before)):.0f} RPM",
        )


def _us(ticks: int) -> str:
    return f"{ticks / TICKS_PER_US:g} µs"
