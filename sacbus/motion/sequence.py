"""From one command to the next: when its first pulse comes, and at which velocity it starts.

Owns the one rule that the plan of a sequence and the plan of a toolpath share: load times, GAP,
the velocity that is kept, the start wait, and the release of a command that is held at sync. It is
the behaviour of a node that runs its queue without anybody cutting in and without telling of starts
and ends (soft ops); a node itself counts in ns, because its clock may be any.
Source: manual, "GAP", "sync", "T/t start wait"; spec, motion ("GAP", "Start wait and ops").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from sacbus.language import Motion
from sacbus.motion.drive import TICKS_PER_US, Rpm
from sacbus.motion.gap import gap_passes, load_ticks
from sacbus.motion.profile import Profile

__all__ = ["REST", "Beginning", "Left", "begin", "release"]


@dataclass(frozen=True, slots=True)
class Left:
    """What a command leaves to the next one, but for the time.

    kept_rpm: the velocity that it ends at, 0 when it came to rest. ramps: its acceleration,
    deceleration and kind; None: no command has been loaded yet. last_period: ticks of its last
    pulse, against which GAP is measured; 0 if nothing is kept.
    """

    kept_rpm: Rpm = 0
    ramps: tuple[int, int, bool] | None = None
    last_period: int = 0

    @classmethod
    def by(cls, profile: Profile) -> Left:
        """What is left by a command that ran to its end."""
        # Finding the last period lays the profile out; only a velocity that is kept needs it.
        period = profile.last_period if profile.kept_rpm else 0
        return cls(profile.kept_rpm, _ramps(profile.motion), period)


REST: Final = Left()
"""Before the first command."""


class Beginning(NamedTuple):
    """How a command begins. Ticks, on the clock that the end before it was given on.

    loaded: from when on it no longer matters what its place in the queue holds. start: its first
    pulse. start_rpm: the velocity it starts from; 0: from rest.
    """

    loaded: int
    start: int
    start_rpm: Rpm


def begin(motion: Motion, before: Left, end: int, *, gap: bool = True) -> Beginning:
    """How a queued command begins that comes after one which ended at ``end``.

    With ``gap`` it goes on at the velocity that was kept if it may start within the last period;
    without, always. Then loading runs inside that period and takes no time, unless there is a start
    wait. The first command of all is taken to be loaded at ``end``.
    """
    wait = motion.wait_us * TICKS_PER_US
    if before.ramps is None:
        return Beginning(end, end + wait, before.kept_rpm)
    load = load_ticks(acceleration_changes=_ramps(motion) != before.ramps)
    kept = before.kept_rpm
    seamless = kept and (not gap or gap_passes(wait + load, before.last_period))
    start = end + wait
    if not seamless or wait:
        start += load
    return Beginning(end + load, start, kept if seamless else 0)


def release(motion: Motion, at: int) -> Beginning:
    """How a command begins that has long been held at sync when it is released.

    It was loaded meanwhile, so nothing but its own start wait comes between; and it starts from
    rest, unless what ran before it ended less than one period ago, which this does not know.
    """
    return Beginning(at, at + motion.wait_us * TICKS_PER_US, 0)


def _ramps(motion: Motion) -> tuple[int, int, bool]:
    return motion.acc100, motion.dec100, motion.linear
