"""What has become of a stream of blocks, so far or in the end.

Owns the figures: what was sent, how long it took, who waited for whom, and how far it came.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sacbus.kernel import SECOND, Ns
from sacbus.mother.errors import MotherError

__all__ = ["StreamBroken", "Streamed", "WrongNode"]


@dataclass(slots=True)
class Streamed:
    """How far a stream has come.

    blocks, commands: released; whether all of them are over, :attr:`over` says. packets: sent and
    acknowledged, broadcasts included. lines: first and last line of the source of the last block
    that was released. moving, dwelling, halted, barriers: ns in which blocks ran; in which all
    stood still since a dwell or a halt wanted it; between blocks, since all must be at rest before
    the next. late: how many of these last were longer since the line had not carried all of the
    next block yet, and by how many ns. deepest: most commands at a time that a node had before it.
    positions: full steps of each axis by its name, signed as its commands are, clockwise up, from
    where it began; those of the last block included, which is over only if :attr:`over` says so.
    """

    blocks: int = 0
    commands: int = 0
    packets: int = 0
    lines: tuple[int, int] = (0, 0)
    moving: Ns = 0
    dwelling: Ns = 0
    halted: Ns = 0
    barriers: Ns = 0
    late: int = 0
    late_by: Ns = 0
    deepest: int = 0
    over: bool = True
    positions: Mapping[str, int] = field(default_factory=dict)

    def where(self) -> str:
        """How far, in words."""
        if not self.blocks:
            return "nothing had moved"
        first, last = self.lines
        lines = (
            "" if not last else f"line {last}, " if first == last else f"lines {first} to {last}, "
        )
        at = ", ".join(f"{name} {steps}" for name, steps in self.positions.items())
        if not self.over:
            # How much of the block's time is gone, nobody knows.
            return f"in block {self.blocks}, {lines}on the way to {at} steps"
        blocks = "block" if self.blocks == 1 else "blocks"
        moving = self.moving / SECOND
        return f"{self.blocks} {blocks} done after {moving:.1f} s of motion, {lines}at {at} steps"


class WrongNode(MotherError):
    """``node`` answered what was sent to another: it may have obeyed it, so it may be elsewhere."""

    def __init__(self, node: int) -> None:
        self.node = node
        super().__init__(
            f"node {node} has answered what was not sent to it, and may have obeyed it: its "
            "position is not certain any more, find it anew"
        )


class StreamBroken(MotherError):
    """A stream came to an end before its time.

    ``cause``: what went wrong. ``streamed``: how far it had come; the machine has stood still since
    the end of the last block that was released, at a barrier. ``unsure``: nodes that have not
    acknowledged the S that they were sent then; the next y may start them.
    """

    def __init__(self, cause: Exception, streamed: Streamed, unsure: tuple[int, ...]) -> None:
        self.cause = cause
        self.streamed = streamed
        self.unsure = unsure
        told = f"{cause}; {streamed.where()}"
        if unsure:
            told += f"; {', '.join(map(str, unsure))} may still wait for a y, send S first"
        super().__init__(told)
