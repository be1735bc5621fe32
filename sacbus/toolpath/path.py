"""What a tool is to do: straight stretches, dwells and halts, in millimetres.

Owns these values, and nothing about how they come about or who carries them out. Whoever writes
part programs, G-code or others, makes them; the planner takes them one at a time, so that a path
may be of any length.
Source: manual, "SAC and G-code" (all motion is in straight lines); spec, mother ("G-code").
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Dwell", "Halt", "PathItem", "Straight"]


@dataclass(frozen=True, slots=True)
class Straight:
    """A straight stretch from where the item before ended.

    to: mm, one figure for each axis of the machine, in its order, counted from where the machine
    stood at the beginning. feed: mm/min along the path; None: at the rapid rate. line: the line of
    the source that it comes from, from 1; 0: of none.
    """

    to: tuple[float, ...]
    feed: float | None = None
    line: int = 0


@dataclass(frozen=True, slots=True)
class Dwell:
    """All axes stand still for some time, in s."""

    seconds: float
    line: int = 0


@dataclass(frozen=True, slots=True)
class Halt:
    """The tool stands still, and somebody is told ``text``; with ``waits``, until told to go on."""

    text: str
    waits: bool = False
    line: int = 0


PathItem = Straight | Dwell | Halt
