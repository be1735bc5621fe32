"""GAP: the test whether the next command goes on at the velocity the last one left.

Owns the load times and the test. Pure functions in ticks; whose command comes next, and when it
was heard, is the node's business.
Source: manual, "GAP" and the introduction (load times); spec, "GAP".
"""

from typing import Final

from sacbus.motion.drive import TICKS_PER_US

LOAD_US: Final = 16
"""A typical command load, steps and speed (manual, introduction)."""

LOAD_ACCELERATION_US: Final = 40
"""The longest load the manual names: changes in acceleration involve floating point."""


def load_ticks(acceleration_changes: bool) -> int:
    """Ticks from taking a command up to its first pulse.

    True when its acceleration, deceleration or kind of ramp is not that of the command before.
    """
    return (LOAD_ACCELERATION_US if acceleration_changes else LOAD_US) * TICKS_PER_US


def gap_passes(late: int, last_period: int) -> bool:
    """True when a command loaded `late` ticks after the last one's end keeps its velocity.

    The measure is one real period of the last pulse (`Profile.last_period`), exactly one included;
    with microsteps that is the period of a pulse, not of a step. A command that waited in the
    queue is loaded one load time after the end.
    """
    return late <= last_period
