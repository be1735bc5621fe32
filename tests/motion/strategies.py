"""Nodes and commands for the properties of this room, short enough for the reference to walk."""

from __future__ import annotations

from hypothesis import strategies as st

from sacbus.language import Motion
from sacbus.motion import Drive
from tests.motion.reference import NONE, Setup

setups = st.builds(
    Setup,
    sprf=st.sampled_from([200, 200, 400, 48, 20, 1]),
    slow=st.sampled_from([10, 10, 1, 25, 60]),
    ustep=st.sampled_from([0, 0, 1, 3, 4, 7]),
    ihd=st.sampled_from([8, 8, 0, 20, 255]),
    xclk=st.sampled_from([0, 0, 30, 255]),
    auto=st.sampled_from([False, False, True]),
)

accelerations = st.sampled_from([100, 100, 50, 37, 1, 250, 1047, 5000, 9999, 90000, NONE])


@st.composite
def motions(
    draw: st.DrawFn, sprf: int = 200, *, continuous: bool = False, steps: int = 400
) -> Motion:
    """A command of some hundred steps, its velocity given in RPM or as a cycle."""
    if draw(st.booleans()):
        rpm = draw(st.integers(1, 700))
        cycle_us = 60_000_000 // (sprf * rpm) or 1
    else:
        cycle_us = draw(st.integers(200, 60_000))
        rpm = 60_000_000 // (sprf * cycle_us)
    return Motion(
        steps=None if continuous else draw(st.integers(1, steps)),
        cw=draw(st.booleans()),
        rpm=rpm,
        cycle_us=cycle_us,
        acc100=draw(accelerations),
        dec100=draw(accelerations),
        linear=draw(st.booleans()),
        # Most of them plain, because only those shift gears.
        extra_pulses=draw(st.sampled_from([0, 0, 0, 0, 0, 1, 7, 255])),
        pulses=draw(st.sampled_from([False, False, False, True])),
    )


def drive_of(setup: Setup) -> Drive:
    return Drive(
        sprf=setup.sprf,
        slow_rpm=setup.slow,
        ustep=setup.ustep,
        ihd=setup.ihd,
        xclk=setup.xclk,
        auto_micro=setup.auto,
    )
