"""The motor: which pulses it follows, and where it stalls.

Owns the model. Its figures are two (drive.py): the pull-in speed, and the pull-out curve, which is
the acceleration that the motor follows at each speed with its load. What the model says:

- A pulse whose velocity differs from that of the pulse before by more than the pull-in speed is not
  followed. That is a start from rest, a command that goes on at another velocity, a fall at the
  start of deceleration, a ramp of giant steps, and a reversal, whose velocities have opposite signs
  (so one is followed up to half the pull-in speed, as the manual has it).
- A pulse of a ramp that asks for more acceleration, up or down, than the curve has at its velocity
  is not followed; nor is any pulse beyond the curve's last RPM.
- A motor that has stalled stands where it is. It is with the pulses again at the first one that is
  not above the pull-in speed, and that it can follow.

What a rotor does that is stopped from full speed depends on its inertia: that is not modelled.
Source: manual, "Infinite Acceleration" (V'), "Queue" (half of V'); spec, "Limits of the hardware".
All of the above are decisions.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from math import pi
from typing import Final, NamedTuple

from sacbus.motion.course import Course
from sacbus.motion.drive import Drive
from sacbus.motion.harmonic import HarmonicLaw
from sacbus.motion.layout import pace_of
from sacbus.motion.legs import Back, Forth, Leg
from sacbus.motion.linear import LinearLaw

RPM_TO_RAD: Final = 2 * pi / 60
"""rad/s of an RPM."""

ENDLESS: Final = 1 << 62
"""Pulses of a cruise for ever, as far as a search goes."""


class Entry(NamedTuple):
    """How the rotor comes into a profile.

    rpm: the velocity of the pulses before, 0 from rest, negative when they turned the other way.
    stalled: it has not followed them.
    """

    rpm: float = 0.0
    stalled: bool = False


class Slip(NamedTuple):
    """Pulses [first, until) that the motor does not follow; None = all from the first on."""

    first: int
    until: int | None
    why: str


def slips(course: Course, drive: Drive, entry: Entry) -> list[Slip]:
    """Where the motor is not with the pulses of a course, in order; none for a motor unknown."""
    if drive.pull_in_rpm is None or not course.legs:
        return []
    found: list[Slip] = []
    since = 0 if entry.stalled else None
    why = "it has stalled before"
    before_rpm = entry.rpm
    for leg, before in zip(course.legs, course.before, strict=False):
        for stretch in _stretches(leg, drive, drive.pull_in_rpm, before_rpm):
            at = before + stretch.first
            if since is None:
                if stretch.fault:
                    since, why = at, stretch.fault
            elif stretch.slow and not stretch.fault:
                if at > since:
                    found.append(Slip(since, at, why))
                since = None
        before_rpm = _rpm(leg, drive, (leg.count or 1) - 1)
    if since is not None:
        found.append(Slip(since, None, why))
    return found


def lost(course: Course, gone: list[Slip], pulses: int) -> int:
    """Finest microsteps that the rotor is behind when the first so many pulses are done."""
    return sum(
        course.travel(pulses if until is None else min(until, pulses)) - course.travel(first)
        for first, until, _ in gone
        if first < pulses
    )


class _Stretch(NamedTuple):
    """Pulses of a leg from one on: what keeps the motor from following, and whether it is slow."""

    first: int
    fault: str
    slow: bool


class _Fault(NamedTuple):
    """Pulses [first, until) that the motor cannot follow."""

    first: int
    until: int
    why: str


def _stretches(leg: Leg, drive: Drive, pull_in: int, before_rpm: float) -> Iterator[_Stretch]:
    """A leg cut up where either changes; as many as the curve has points, and a few."""
    count = leg.count or ENDLESS
    slower = bisect_right(range(count), float(pull_in), key=_climb(leg, drive))
    faults = _jumps(leg, drive, pull_in, before_rpm)
    climbs = _climbs(leg)
    for low, high, why in _overload(leg, drive):
        faults.append(_Fault(low, high, why) if climbs else _Fault(count - high, count - low, why))
    slow_from, slow_until = (0, slower) if climbs else (count - slower, count)
    cuts = {0, slow_from, slow_until, *(end for fault in faults for end in fault[:2])}
    for first in sorted(cut for cut in cuts if cut < count):
        fault = next((one.why for one in faults if one.first <= first < one.until), "")
        yield _Stretch(first, fault, slow_from <= first < slow_until)


def _jumps(leg: Leg, drive: Drive, pull_in: int, before_rpm: float) -> list[_Fault]:
    """Where the velocity changes by more than the pull-in speed from one pulse to the next."""
    faults = []
    rpm = _rpm(leg, drive, 0)
    if abs(rpm - before_rpm) > pull_in:
        was = f"{before_rpm:.0f}" if before_rpm else "rest"
        faults.append(_Fault(0, 1, f"from {was} to {rpm:.0f} RPM at once"))
    if isinstance(leg, Forth | Back) and isinstance(leg.ramp.law, HarmonicLaw):
        # Its steps are all alike; those of a linear ramp are smaller than what it begins with.
        step = float(drive.rpm(abs(leg.ramp.law.slope)))
        if step > pull_in:
            faults.append(_Fault(1, leg.count, f"a ramp in steps of {step:.0f} RPM"))
    return faults


def _overload(leg: Leg, drive: Drive) -> Iterator[_Fault]:
    """Where the pull-out curve is exceeded; pulses counted from the slow end of the leg."""
    curve = drive.pull_out
    if not curve:
        return
    climb, demand = _climb(leg, drive), _demand(leg, drive)
    count = leg.count or ENDLESS
    edges = [bisect_right(range(count), float(rpm), key=climb) for rpm, _ in curve]
    for begin, end, low, high in zip((0, *edges), edges, (curve[0], *curve), curve, strict=False):
        if begin < end:
            yield from _excess(range(begin, end), climb, demand, low, high)
    if edges[-1] < count:
        yield _Fault(edges[-1], count, f"it turns at {curve[-1][0]} RPM at most")


def _excess(
    pulses: range,
    climb: Callable[[int], float],
    demand: Callable[[float], float],
    low: tuple[int, int],
    high: tuple[int, int],
) -> Iterator[_Fault]:
    """Which of some pulses ask for more than the line between two points of the curve has.

    Demand is a straight line over the velocity too: the two cross once at most.
    """

    def too_much(pulse: int) -> bool:
        rpm = climb(pulse)
        share = (rpm - low[0]) / (high[0] - low[0]) if low != high else 0.0
        return demand(rpm) > low[1] + share * (high[1] - low[1])

    begin, end = pulses.start, pulses.stop
    at_begin, at_end = too_much(begin), too_much(end - 1)
    if at_end and not at_begin:
        begin += bisect_left(pulses, x=True, key=too_much)
    elif at_begin and not at_end:
        end = begin + bisect_left(pulses, x=True, key=lambda pulse: not too_much(pulse))
    elif not at_begin:
        return
    rpm = climb(begin)
    yield _Fault(begin, end, f"{demand(rpm):.0f} rad/s² at {rpm:.0f} RPM")


def _demand(leg: Leg, drive: Drive) -> Callable[[float], float]:
    """The acceleration of a leg in rad/s², up or down, by the velocity in RPM."""
    constant = slope = 0.0
    if isinstance(leg, Forth | Back):
        law = leg.ramp.law
        if isinstance(law, LinearLaw):
            constant = law.acc100 / 100
        if isinstance(law, HarmonicLaw):
            # So many RPM more a full step, of which v x sprf are made in a minute.
            acc = abs(law.slope) / leg.weight / 100
            slope = acc * drive.steps_per_rev / 60 * RPM_TO_RAD
    return lambda rpm: constant + slope * rpm


def _climb(leg: Leg, drive: Drive) -> Callable[[int], float]:
    """The velocity of the pulses of a leg, counted from its slow end."""
    if _climbs(leg):
        return lambda pulse: _rpm(leg, drive, pulse)
    last = (leg.count or ENDLESS) - 1
    return lambda pulse: _rpm(leg, drive, last - pulse)


def _climbs(leg: Leg) -> bool:
    """True when velocity never falls along a leg."""
    if isinstance(leg, Forth | Back):
        return leg.ramp.law.falling is isinstance(leg, Forth)
    return True


def _rpm(leg: Leg, drive: Drive, pulse: int) -> float:
    """Velocity of a pulse by its real period."""
    pace = pace_of(leg, pulse)
    return drive.real_rpm(pace.period, pace.weight)
