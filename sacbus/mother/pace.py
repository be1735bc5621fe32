"""How many commands a line carries.

Owns the figures by which the feed of a program comes down: what one command takes on a line, with
its ACK and the pause after it. Source: spec, mother ("G-code"), wire.
"""

from __future__ import annotations

from collections.abc import Iterable
from statistics import median
from typing import Final

from sacbus.kernel import SECOND, LineRate, Ns
from sacbus.mother.mother import Mother
from sacbus.wire.times import ANSWER_BYTES, MOTHER_GAP, turnaround

__all__ = ["command_seconds", "measured_command_seconds", "round_trip"]

#: Bytes of a packet besides its body: STX, two addresses, ETX, CRC, and a NUL.
FRAME: Final = 6

#: Characters of an edit that names what changes from command to command (steps, a cycle, and now
#: and then a ramp), rather more than it mostly has: a line should carry what it is thought to.
EDIT: Final = 16

#: How often each node is asked when a link is measured.
ASKED: Final = 3


def round_trip(rate: LineRate, body: int) -> Ns:
    """From a packet's first bit to the end of its answer, by the line's own figures."""
    line = rate.span(FRAME + body) + rate.span(ANSWER_BYTES)
    return line + turnaround(body, nul_follows=True)


def command_seconds(rate: LineRate, late: Ns = 0) -> float:
    """What one command takes, in s; ``late``: by how much answers are later than they could be."""
    return (round_trip(rate, EDIT) + late + MOTHER_GAP) / SECOND


async def measured_command_seconds(mother: Mother, nodes: Iterable[int]) -> float:
    """What one command takes on a line whose link has a delay of its own, in s.

    Asks each node some times with the empty line, which does nothing. Raises as
    :meth:`~sacbus.mother.Mother.send` does.
    """
    nominal = round_trip(mother.rate, 0)
    late = [
        (await mother.send(node, "")).round_trip - nominal for _ in range(ASKED) for node in nodes
    ]
    return command_seconds(mother.rate, max(0, round(median(late))) if late else 0)
