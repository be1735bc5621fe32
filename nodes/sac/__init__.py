"""The SAC: single-axis stepper controller, as a virtual node."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from nodes.sac.movement import SacSegment, SacShape
from nodes.sac.node import SacNode
from nodes.sac.protocol import SAC_PROTOCOL, SacProtocol
from nodes.sac.settings import SacSettings
from nodes.sac.words import memory_words
from sacbus.kernel import LineRate, Ns
from sacbus.node import MemoryWords, Report

__all__ = ["KIND", "SacKind", "SacNode", "SacProtocol", "SacSegment", "SacSettings"]


class SacKind:
    """The entry point ``sac`` of the group ``sacbus.nodes``."""

    name = "sac"
    summary = "SAC single-axis stepper controller"
    protocol = SAC_PROTOCOL
    settings = SacSettings
    #: Those of the motion engine (manual, "Profile Planning"), and what keeps it from running.
    states: Final[Sequence[str]] = (
        *("STANDBY", "ACCEL", "CRUISE", "DECEL", "STOP"),
        *("SYNC", "BOOT", "OFF"),
    )
    #: Sync is released by a low level.
    drawn: Final[Mapping[str, int]] = {"sync": 1}

    def create(
        self,
        address: int,
        settings: SacSettings,
        rate: LineRate,
        tell: Callable[[Report], None],
        memory: Mapping[str, object] | None = None,
    ) -> SacNode:
        """A node at ``address``, with factory memory if there is none that was stored."""
        return SacNode(address, settings, rate, tell, memory)

    def shape(self, stored: Mapping[str, Any]) -> SacShape:
        """Profile and board of segments of motion."""
        return SacShape(stored)

    def segment(self, since: Ns, shape: SacShape, values: Mapping[str, Any]) -> SacSegment:
        """What a SAC told of its motion at ``since``."""
        return SacSegment(since, shape, values)

    def memory_words(self, memory: Mapping[str, object], address: int | None) -> MemoryWords:
        """Parameters, pin map and saved queue in words."""
        return memory_words(memory, address)


KIND: Final = SacKind()
