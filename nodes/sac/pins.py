"""The output pins of a SAC: their levels, worked out when somebody asks.

Owns what each pin says. Source: manual, "cw", "dir", "ops", "ustep"; spec, "Pins".
"""

from __future__ import annotations

from typing import NamedTuple

from nodes.sac.engine import Engine
from nodes.sac.memory import Memory
from sacbus.kernel import Ns

__all__ = ["Outputs", "outputs"]


class Outputs(NamedTuple):
    """Levels, 0 or 1. op_sa is 1 while a command runs, op_sb is its inverse."""

    dir: int
    ms1: int
    ms2: int
    ms3: int
    op_sa: int
    op_sb: int


def outputs(memory: Memory, engine: Engine, microstep_pins: int, now: Ns) -> Outputs:
    """The levels at ``now``. ``microstep_pins``: MS3 MS2 MS1 as bits 2 to 0.

    The direction is that of the last command to start, clockwise before the first (decision). A
    command runs from its first pulse to the end of its last period.
    """
    runs = int(engine.profile is not None and engine.begun(now))
    tells = bool(memory.ops)
    return Outputs(
        dir=memory.cw if engine.clockwise else 1 - memory.cw,
        ms1=microstep_pins & 1,
        ms2=microstep_pins >> 1 & 1,
        ms3=microstep_pins >> 2,
        op_sa=runs if tells else 0,
        op_sb=1 - runs if tells else 0,
    )
