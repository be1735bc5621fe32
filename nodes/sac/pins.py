"""The pins of a SAC: inputs that are driven, outputs whose levels are worked out when asked.

Owns which pins there are, what a change of an input sets going, and the telling of edges of the
outputs. Nothing here happens per pulse: the level of clk is computed for the instant asked about,
and its edges are told to nobody.

A node has this object once somebody asks for it. Until then all inputs are at rest: sync, e-stop,
RST and the encoder's two high, from their pull-ups, and at xclk the clock that was configured.

Decisions where the manual is silent: dir keeps the direction of the last command to start, or of
the last single pulse, and clockwise before the first; with ops at 0 both op pins are low.
Source: manual, "Terminal Connections", "Encoder", "Estop", "cw", "ops", "ustep"; spec, "Pins".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, Protocol

from nodes.sac.command import CommandProcessor
from nodes.sac.encoder import Encoder
from nodes.sac.engine import Engine
from nodes.sac.memory import Memory
from nodes.sac.network import NetworkPort
from nodes.sac.settings import FASTEST_XCLK
from sacbus.kernel import Ns
from sacbus.language import ReleaseSync
from sacbus.node import PinError

__all__ = ["SacPins", "Wired"]

INPUTS: Final = ("sync", "estop", "rst", "xclk", "enA", "enB")
OUTPUTS: Final = ("clk", "dir", "ms1", "ms2", "ms3", "op_sa", "op_sb", "tx_en", "1MHz")

#: Outputs whose edges are told. clk and 1MHz have too many, and tx_en is seen on the line.
TOLD: Final = ("dir", "ms1", "ms2", "ms3", "op_sa", "op_sb")


class Wired(Protocol):
    """The node that the pins belong to."""

    @property
    def commands(self) -> CommandProcessor:
        """Its command processor."""
        ...

    @property
    def network(self) -> NetworkPort:
        """Its network port."""
        ...

    @property
    def engine(self) -> Engine:
        """Its motion engine."""
        ...

    @property
    def obeyed(self) -> Memory:
        """The memory that it booted with."""
        ...

    @property
    def microstep_pins(self) -> int:
        """MS3 MS2 MS1 as bits 2 to 0."""
        ...

    @property
    def powered(self) -> bool:
        """Whether it is switched on; else its outputs are low."""
        ...

    @property
    def booted(self) -> bool:
        """Whether it runs: switched on, and its boot is over."""
        ...

    #: Whether the encoder turns the speed of continuous motion, or steps the motor.
    throttles: bool
    #: Frequency of the clock at xclk.
    xclk_hz: int
    #: When something was last done to it.
    now: Ns

    def feed_xclk(self, hz: int, now: Ns) -> None:
        """Have a clock of that frequency there."""
        ...

    def look(self, now: Ns) -> None:
        """Something has been done at ``now``: let those see it who tell of it."""
        ...

    def watch_ops(self) -> None:
        """See anew whether anybody is to be told of starts and ends of commands."""
        ...


class SacPins:
    """The pins of one node, in the shape of ``sacbus.node.Pins``."""

    __slots__ = ("_encoder", "_node", "_seen", "_watcher", "estop", "rst", "sync")

    inputs = INPUTS
    outputs = OUTPUTS
    told = TOLD

    def __init__(self, node: Wired) -> None:
        self._node = node
        self._encoder = Encoder()
        self._watcher: Callable[[str, int, Ns], object] | None = None
        #: The outputs' levels that the watcher knows of.
        self._seen: dict[str, int] = {}
        self.sync = 1
        self.estop = 1
        #: While it is low, a cold boot restores the factory's memory.
        self.rst = 1

    # ---- inputs ----

    def check(self, pin: str, level: int) -> None:
        """PinError for a pin that is no input, and for a level that it cannot have."""
        if pin not in INPUTS:
            raise PinError(f"pin {pin!r}: expected one of the inputs {', '.join(INPUTS)}")
        top = FASTEST_XCLK if pin == "xclk" else 1
        if type(level) is not int or not 0 <= level <= top:
            what = f"Hz from 0 to {top}" if pin == "xclk" else "0 or 1"
            raise PinError(f"pin {pin!r}: expected {what}, got {level!r}")

    def drive(self, pin: str, level: int, now: Ns) -> None:
        """Drive an input to 0 or 1, or xclk with a clock of so many Hz; PinError as above."""
        self.check(pin, level)
        node = self._node
        node.now = now
        match pin:
            case "sync":
                falls, self.sync = level < self.sync, level
                if falls:
                    node.commands.execute(ReleaseSync(), now)
            case "estop":
                changes, self.estop = level != self.estop, level
                if changes:
                    node.commands.bar(barred=not level, now=now)
            case "rst":
                self.rst = level
            case "xclk":
                node.feed_xclk(level, now)
            case _:
                self._turn(pin, level, now)
        node.look(now)

    def _turn(self, pin: str, level: int, now: Ns) -> None:
        """The encoder: throttle in continuous motion, or follow: one pulse a detent."""
        encoder, node = self._encoder, self._node
        a, b = (level, encoder.b) if pin == "enA" else (encoder.a, level)
        detent = encoder.drive(a, b)
        if not detent or not node.booted:
            return
        if node.throttles:
            node.commands.throttle(detent, now)
        else:
            node.commands.step(detent)

    # ---- outputs ----

    def level(self, pin: str, now: Ns) -> int:
        """The level of a pin at ``now``, of either kind; xclk: Hz. PinError if there is none."""
        levels = self._driven() if pin in INPUTS else self._levels(now)
        if pin in levels:
            return levels[pin]
        if pin in OUTPUTS and not self._node.powered:
            return 0
        match pin:
            case "clk":
                return self._node.engine.clk(now)
            case "tx_en":
                return self._node.network.sends(now)
            case "1MHz":
                # Half a microsecond high, half low: a tick of its own oscillator each.
                return self._node.engine.oscillator.ticks_in(now) & 1
            case _:
                raise PinError(
                    f"pin {pin!r}: expected one of the inputs {', '.join(INPUTS)} "
                    f"or the outputs {', '.join(OUTPUTS)}"
                )

    def watch(self, watcher: Callable[[str, int, Ns], object] | None, now: Ns) -> None:
        """Have ``watcher(pin, level, when)`` called at each edge of the outputs in ``told``.

        There is one watcher; None: nobody. It is told of edges from ``now`` on.
        """
        self._watcher = watcher
        self._seen = self._levels(now)
        self._node.now = now
        self._node.watch_ops()

    @property
    def watched(self) -> bool:
        """Whether edges are told to anybody."""
        return self._watcher is not None

    def look(self, now: Ns) -> None:
        """Tell of the edges since the last look; the node does so after everything it does."""
        if self._watcher is None:
            return
        levels = self._levels(now)
        if levels == self._seen:
            return
        before, self._seen = self._seen, levels
        for pin, level in levels.items():
            if level != before[pin]:
                self._watcher(pin, level, now)
                if self._seen is not levels:
                    return  # the watcher has done something, and what came of that is told

    def _driven(self) -> Mapping[str, int]:
        encoder = self._encoder
        levels = (self.sync, self.estop, self.rst, self._node.xclk_hz, encoder.a, encoder.b)
        return dict(zip(INPUTS, levels, strict=True))

    def _levels(self, now: Ns) -> dict[str, int]:
        """Of the outputs in ``told``; a command runs from its first pulse to its end."""
        node = self._node
        if not node.powered:
            return dict.fromkeys(TOLD, 0)
        memory, engine, microsteps = node.obeyed, node.engine, node.microstep_pins
        runs = int(engine.profile is not None and engine.begun(now))
        tells = bool(memory.ops)
        return {
            "dir": memory.cw if engine.clockwise else 1 - memory.cw,
            "ms1": microsteps & 1,
            "ms2": microsteps >> 1 & 1,
            "ms3": microsteps >> 2,
            "op_sa": runs if tells else 0,
            "op_sb": 1 - runs if tells else 0,
        }
