"""Appendix D: the steps that a linear ramp takes, up and down again.

Owns the table's extent, its rounding and its two forms of output.
Source: manual, Appendix D; spec, "Profile" (each entry is of both ramps, from an unrounded V).
"""

from __future__ import annotations

from math import pi
from typing import Any, Final

from sacbus.motion import Drive

__all__ = ["ACCELERATIONS", "VELOCITIES", "both_ramps", "table_as_json", "table_as_text"]

VELOCITIES: Final = tuple(range(50, 601, 50))
"""RPM, the columns."""

ACCELERATIONS: Final = tuple(range(1, 31))
"""rad/s², the rows."""


def both_ramps(rpm: int, acc: int, drive: Drive) -> int:
    """Pulses of going up to a velocity and coming down from it: V² / (α × acc), truncated.

    In full steps first, then times the microsteps, as the manual says. A plan's two ramps, each
    truncated by itself, may add up to one step less.
    """
    return int(pi * rpm**2 * drive.steps_per_rev / (1_800 * acc)) * drive.m


def table_as_text(drive: Drive) -> list[str]:
    """The table as the manual has it: velocities across, accelerations down."""
    rows = [[both_ramps(rpm, acc, drive) for rpm in VELOCITIES] for acc in ACCELERATIONS]
    width = max(8, len(str(rows[0][-1])) + 2)
    unit = "steps" if drive.m == 1 else f"pulses at {drive.m} microsteps"
    title = f"{unit} of a linear ramp up to a velocity and down again"
    return [
        f"{title}, {drive.steps_per_rev} steps per revolution",
        f"{'RPM':>9}" + "".join(f"{rpm:>{width}}" for rpm in VELOCITIES),
        f"{'rad/s':>9}" + "".join(f"{rpm * pi / 30:>{width}.3f}" for rpm in VELOCITIES),
        *(
            f"{'rad/s²' if acc == 1 else '':<6}{acc:>3}"
            + "".join(f"{entry:>{width}}" for entry in row)
            for acc, row in zip(ACCELERATIONS, rows, strict=True)
        ),
    ]


def table_as_json(drive: Drive) -> dict[str, Any]:  # Any: it is JSON
    """The table with its axes; ``steps[i][j]`` belongs to ``acc[i]`` and ``rpm[j]``."""
    return {
        "rpm": list(VELOCITIES),
        "acc": list(ACCELERATIONS),
        "steps": [[both_ramps(rpm, acc, drive) for rpm in VELOCITIES] for acc in ACCELERATIONS],
    }
