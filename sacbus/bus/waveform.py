"""What a UART makes of bytes that are sent at another rate than its own.

Owns the bits of a byte on the wire (start, eight data bits lowest first, a ninth where there is
one, stop) and their sampling, once a bit and in its middle, as UARTs that do not vote.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from sacbus.kernel import SECOND, LineRate, Ns

__all__ = ["resampled"]


def resampled(
    values: Sequence[int],
    ninth: Sequence[int] | None,
    begins: Sequence[Ns],
    of: LineRate,
    at: LineRate,
) -> list[tuple[Ns, int, int, int]]:
    """Bytes sent at the rate ``of`` as read at ``at``: when each begins (ns), and its bits.

    The last is 1 where the stop bit is low: such a byte is taken as it is; the receiver then waits
    for the line to rise before it looks for the next start bit. The line rests high between them.
    """
    edges, levels = _edges(values, ninth, begins, of)
    places = range(1, of.bits)
    found: list[tuple[Ns, int, int, int]] = []
    after = begins[0] if begins else 0
    index = 0
    while True:
        # The next falling edge.
        while index < len(edges) and (edges[index] < after or levels[index]):
            index += 1
        if index == len(edges):
            return found
        start = edges[index]
        bits = [
            _level(edges, levels, start + (2 * place + 1) * SECOND // (2 * at.baud))
            for place in places
        ]
        value = sum(bit << place for place, bit in enumerate(bits[:8]))
        after = start + (2 * of.bits - 1) * SECOND // (2 * at.baud)
        lacks_stop = 1 - _level(edges, levels, after)
        found.append((start, value, bits[8] if of.nine else 0, lacks_stop))
        index += 1


def _edges(
    values: Sequence[int], ninth: Sequence[int] | None, begins: Sequence[Ns], rate: LineRate
) -> tuple[list[Ns], list[int]]:
    """When the line changes, and to which level."""
    edges: list[Ns] = []
    levels: list[int] = []
    level = 1
    for index, value in enumerate(values):
        bits = [0, *(value >> place & 1 for place in range(8))]
        if rate.nine:
            bits.append(ninth[index] if ninth is not None else 1)
        for place, bit in enumerate((*bits, 1)):
            if bit != level:
                edges.append(begins[index] + place * SECOND // rate.baud)
                levels.append(bit)
                level = bit
    return edges, levels


def _level(edges: Sequence[Ns], levels: Sequence[int], when: Ns) -> int:
    """The level at an instant; high before the first edge."""
    place = bisect_right(edges, when)
    return levels[place - 1] if place else 1
