"""The SS-MST67, a stepper controller of the Super Stepper Bus, as a virtual node."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from nodes.superstepper.course import ACCEL, CRUISE, DECEL
from nodes.superstepper.movement import Shape, SuperStepperSegment
from nodes.superstepper.node import SuperStepperNode
from nodes.superstepper.protocol import EIGHT_BITS, NINE_BITS, SuperStepperProtocol
from nodes.superstepper.settings import SuperStepperSettings
from nodes.superstepper.words import memory_words
from sacbus.kernel import LineRate, Ns
from sacbus.node import OFF, STANDBY, MemoryWords, Report

__all__ = [
    "KIND",
    "SuperStepperKind",
    "SuperStepperNode",
    "SuperStepperProtocol",
    "SuperStepperSegment",
    "SuperStepperSettings",
]


class SuperStepperKind:
    """The entry point ``ss-mst67`` of the group ``sacbus.nodes``."""

    name = "ss-mst67"
    summary = "SS-MST67 microstepping controller on a Super Stepper Bus"
    protocol = EIGHT_BITS
    protocols = (EIGHT_BITS, NINE_BITS)
    settings = SuperStepperSettings
    #: Those of the engine, and without power.
    states: Final[Sequence[str]] = (STANDBY, ACCEL, CRUISE, DECEL, OFF)
    #: The home sensor is asserted low.
    drawn: Final[Mapping[str, int]] = {"home": 1}

    def speaks(self, settings: SuperStepperSettings) -> SuperStepperProtocol:
        """JMP2 decides."""
        return NINE_BITS if settings.nine else EIGHT_BITS

    def create(
        self,
        address: int,
        settings: SuperStepperSettings,
        rate: LineRate,
        tell: Callable[[Report], None],
        memory: Mapping[str, object] | None = None,
    ) -> SuperStepperNode:
        """A node at ``address``, with factory memory if there is none that was stored."""
        return SuperStepperNode(address, settings, rate, tell, memory)

    def shape(self, stored: Mapping[str, Any]) -> Shape:
        """Course and board of segments of motion."""
        return Shape(stored)

    def segment(self, since: Ns, shape: Shape, values: Mapping[str, Any]) -> SuperStepperSegment:
        """What a module told of its motion at ``since``."""
        return SuperStepperSegment(since, shape, values)

    def memory_words(self, memory: Mapping[str, object], address: int | None) -> MemoryWords:
        """The EEPROM in words."""
        return memory_words(memory, address)


KIND: Final = SuperStepperKind()
