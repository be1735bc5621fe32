"""The pins of an SS-MST67: the home sensor, and what the driver chip is given.

Owns which pins there are, and the telling of edges. Nothing here happens per step: the level of
clk, the step output, is computed for the instant asked about, and its edges are told to nobody.

Decisions: dir is 1 for clockwise and keeps the direction of the last step; ms0, ms1, dm0 and dm1
are the bits of the MSDeg/Decay byte; enable is 1 while the driver's current flows. An active edge
of clk is drawn rising, though the driver acts on a fall.
Source: manual, "Hardware" (J5, J8), Tables 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from nodes.superstepper.command import CommandProcessor
from sacbus.kernel import Ns
from sacbus.node import PinError
from sacbus.wire.superstepper import Microsteps

__all__ = ["SuperStepperPins", "levels_of"]

INPUTS: Final = ("home",)
OUTPUTS: Final = ("clk", "dir", "enable", "ms0", "ms1", "dm0", "dm1")
TOLD: Final = OUTPUTS[1:]


class Wired(Protocol):
    """The node that the pins belong to."""

    @property
    def commands(self) -> CommandProcessor: ...

    @property
    def powered(self) -> bool:
        """Whether it is switched on; else its outputs are low."""
        ...

    #: When something was last done to it.
    now: Ns

    def look(self, now: Ns) -> None:
        """Something has been done at ``now``: let those see it who tell of it."""
        ...


def levels_of(microsteps: Microsteps, *, clockwise: bool, enabled: bool) -> dict[str, int]:
    """The outputs that are told of."""
    exponent, decay = microsteps.exponent, int(microsteps.decay)
    return {
        "dir": int(clockwise),
        "enable": int(enabled),
        "ms0": exponent & 1,
        "ms1": exponent >> 1,
        "dm0": decay & 1,
        "dm1": decay >> 1,
    }


class SuperStepperPins:
    """The pins of one node, in the shape of ``sacbus.node.Pins``."""

    __slots__ = ("_node", "_seen", "_watcher")

    inputs = INPUTS
    outputs = OUTPUTS
    told = TOLD

    def __init__(self, node: Wired) -> None:
        self._node = node
        self._watcher: Callable[[str, int, Ns], object] | None = None
        #: The outputs' levels that the watcher knows of.
        self._seen: dict[str, int] = {}

    def check(self, pin: str, level: int) -> None:
        """PinError for a pin that is no input, and for a level that it cannot have."""
        if pin not in INPUTS:
            raise PinError(f"pin {pin!r}: expected one of the inputs {', '.join(INPUTS)}")
        if type(level) is not int or level not in (0, 1):
            raise PinError(f"pin {pin!r}: expected 0 or 1, got {level!r}")

    def drive(self, pin: str, level: int, now: Ns) -> None:
        """Drive the home sensor's input; PinError as above."""
        self.check(pin, level)
        node = self._node
        node.now = now
        commands = node.commands
        falls, commands.home = level < commands.home, level
        if falls and node.powered:
            commands.home_falls(now)
        node.look(now)

    def level(self, pin: str, now: Ns) -> int:
        """The level of a pin at ``now``, of either kind; PinError if there is none."""
        if pin == "home":
            return self._node.commands.home
        if pin not in OUTPUTS:
            raise PinError(f"pin {pin!r}: expected one of {', '.join((*INPUTS, *OUTPUTS))}")
        if not self._node.powered:
            return 0
        if pin == "clk":
            return self._node.commands.engine.clk(now)
        return self._levels(now)[pin]

    def watch(self, watcher: Callable[[str, int, Ns], object] | None, now: Ns) -> None:
        """Have ``watcher`` told of the edges of outputs from ``now`` on; None: nobody."""
        self._watcher = watcher
        self._seen = self._levels(now)

    def look(self, now: Ns) -> None:
        """Tell of the edges since the last look; the node does so after everything it does."""
        if self._watcher is None:
            return
        levels = self._levels(now)
        before, self._seen = self._seen, levels
        for pin, level in levels.items():
            if level != before[pin]:
                self._watcher(pin, level, now)
                if self._seen is not levels:
                    return  # the watcher has done something, and what came of that is told

    def _levels(self, now: Ns) -> dict[str, int]:
        if not self._node.powered:
            return dict.fromkeys(TOLD, 0)
        commands = self._node.commands
        return levels_of(
            commands.microsteps,
            clockwise=commands.engine.clockwise(now),
            enabled=commands.enabled,
        )
