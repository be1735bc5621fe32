"""When a block that was released is over, by mother's clock.

Owns the margins for the nodes' own clocks, which nobody can read, and the count of how long all
stood still between blocks. Synchronous; times are ns by mother's clock.
Source: spec, mother ("G-code": node clocks drift and the depth of a queue cannot be asked).
"""

from __future__ import annotations

from math import ceil
from typing import Final

from sacbus.kernel import MS, Ns
from sacbus.mother.streamed import Streamed
from sacbus.mother.timeline import DRIFT_PPM
from sacbus.toolpath import Block

__all__ = ["MARGIN", "TICK", "Reckoning"]

#: What a block may be longer than its plan, besides.
MARGIN: Final[Ns] = 2 * MS

#: ns of a tick of a node's clock.
TICK: Final = 500

#: What has only just become due is no sign of a slow line: it is silent for 3 ms before a release.
_PROMPT: Final[Ns] = 4 * MS


class Reckoning:
    """``over``: when the block that was released last, and its pause, are over for certain.

    ``drift_ppm``: by how much a node's clock may differ from mother's. ``margin``: ns that a block
    may be longer than its plan, besides.
    """

    def __init__(self, drift_ppm: int = DRIFT_PPM, margin: Ns = MARGIN) -> None:
        self.over: Ns = 0
        #: When they would be if nobody were late.
        self._planned: Ns = 0
        self._drift_ppm = drift_ppm
        self._margin = margin

    def lasts(self, ticks: int) -> Ns:
        """How long after a release so many ticks of a node's are certain to be over."""
        time = ticks * TICK
        return time + ceil(time * self._drift_ppm / 1_000_000) + self._margin

    def released(self, now: Ns, block: Block) -> None:
        """A block was released, as far as is known before the line has had its next word."""
        self._planned = now + block.duration * TICK
        self.over = now + (self.lasts(block.duration) if block.runs else 0)

    def pause(self, duration: Ns) -> None:
        """All stand still for so long behind the block."""
        self.over += duration
        self._planned += duration

    def count_wait(self, now: Ns, streamed: Streamed) -> None:
        """Take note of how long all have stood still before the release that comes now."""
        if not streamed.blocks:
            return
        streamed.barriers += max(0, now - self._planned)
        waited = now - self.over
        if waited > _PROMPT:
            streamed.late += 1
            streamed.late_by += waited
