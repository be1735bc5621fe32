"""Motion judged by what it may not do, whatever the formulas were."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import Drive, Profile, State, plan
from tests.motion.reference import Setup
from tests.motion.strategies import drive_of, motions, setups
from tests.motion.test_against_reference import walkable

END = 1 << 60

Seen = tuple[State, int, int]
"""State, nominal speed (see drive.py) and weight of a pulse."""


def pulses_of(profile: Profile) -> list[Seen]:
    seen = []
    for leg in profile.course.legs:
        assert leg.count is not None
        seen += [(leg.state, leg.speed(pulse), leg.weight) for pulse in range(leg.count)]
    return seen


def allowed(before: Seen, after: Seen, motion: Motion, drive: Drive, truncated: bool) -> bool:
    """Whether a harmonic command may change from one velocity to another between two pulses."""
    change = after[1] - before[1]
    match before[0], after[0]:
        case State.ACCEL, State.ACCEL:
            # A pulse of so many microsteps brings the velocity up, or down, by as many shares.
            return abs(change) == motion.acc100 * before[2]
        case State.ACCEL, State.CRUISE:
            # What is left to the target is less than a full step would have brought.
            return abs(change) < motion.acc100 * (drive.m + before[2])
        case State.DECEL, State.DECEL:
            # Held at the velocity reached, or coming down, or from the one to the other.
            return 0 <= -change <= motion.dec100 * after[2]
        case State.CRUISE, State.DECEL:
            return 0 < -change < motion.dec100 * (drive.m + after[2])
        case State.ACCEL, State.DECEL if truncated:
            return change <= 0  # a fall is warned of, a leap is not allowed
        case State.ACCEL, State.DECEL:
            return abs(change) < max(motion.acc100, motion.dec100) * 2 * drive.m
        case _:
            return before == after


@pytest.mark.slow
@settings(max_examples=300)
@given(data=st.data(), setup=setups, start=st.sampled_from([0, 0, 5, 90, 400]))
def test_no_velocity_is_beyond_the_target_and_no_jump_is_one_that_the_rules_do_not_have(
    data: st.DataObject, setup: Setup, start: int
) -> None:
    motion = data.draw(motions(setup.sprf, steps=max(10, 1_000 // setup.m)))
    motion = walkable(setup, motion, start)
    drive = drive_of(setup)
    profile = plan(motion, drive, start)
    seen = pulses_of(profile)
    assert len(seen) == profile.pulses

    times = profile.pulse_times(0, END)
    assert profile.duration is not None
    periods = np.diff(times, append=profile.duration)
    assert periods.min() >= 1
    # As quick as the target or the start at most, in ticks of a finest microstep.
    slowest = max(start, drive.slow)
    least = min(
        drive.cruise_period(motion.cycle_us),
        max(1, drive.rate // drive.speed(max(slowest, 1)) + drive.offset),
    )
    # (The linear ramp has its own arithmetic: a tick more or less.)
    assert periods.min() >= least - motion.linear

    fastest = max(drive.speed(motion.rpm), drive.speed(slowest))
    first = seen[0]
    if not motion.linear:
        assert max(speed for _, speed, _ in seen) <= fastest
        ways_in = {drive.speed(motion.rpm), drive.speed(slowest)}
        assert first[1] in ways_in or first[0] is State.DECEL
        truncated = profile.shares.truncated
        for before, after in pairwise(seen):
            assert allowed(before, after, motion, drive, truncated), (before, after)
        if seen[-1][0] is State.DECEL:
            assert seen[-1][1] <= drive.slow_speed
    else:
        # In one gear a ramp goes one way, and the way down goes down.
        for before, after in pairwise(seen):
            assert before[0] is not State.DECEL or after[0] is State.DECEL
        for state, ways in ((State.ACCEL, (-1, 1)), (State.DECEL, (-1,))):
            changes = {
                np.sign(after[1] - before[1])
                for before, after in pairwise(seen)
                if before[0] is after[0] is state and before[2] == after[2]
            } - {0}
            assert len(changes) <= 1
            assert changes <= set(ways)
