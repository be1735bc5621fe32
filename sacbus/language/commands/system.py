"""The system commands, behind a dollar: session settings, persistent parameters, reboot.

Owns the types and how each prints back. Case counts, and entering one ends all motion: that is the
node's business. Source: manual, "System Commands", Appendix C; spec, "System commands".
"""

from __future__ import annotations

from dataclasses import dataclass

from .parameters import Parameter
from .quantities import hundredths_text

__all__ = [
    "Configure",
    "MapPins",
    "Ramp",
    "Reboot",
    "SendAcks",
    "SendCrcs",
    "SendSoftOps",
    "SetParameter",
    "ShowMemory",
    "StepMode",
    "SystemCommand",
    "ToggleEncoder",
    "ToggleStepMode",
]


@dataclass(frozen=True, slots=True)
class Configure:
    """``$C``: enter the configure screen, on the terminal only."""

    def text(self) -> str:
        """``$C``."""
        return "$C"


@dataclass(frozen=True, slots=True)
class SetParameter:
    """``$C<letter><value>``: write a persistent parameter to EEPROM.

    value: 0 to the parameter's largest, never 0 where its ``zero`` is not None; hundredths where
    it is ``decimal``.
    """

    parameter: Parameter
    value: int

    def text(self) -> str:
        """``$CA8``, ``$Cd1.25``."""
        return "$C" + self.entry()

    def entry(self) -> str:
        """As it is typed on the configure screen: ``A8``."""
        value = hundredths_text(self.value) if self.parameter.decimal else str(self.value)
        return self.parameter.letter + value


@dataclass(frozen=True, slots=True)
class MapPins:
    """``$CUnx``: the levels of MS3 MS2 MS1 (bits 2 to 0) that give 2**n microsteps on driver 2.

    exponent (n) and pins (x): 0 to 7.
    """

    exponent: int
    pins: int

    def text(self) -> str:
        """``$CU21``: a quarter step is 001."""
        return "$C" + self.entry()

    def entry(self) -> str:
        """As it is typed on the configure screen: ``U21``."""
        return f"U{self.exponent}{self.pins}"


@dataclass(frozen=True, slots=True)
class ShowMemory:
    """``$E``: show the EEPROM, on the terminal only."""

    def text(self) -> str:
        """``$E``."""
        return "$E"


@dataclass(frozen=True, slots=True)
class StepMode:
    """``$F``: commands count full steps from now on; ``$P``: pulses."""

    full_step: bool

    def text(self) -> str:
        """``$F`` or ``$P``."""
        return "$F" if self.full_step else "$P"


@dataclass(frozen=True, slots=True)
class ToggleStepMode:
    """``$U``: from full steps to pulses, or back."""

    def text(self) -> str:
        """``$U``."""
        return "$U"


@dataclass(frozen=True, slots=True)
class SendCrcs:
    """``$H``: packets are sent with a CRC, or without one (``$H0``)."""

    on: bool

    def text(self) -> str:
        """``$H`` or ``$H0``."""
        return "$H" if self.on else "$H0"


@dataclass(frozen=True, slots=True)
class SendAcks:
    """``$K``: packets are answered with ACK or NAK, or not (``$K0``)."""

    on: bool

    def text(self) -> str:
        """``$K`` or ``$K0``."""
        return "$K" if self.on else "$K0"


@dataclass(frozen=True, slots=True)
class Ramp:
    """``$L1`` linear or ``$L0`` harmonic, with the ramp's default acceleration and deceleration."""

    linear: bool

    def text(self) -> str:
        """``$L1`` or ``$L0``."""
        return "$L1" if self.linear else "$L0"


@dataclass(frozen=True, slots=True)
class ToggleEncoder:
    """``$n``: the encoder from throttle to follow, or back."""

    def text(self) -> str:
        """``$n``, lower case only."""
        return "$n"


@dataclass(frozen=True, slots=True)
class SendSoftOps:
    """``$O1``: tell the network of every command's start and end; ``$O0``: no longer."""

    on: bool

    def text(self) -> str:
        """``$O1`` or ``$O0``."""
        return "$O1" if self.on else "$O0"


@dataclass(frozen=True, slots=True)
class Reboot:
    """``$R``: a warm reboot; the queue is left alone."""

    def text(self) -> str:
        """``$R``."""
        return "$R"


SystemCommand = (
    Configure
    | SetParameter
    | MapPins
    | ShowMemory
    | StepMode
    | ToggleStepMode
    | SendCrcs
    | SendAcks
    | Ramp
    | ToggleEncoder
    | SendSoftOps
    | Reboot
)
