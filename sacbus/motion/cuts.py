"""What is left of a command that something cuts into.

Owns the ramps from the middle of a course: down to a stop, and to a new velocity. What was issued
stays as it is; the present pulse is the last of it. In full-step mode a stop with grace ends on a
full step, counted from the command's beginning.
Source: manual, "S/s", "N/n", "Continuous"; spec, "Stops".
"""

from sacbus.language import Motion
from sacbus.motion.course import Course, Place
from sacbus.motion.drive import Drive, Rpm, has_ramp
from sacbus.motion.gears import shifts_gears
from sacbus.motion.layout import accelerate, cruising, decelerate, rides_linear
from sacbus.motion.legs import Back, Even, Forth, Leg, State
from sacbus.motion.linear import LinearLaw
from sacbus.motion.shares import harmonic_steps, linear_index


def slowed_down(
    course: Course, issued: int, motion: Motion, drive: Drive, dec100: int, *, linear: bool
) -> list[Leg]:
    """The first `issued` pulses, and those that it takes to come to a stop.

    With dec100 of 999 only those up to the next full step, at the velocity that was reached.
    """
    place = course.place_of(issued - 1)
    pulses = _pulses_to_stop(place, motion, drive, dec100, linear=linear)
    if not motion.pulses:
        # The ramp is made of full steps; the pulses up to the next one come before it.
        pulses -= pulses % drive.m
        pulses += -course.travel(issued) % drive.m
    legs = course.legs_of_first(issued)
    pace = place.pace
    if has_ramp(dec100):
        geared = shifts_gears(motion, drive)
        legs += decelerate(drive, dec100, pulses, pace, linear=linear, geared=geared)
    elif pulses:
        count = pulses // pace.weight
        legs.append(Even(State.DECEL, count, pace.period, pace.speed, pace.weight))
    return legs


def retargeted(course: Course, issued: int, motion: Motion, drive: Drive) -> list[Leg]:
    """The first `issued` pulses, an ACCEL ramp to the velocity of `motion`, and its cruise.

    With auto-micro the ramp begins at the next full step, because only there gears are changed.
    """
    geared = shifts_gears(motion, drive)
    place = course.place_of(issued - 1)
    if geared:
        issued += -course.travel(issued) % drive.m // place.leg.weight
        place = course.place_of(issued - 1)
    legs = course.legs_of_first(issued)
    if motion.rpm > drive.slow and has_ramp(motion.acc100):
        present = rpm_of(place, drive)
        index = 0
        if motion.linear:
            index = _linear_position(place, motion.acc100, drive, behind=geared)
            target = linear_index(motion.rpm, motion.acc100, drive.steps_per_rev) * drive.m
            pulses = abs(target - index)
        else:
            start = max(present, drive.slow)
            pulses = harmonic_steps(start, motion.rpm, motion.acc100) * drive.m
        if pulses:
            legs += accelerate(motion, drive, present, index, pulses)
    legs.append(cruising(motion, drive, None))
    return legs


def rpm_of(place: Place, drive: Drive) -> Rpm:
    """The exact RPM of a pulse: an int where it is whole, else a Fraction."""
    return drive.rpm(place.pace.speed)


def _pulses_to_stop(
    place: Place, motion: Motion, drive: Drive, dec100: int, *, linear: bool
) -> int:
    """Finest microsteps from the velocity of a pulse down to the end of a ramp."""
    if not has_ramp(dec100):
        return 0
    over = place.pace.speed - drive.slow_speed
    if over <= 0 and not (linear and rides_linear(place.leg)):
        return 0
    if linear:
        return _linear_position(place, dec100, drive, behind=False)
    return over // dec100 if motion.pulses else over // (dec100 * drive.m) * drive.m


def _linear_position(place: Place, acc100: int, drive: Drive, *, behind: bool) -> int:
    """Where the linear ramp with acc100 is as fast as a pulse, in finest microsteps.

    On a linear ramp v^2 is index x acc, so the index carries over exactly; elsewhere the velocity
    tells, in full steps as the device reckons, and is `slow` at least. behind: where the pulse
    ends, in full steps.
    """
    leg = place.leg
    if isinstance(leg, Forth | Back) and isinstance(leg.ramp.law, LinearLaw):
        index = leg.index(place.pulse) + behind
        position = index * leg.weight * leg.ramp.law.acc100 // acc100
        return position - position % drive.m if behind else position
    rpm = max(rpm_of(place, drive), drive.slow)
    return linear_index(rpm, acc100, drive.steps_per_rev) * drive.m
