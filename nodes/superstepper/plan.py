"""What commands make of a motion: from how the motor runs to the stretches that it goes on with.

Owns the rules of the profile: where a ramp begins and ends, that a number of steps ends on its last
one, and what becomes of a direction that changes. Knows no time and no bytes. A motor that runs
finishes the period that it is in first; what stands here comes after it.

Decisions where the manual is silent or contradicts itself (spec, superstepper, "Motion"):

- From rest a motion begins at the starting speed, or at its own if that is slower.
- Slowing down is the ramp read backwards; a stop takes the one from the starting speed.
- Steps end on the last one: up, on, down. Where the ramps do not fit, the fastest value is used for
  which they do; where not even the way down does, it ends before it is down.
- In the other direction: first down to a stop, then as from rest.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from nodes.superstepper.course import ACCEL, CRUISE, DECEL, Stretch
from nodes.superstepper.ramp import Pace, Ramp, ramp
from sacbus.wire.superstepper import FULL_SPEED

__all__ = ["Entry", "Profile", "brake", "speed_plan", "steps_plan"]

#: The smallest value of the timer.
_FASTEST: Final = 1


class Entry(NamedTuple):
    """How the motor runs as a command takes over."""

    value: int
    divider: int
    sign: int

    def by(self, divider: int) -> int:
        """Its speed value by another divider; a slower one where it comes out between two."""
        value = -(-self.value * self.divider // divider)
        return min(max(value, _FASTEST), FULL_SPEED)


class Profile(NamedTuple):
    """The registers of RAM 0 to 4: where ramps begin, and how they go on."""

    start: int
    pace: Pace


class _Wanted(NamedTuple):
    """Which speed, and where: what a motion is to come to."""

    value: int
    divider: int
    sign: int
    profile: Profile

    def cruise(self, count: int | None, value: int | None = None) -> Stretch:
        value = self.value if value is None else value
        return Stretch(CRUISE, self.sign, value, self.divider, count)

    def faster(self, slow: int, fast: int, count: int | None = None) -> Stretch:
        """Up from ``slow`` to ``fast``, its first so many periods."""
        up = ramp(slow, fast, self.profile.pace, self.divider)
        return self._on(up, up.periods if count is None else count)

    def slower(self, fast: int, slow: int, count: int | None = None) -> Stretch:
        """Down from ``fast`` to ``slow``, its first so many periods."""
        up = ramp(slow, fast, self.profile.pace, self.divider)
        return self._on(up, up.periods if count is None else count, backwards=True)

    def _on(self, up: Ramp, count: int, *, backwards: bool = False) -> Stretch:
        state = DECEL if backwards else ACCEL
        return Stretch(state, self.sign, self.value, self.divider, count, up, backwards)

    def between(self, first: int, last: int) -> Stretch:
        """From one value to another."""
        return self.faster(first, last) if first > last else self.slower(first, last)


def brake(entry: Entry, profile: Profile) -> list[Stretch]:
    """Down to the starting speed, and to a stop."""
    if profile.start <= entry.value:
        return []
    down = ramp(profile.start, entry.value, profile.pace, entry.divider)
    value, divider, sign = entry
    return [Stretch(DECEL, sign, value, divider, down.periods, down, backwards=True)]


def speed_plan(
    entry: Entry | None, value: int, divider: int, sign: int, profile: Profile, *, ramps: bool
) -> list[Stretch]:
    """To a speed, and on at it for ever; ``ramps`` False: at once."""
    before, entry = _turned(entry, sign, profile)
    wanted = _Wanted(value, divider, sign, profile)
    if not ramps:
        return [*before, wanted.cruise(None)]
    first = _first(entry, value, divider, profile)
    return [*before, wanted.between(first, value), wanted.cruise(None)]


def steps_plan(
    entry: Entry | None, value: int, divider: int, sign: int, profile: Profile, steps: int
) -> list[Stretch]:
    """So many steps at a speed, up to it and down from it."""
    before, entry = _turned(entry, sign, profile)
    wanted = _Wanted(value, divider, sign, profile)
    first = _first(entry, value, divider, profile)
    start, pace = profile
    to_speed = wanted.between(first, value)
    down = wanted.slower(value, start) if start > value else wanted.cruise(0)
    assert to_speed.periods is not None  # a ramp has an end
    assert down.periods is not None
    on = steps - to_speed.periods - down.periods
    if on >= 0:
        return [*before, to_speed, wanted.cruise(on), down]
    if first > value:
        return [*before, *_peak(wanted, first, steps)]
    # It comes too fast to slow down to that speed first: down to the end at once.
    if start <= first:
        return [*before, wanted.slower(first, value, steps)]
    stopping = ramp(start, first, pace, divider).periods
    on = max(steps - stopping, 0)
    return [*before, wanted.cruise(on, first), wanted.slower(first, start, steps - on)]


def _peak(wanted: _Wanted, first: int, steps: int) -> list[Stretch]:
    """Up as far as the steps allow for the way down as well."""
    start, pace = wanted.profile
    up = ramp(first, wanted.value, pace, wanted.divider)
    whole = ramp(start, wanted.value, pace, wanted.divider)

    def stopping(value: int) -> int:
        """Periods from a value down to the starting speed: those before it on the way up."""
        if start <= value:
            return 0
        return whole.begun_before(-(-(start - value) // pace.rate) * pace.beat)

    low, high = 0, up.runs - 1
    while low < high:
        middle = (low + high + 1) // 2
        count, value = up.run(middle)
        if count + stopping(value) <= steps:
            low = middle
        else:
            high = middle - 1
    count, value = up.run(low)
    down = stopping(value)
    if count + down > steps:
        return [wanted.slower(value, start, steps)]
    return [
        wanted.faster(first, wanted.value, count),
        wanted.cruise(steps - count - down, value),
        wanted.slower(value, start) if down else wanted.cruise(0),
    ]


def _first(entry: Entry | None, value: int, divider: int, profile: Profile) -> int:
    """The value that a motion begins with."""
    return max(profile.start, value) if entry is None else entry.by(divider)


def _turned(entry: Entry | None, sign: int, profile: Profile) -> tuple[list[Stretch], Entry | None]:
    """What brings a motor to rest that runs the other way, and how it then runs."""
    if entry is None or entry.sign == sign:
        return [], entry
    return brake(entry, profile), None
