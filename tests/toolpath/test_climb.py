"""Ramps that are laid beside ideal ones: how near they come, by the device's own pulses."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import NO_RAMP, Drive, plan
from sacbus.toolpath.climb import Climb, climb, leaning
from sacbus.toolpath.line import LINEAR_PERIOD
from sacbus.toolpath.share import TICKS_PER_SECOND, Part

drives = st.builds(
    Drive,
    sprf=st.sampled_from([200, 400]),
    ustep=st.sampled_from([0, 0, 1, 3, 4]),
    ihd=st.sampled_from([8, 8, 8, 4]),
)


def ideal(drive: Drive, rpm: float, acceleration: float, *, down: bool = False) -> Part:
    """A ramp from rest, or to rest, at so many rad/s2."""
    speed = rpm * drive.steps_per_rev / 60 / TICKS_PER_SECOND
    a = acceleration * drive.steps_per_rev / (2 * pi) / TICKS_PER_SECOND**2
    v0, v1 = (speed, 0.0) if down else (0.0, speed)
    return Part(0.0, speed / a, 0.0, speed**2 / a / 2, v0, v1)


def off(drive: Drive, part: Part, found: Climb, *, down: bool) -> float:
    """The worst error in full steps, by the pulses of the planned command."""
    command = Motion(
        found.steps,
        True,
        found.rpm,
        60_000_000 // (drive.steps_per_rev * found.rpm),
        NO_RAMP if down else found.acc100,
        found.acc100 if down else NO_RAMP,
        linear=True,
    )
    profile = plan(command, drive, found.rpm if down else 0)
    assert (profile.n_dec if down else profile.n_acc) == found.steps
    ticks = profile.duration or 0
    start = part.end - found.after - ticks if down else found.after
    begin = part.way - found.steps if down else 0.0
    pulses = profile.pulses or 0
    looked_at = {*range(min(40, pulses)), *range(0, pulses, pulses // 200 + 1), pulses - 1}
    errors: list[float] = [
        part.at(start + profile.time_of(at)) - begin - (at + 0.5) / drive.m for at in looked_at
    ]
    return max(map(abs, errors))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(drives, st.floats(25, 300), st.floats(10, 100), st.booleans())
def test_every_pulse_comes_as_near_as_is_told(
    drive: Drive, rpm: float, acceleration: float, down: bool
) -> None:
    part = ideal(drive, rpm, acceleration, down=down)
    assume(max(part.v0, part.v1) * drive.m <= 1 / LINEAR_PERIOD)
    found = climb(drive, part, 10**6, 99_900, down=down)
    if found is None:
        assert part.way < 1.2
        return
    assert found.rpm in (int(rpm), round(rpm))
    assert off(drive, part, found, down=down) <= 1.1 * found.worst + 0.08
    # Hundredths of a rad/s2 are coarse where the acceleration is low and the ramp is long; and what
    # a tuned node adds to every period is not made up for by another acceleration alone.
    tuned = drive.offset * part.way * max(part.v0, part.v1) * drive.m
    assert found.worst < 0.5 + 0.05 * tuned + 0.005 / acceleration * part.way / 4


def test_a_ramp_of_full_steps_is_off_by_less_than_half_of_one() -> None:
    part = ideal(Drive(), 300, 50)
    found = climb(Drive(), part, 10**6, 99_900)
    assert found is not None
    assert found.acc100 == pytest.approx(5_000, rel=0.01)
    assert found.worst < 0.45
    # The shortened first period makes it early; a start wait makes up for that.
    first_period = 0.676 * (2 * (2 * pi / 200) / 50) ** 0.5 * TICKS_PER_SECOND
    assert 0.5 < found.after / first_period < 0.7


def test_with_microsteps_it_is_off_by_less_than_a_tenth() -> None:
    found = climb(Drive(ustep=4), ideal(Drive(), 300, 50), 10**6, 99_900)
    assert found is not None
    assert found.worst < 0.1


def test_up_to_slow_and_within_a_step_the_device_takes_no_ramp() -> None:
    assert climb(Drive(), ideal(Drive(), 10.9, 1), 10**6, 99_900) is None
    assert climb(Drive(), ideal(Drive(), 16, 50), 10**6, 99_900) is None


def test_neither_more_steps_nor_more_acceleration_than_allowed() -> None:
    part = ideal(Drive(), 300, 50)
    for most, top in ((314, 99_900), (10**6, 5_000), (320, 4_990)):
        found = climb(Drive(), part, most, top)
        assert found is not None
        assert found.steps <= most
        assert found.acc100 <= top
    assert climb(Drive(), part, 100, 99_900) is None


def test_above_100_an_acceleration_is_a_whole_number() -> None:
    found = climb(Drive(), ideal(Drive(), 300, 150.4), 10**6, 99_900)
    assert found is not None
    assert found.acc100 % 100 == 0


def test_what_is_cut_off_of_periods_is_made_up_for() -> None:
    # Half a tick of every period; more of it where they are short.
    assert leaning(Drive(), 10**9, 100, down=False) == pytest.approx(-0.00725)
    assert leaning(Drive(xclk=20), 10**9, 100, down=False) > 0.2
    assert leaning(Drive(), 100, 10**9, down=False) > 0 > leaning(Drive(), 100, 10**9, down=True)
