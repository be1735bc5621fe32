"""A survey: what the blocks of a path come to, all told.

Owns the sums. Blocks are counted as they are planned and let go of, so a path may be of any length.
Source: spec, mother ("G-code": "lowers the feed to what the line carries and reports it").
"""

from __future__ import annotations

from sacbus.toolpath.block import Block, Deviation
from sacbus.toolpath.share import TICKS_PER_SECOND

__all__ = ["Survey"]


class Survey:
    """The sums of the blocks that were counted.

    blocks, commands: how many. length: mm. asked: s that the feeds asked for would take, dwells
    apart; planned: s that the blocks take, of their nodes' clocks, dwells apart; dwell: s of these.
    steps: of each axis by its place in the machine, signed. lowered: the largest part by which a
    feed was lowered, 0 to 1; reasons: in how many blocks it was, by what for. deviation: the worst.
    line: of the source, the last that was planned.
    """

    __slots__ = (
        "asked",
        "blocks",
        "commands",
        "deviation",
        "dwell",
        "length",
        "line",
        "lowered",
        "planned",
        "reasons",
        "steps",
    )

    def __init__(self) -> None:
        self.blocks = 0
        self.commands = 0
        self.length = 0.0
        self.asked = 0.0
        self.planned = 0.0
        self.dwell = 0.0
        self.steps: dict[int, int] = {}
        self.lowered = 0.0
        self.reasons: dict[str, int] = {}
        self.deviation = Deviation(0.0, 0.0)
        self.line = 0

    def add(self, block: Block) -> None:
        """Count a block."""
        self.blocks += 1
        self.length += block.length
        self.asked += block.asked
        self.planned += block.duration / TICKS_PER_SECOND
        self.dwell += block.dwell
        for run in block.runs:
            self.commands += len(run.motions)
            self.steps[run.axis] = self.steps.get(run.axis, 0) + run.steps
        if block.lowered_by:
            self.lowered = max(self.lowered, block.lowered)
            self.reasons[block.lowered_by] = self.reasons.get(block.lowered_by, 0) + 1
        if block.deviation.mm > self.deviation.mm:
            self.deviation = block.deviation
        self.line = block.lines[1]
