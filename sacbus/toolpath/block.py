"""A block: what every axis does between two instants of rest.

Owns the plan of a block as values: the commands of each axis, their exact times, and how far the
tool will be from the ideal path. How a block is worked out is in the files beside this one; getting
it into the nodes is mother's (``sacbus.mother``).

All axes of a block are released at one instant, by ``y`` or the sync line. Times are ticks (0.5 us
of a node's own oscillator) from that instant.
"""

from __future__ import annotations

from dataclasses import dataclass

from sacbus.language import Motion

__all__ = ["AxisRun", "Block", "Deviation"]


@dataclass(frozen=True, slots=True)
class AxisRun:
    """One axis in a block: the commands that its node runs one after the other.

    axis: its place in the machine. motions: at least one; the first has ``sync``. starts: when the
    first pulse of each is issued. loaded: when each is loaded at the latest: from then on, its
    place in the node's queue may be written over; 0 for the first, which is held. end: when the
    last period has run out. steps: what all of them add to the position, signed, in full steps.
    """

    axis: int
    motions: tuple[Motion, ...]
    starts: tuple[int, ...]
    loaded: tuple[int, ...]
    end: int
    steps: int


@dataclass(frozen=True, slots=True)
class Deviation:
    """How far the tool is from the ideal path at the worst instant of a block.

    mm; steps: the same in steps of the coarsest axis that moves. reason: why it is more than a
    step; nothing otherwise.
    """

    mm: float
    steps: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Block:
    """What happens between two instants of rest.

    runs: of the axes that move, in the machine's order. duration: ticks until the last of them
    ends. dwell: s of standing still that follow. halts: what is to be told then, and whether that
    waits for somebody. lines: first and last line of the source. length: mm of the path. asked:
    s it would take at the feeds asked for, accelerations aside; lowered: the largest part by which
    a feed was lowered, 0 to 1, and why.
    """

    runs: tuple[AxisRun, ...]
    duration: int
    deviation: Deviation
    length: float
    asked: float
    dwell: float = 0.0
    halts: tuple[tuple[str, bool], ...] = ()
    lines: tuple[int, int] = (0, 0)
    lowered: float = 0.0
    lowered_by: str = ""
