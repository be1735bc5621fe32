"""A machine: which node moves which axis, how far a step takes it, and what it can bear.

Owns these figures and their limits. Lengths are in mm, velocities of axes in RPM as SAC counts
them, feeds in mm/min.
Source: spec, mother ("G-code": settings), command line (``sacbus gcode``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from sacbus.motion import Drive

__all__ = ["MOST_STEPS", "Axis", "Machine"]

#: Full steps of an axis in one stretch: how far the tool is off its path is worked out pulse by
#: pulse, and 250 m at 400 steps a mm are more than any machine has.
MOST_STEPS: Final = 100_000_000


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis: ``X`` on node 10 with 400 full steps a mm.

    steps_per_mm: full steps, positive. inverted: a positive way is counterclockwise. max_rpm: what
    the motor is never asked to exceed. max_acceleration: rad/s2 that it is never asked to exceed;
    None: what the machine's says. jump_rpm: the change of velocity that it follows without a ramp;
    None: its slow speed, at which it starts from rest. drive: its node's settings.
    """

    name: str
    node: int
    steps_per_mm: float
    inverted: bool = False
    max_rpm: int = 300
    max_acceleration: float | None = None
    jump_rpm: int | None = None
    drive: Drive = field(default_factory=Drive)

    @property
    def jump(self) -> int:
        """The change of velocity that it follows without a ramp, in RPM."""
        return self.drive.slow if self.jump_rpm is None else self.jump_rpm


@dataclass(frozen=True, slots=True)
class Machine:
    """The axes in the order of a path's figures, and what is the same for all of them.

    rapid: mm/min of what has no feed of its own. feed: mm/min of G1 before the first F.
    acceleration: rad/s2 of the axis that takes most steps of a stretch (manual: the major axis's is
    the operator's choice; the others' follow from it). tolerance: mm by which chords may part from
    an arc.
    """

    axes: tuple[Axis, ...]
    rapid: float = 600.0
    feed: float = 300.0
    acceleration: float = 50.0
    tolerance: float = 0.01

    def too_far(self, begin: Sequence[float], to: Sequence[float]) -> tuple[str, float] | None:
        """The first axis that a straight way (mm) takes further than any goes, and its steps."""
        for axis, since, until in zip(self.axes, begin, to, strict=True):
            steps = abs(until - since) * axis.steps_per_mm
            if not steps <= MOST_STEPS:  # nan is no way
                return axis.name, steps
        return None

    def axis(self, name: str) -> int | None:
        """Which axis has this name; None if there is none."""
        for index, axis in enumerate(self.axes):
            if axis.name == name:
                return index
        return None
