"""Soft ops as mother hears them: a node tells everybody that a command begins, or has ended.

Owns what they say and which packets they are. Source: manual, "ops/soft_ops"; spec, wire.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from sacbus.kernel import Ns
from sacbus.wire import DC1, DC2, GENERAL_CALL, Packet

__all__ = ["SoftOpHeard", "soft_op"]

_BODIES: Final = {bytes((DC1,)): True, bytes((DC2,)): False}


@dataclass(frozen=True, slots=True)
class SoftOpHeard:
    """A command of a node's begins (DC1) or has ended (DC2).

    at: when mother had the whole packet, ns by her clock; always as long after the event itself.
    """

    node: int
    begins: bool
    at: Ns


def soft_op(packet: Packet, at: Ns) -> SoftOpHeard | None:
    """What a packet tells of a command; None when it is no soft op."""
    begins = _BODIES.get(packet.body)
    if begins is None or packet.dest != GENERAL_CALL:
        return None
    return SoftOpHeard(packet.src, begins, at)
