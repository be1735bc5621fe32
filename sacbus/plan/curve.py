"""What a plan looks like over time: the points that a picture is drawn through.

Owns how closely a motion is followed. Few pulses are followed one by one, each with the velocity
of its own period, so that the steps of a short ramp show; of many, evenly spread ones, so that a
plan costs the same to draw however many pulses it has. Knows nothing of drawing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from sacbus.motion import TICKS_PER_US, Profile, State
from sacbus.plan.sequence import Planned, Survey

__all__ = ["MOVING", "Curve", "Mark", "curve_of"]

TICKS_PER_SECOND: Final = 1_000_000 * TICKS_PER_US

POINTS: Final = 1_500
"""Pulses that are followed in the whole of a plan, for each of the three states."""

FEWEST: Final = 4
"""... but at least these for each command."""

EVEN: Final = 40
"""More pulses than these of a cruise are a straight line to the eye: two of them tell it."""

MOVING: Final = (State.ACCEL, State.CRUISE, State.DECEL)


@dataclass(frozen=True, slots=True)
class Mark:
    """A command's stretch of time, in seconds. number: from 1. endless: it goes on after that."""

    number: int
    text: str
    begin: float
    end: float
    endless: bool


@dataclass(slots=True)
class Curve:
    """Velocity and position over time, as points to be joined by straight lines.

    seconds: from the first load, never falling. rpm: clockwise positive. pulses: position,
    clockwise positive, from 0. spans: when the motor was in which state, as (begin, length).
    """

    seconds: list[float] = field(default_factory=list)
    rpm: list[float] = field(default_factory=list)
    pulses: list[int] = field(default_factory=list)
    spans: dict[State, list[tuple[float, float]]] = field(
        default_factory=lambda: {state: [] for state in MOVING}
    )
    marks: list[Mark] = field(default_factory=list)

    def add(self, ticks: int, rpm: float, pulses: int) -> None:
        """One point more."""
        self.seconds.append(ticks / TICKS_PER_SECOND)
        self.rpm.append(rpm)
        self.pulses.append(pulses)


def curve_of(plan: Iterable[Planned], survey: Survey) -> Curve:
    """The curve of a plan; an endless last command is followed for a while into its cruise."""
    curve = Curve()
    detail = max(FEWEST, POINTS // survey.commands)
    position = 0
    rested: int | None = 0  # since when the motor stands
    for number, planned in enumerate(plan, start=1):
        profile, start = planned.profile, planned.start
        sign = 1 if planned.motion.cw else -1
        if start != rested or number == 1:
            curve.add(rested or 0, 0, position)
            curve.add(start, 0, position)
        shares = profile.shares
        ramps = shares.acc * shares.unit, shares.dec * shares.unit
        cruise = shares.cruise_pulses
        if cruise is None:
            cruise = _shown_of_endless(profile, start, ramps[0])
        done = 0
        for state, count in zip(MOVING, (ramps[0], cruise, ramps[1]), strict=True):
            if count:
                begin, end = profile.time_of(done), profile.time_of(done + count)
                curve.spans[state].append(
                    ((start + begin) / TICKS_PER_SECOND, (end - begin) / TICKS_PER_SECOND)
                )
                most, few = (min(EVEN, detail), 2) if state is State.CRUISE else (detail, detail)
                for pulse, last in _followed(done, count, most, few):
                    at = profile.time_of(pulse)
                    rpm = sign * profile.velocity_at(at)
                    curve.add(start + at, rpm, position + sign * (pulse + 1))
                    if last is not None:
                        curve.add(start + profile.time_of(last), rpm, position + sign * last)
                done += count
        rested = start + profile.time_of(done)
        position += sign * done
        curve.marks.append(
            Mark(
                number,
                planned.line,
                start / TICKS_PER_SECOND,
                rested / TICKS_PER_SECOND,
                profile.duration is None,
            )
        )
    if curve.marks and not curve.marks[-1].endless:
        curve.add(rested or 0, 0, position)
    return curve


def _shown_of_endless(profile: Profile, start: int, ramp: int) -> int:
    """Pulses of an endless cruise that are drawn: a second, or a quarter of all before it."""
    begin = profile.time_of(ramp)
    return profile.pulses_at(begin + max(TICKS_PER_SECOND, (start + begin) // 4)) - ramp


def _followed(first: int, count: int, most: int, few: int) -> list[tuple[int, int | None]]:
    """The pulses to look at, and for each the pulse up to whose time it holds its velocity.

    Up to ``most`` pulses all of them, each held up to the next; else ``few`` spread evenly, the
    last of which is held to the end.
    """
    if count <= most:
        return [(pulse, pulse + 1) for pulse in range(first, first + count)]
    spread = [first + (count - 1) * n // (few - 1) for n in range(few)]
    return [*((pulse, None) for pulse in spread[:-1]), (spread[-1], first + count)]
