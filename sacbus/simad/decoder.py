"""Edges of N + 1 lines to steps: what the drivers at their ends make of them.

Owns the drivers' rule: a step where a step line falls from high to low, the way that DIR is at that
instant. Takes any edges, whoever made them, and in whatever pieces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.simad.edges import DIR, HIGH, LOW, UNKNOWN, Edges
from sacbus.simad.fault import SimadError
from sacbus.simad.steps import Steps, joined

if TYPE_CHECKING:
    from sacbus.simad.edges import Bytes, Times

__all__ = ["Decoder", "decode"]

#: Edges that are worked on at a time: what fits into a processor's cache, and is worth the calls.
PIECE: Final = 1 << 16


def decode(edges: Edges) -> Steps:
    """The steps that these edges make, as :class:`Decoder`; the step lines are high before them."""
    return Decoder(edges.direction).take(edges)


class Decoder:
    """Decodes edges as they come, all of an instant together.

    Of a DIR that changes at the very instant of a fall, which breaks its set-up time, the level is
    the one before it. SimadError for a step while DIR's level is unknown.
    """

    def __init__(self, direction: int = HIGH, steps: int = HIGH) -> None:
        """``direction``: DIR's level before the first edge; ``steps``: that of the step lines."""
        self._direction = direction
        #: The last level of each line, DIR's excepted.
        self._levels = np.full(256, steps, dtype=np.uint8)

    def take(self, edges: Edges) -> Steps:
        """The steps of more edges, no earlier than those before."""
        parts = []
        begin = 0
        while begin < edges.count:
            end = begin + PIECE
            if end < edges.count:
                # All of an instant together.
                end = int(np.searchsorted(edges.times, edges.times[end - 1], side="right"))
            piece = slice(begin, end)
            parts.append(self._steps(edges.times[piece], edges.lines[piece], edges.levels[piece]))
            begin = end
        return joined(parts)

    def _steps(self, times: Times, lines: Bytes, levels: Bytes) -> Steps:
        by_line = np.argsort(lines, kind="stable")
        falls = np.sort(by_line[self._falls(lines[by_line], levels[by_line])])
        when = times[falls]
        directions = self._directions(times, lines, levels, when)
        unknown = np.flatnonzero(directions == UNKNOWN)
        if unknown.size:
            place = int(unknown[0])
            raise SimadError(
                f"line {lines[falls[place]]} falls at {when[place]} ns, and the level of DIR is "
                "not known then"
            )
        axes = lines[falls] - np.uint8(1)
        signs = np.where(directions == HIGH, 1, -1).astype(np.int8)
        # At one instant by axis, as merge() has them; mostly they are.
        if not ((when[1:] == when[:-1]) & (axes[1:] < axes[:-1])).any():
            return Steps(when, axes, signs)
        order = np.lexsort((axes, when))
        return Steps(when[order], axes[order], signs[order])

    def _falls(self, lines: Bytes, levels: Bytes) -> Bytes:
        """Whether each edge, in the order of the lines, is a step's; the last levels are kept."""
        first = np.append(True, lines[1:] != lines[:-1])[: lines.size]
        before = np.empty_like(levels)
        before[1:] = levels[:-1]
        before[first] = self._levels[lines[first]]
        last = np.append(lines[1:] != lines[:-1], True)[: lines.size]
        self._levels[lines[last]] = levels[last]
        fall: Bytes = (before == HIGH) & (levels == LOW) & (lines != DIR)
        return fall

    def _directions(self, times: Times, lines: Bytes, levels: Bytes, when: Times) -> Bytes:
        """The level of DIR just before each of these instants."""
        turned = lines == DIR
        turns = times[turned]
        level = np.concatenate(([self._direction], levels[turned])).astype(np.uint8)
        self._direction = int(level[-1])
        found: Bytes = level[np.searchsorted(turns, when, side="left")]
        return found
