"""Lines that move the motor, or set what a motion is given: M, V, A, D, + and -.

Owns the reading of these; their qualifiers are a table of their own (``qualifiers.py``).
Source: manual, "Motion", "Accel", "V", "Single pulse", Appendix C.
"""

from __future__ import annotations

import re
from typing import Final

from sacbus.language.commands import (
    Acceleration,
    Command,
    Deceleration,
    Move,
    ShowVelocity,
    SinglePulses,
    Velocity,
)
from sacbus.language.line import Line, end_of
from sacbus.language.qualifiers import BITS_32, Draft, qualified, read_velocity

__all__ = [
    "read_acceleration",
    "read_course",
    "read_deceleration",
    "read_move",
    "read_signs",
    "read_velocity_line",
]

_SIGNS: Final = re.compile(r"[+-]*")


def read_course(line: Line, at: int, ignored: str) -> tuple[bool, int | None, int]:
    """Whether a minus stands behind an M, the steps, and the index after them.

    Steps that do not fit are None, with a remark that ends in ``ignored``.
    """
    opposite = line.word[at : at + 1] == "-"
    line.stands("opposite", at if opposite else at - 1)  # without a sign the M itself says it
    at += opposite
    steps, after = line.number(at, "the number of steps", BITS_32, ignored)
    if steps is not None:
        line.stands("steps", at)
    return opposite, steps, after


def read_move(line: Line, at: int) -> Move | None:
    """M."""
    opposite, steps, after = read_course(
        line, at, "the command is refused: without steps it never ends"
    )
    if line.remarks:  # on the steps: nothing else has been read yet
        return None
    draft = qualified(line, after)
    return None if draft is None else draft.move(steps, opposite=opposite)


def read_velocity_line(line: Line, at: int) -> Command | None:
    """V, VC and VD."""
    if line.word[at:] in ("D", "d"):
        return ShowVelocity()
    draft = Draft()
    after = read_velocity(line, at, draft)
    if after is None or not line.ends(after):
        return None
    if draft.rpm is None and draft.cycle_us is None:  # too large, ignored: nothing is left
        return None
    return Velocity(draft.rpm, draft.cycle_us)


def read_acceleration(line: Line, at: int) -> Command | None:
    """A."""
    read = line.hundredths(at, "an acceleration")
    if read is None or not line.ends(read[1]):
        return None
    line.stands("acc100", at)
    return Acceleration(read[0])


def read_deceleration(line: Line, at: int) -> Command | None:
    """D."""
    read = line.hundredths(at, "a deceleration")
    if read is None or not line.ends(read[1]):
        return None
    line.stands("dec100", at)
    return Deceleration(read[0])


def read_signs(line: Line, _at: int) -> Command | None:
    """+ and -, any number of them."""
    after = end_of(_SIGNS, line.word, 0)
    if after < len(line.word):
        line.refuse(after, "+ and - alone, one pulse each")
        return None
    line.stands("signs", 0)
    return SinglePulses(line.word)
