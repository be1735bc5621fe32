"""The persistent parameters: their letters, factory values, and what becomes of wrong ones.

Owns one table, ``Parameter``. Names are those of the configure screen; what a parameter does is the
node's business.
Source: manual, "Configure", "Miscellaneous"; spec, "System commands".
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from .quantities import NO_RAMP

__all__ = ["Beyond", "Parameter"]

_BYTE: Final = 2**8 - 1
_WORD: Final = 2**16 - 1
_LONG: Final = 2**32 - 1
_MAX_BAUD: Final = 2_000_000
"""Manual, "hw": settings up to 2 Mbps."""


class Beyond(Enum):
    """What becomes of a value over the largest one."""

    ONE = "flags: whatever is not 0 is 1"
    LOW_BITS = "8 bits: the low ones are kept"
    LARGEST = "the largest one is taken instead"
    IGNORED = "it is ignored"


class Parameter(Enum):
    """A parameter of the EEPROM.

    letter: as in ``$Cx``; case counts. title: on the configure screen. Values are whole numbers
    from 0 to ``largest``; hundredths where ``decimal``. zero: what a 0 becomes where nothing can be
    divided by it, or a ramp would never begin; None where 0 is a value like any other.
    """

    AUTORUN = "A", "autorun", 0, 30, Beyond.LARGEST
    RAMP = "B", "ramp", 0, 1, Beyond.ONE
    CLOCK = "C", "clock", 1, 1, Beyond.ONE
    NETWORK = "E", "network", 0, 1, Beyond.ONE
    CW = "F", "cw", 0, 1, Beyond.ONE
    DIR = "G", "dir", 0, 1, Beyond.ONE
    IHD = "H", "ihd", 8, _BYTE, Beyond.LOW_BITS
    XCLK = "I", "xclk", 0, _BYTE, Beyond.LOW_BITS
    USTEP = "J", "ustep", 0, 7, Beyond.IGNORED
    PULSE = "K", "pulse", 1, _BYTE, Beyond.LOW_BITS
    SLOW = "L", "slow", 10, _BYTE, Beyond.LOW_BITS, 1
    D_ID = "M", "d_id", 85, _BYTE, Beyond.LOW_BITS
    R_ID = "N", "r_id", 0, 2, Beyond.IGNORED
    SPRF = "a", "sprf", 200, _WORD, Beyond.IGNORED, 200
    CYCLE = "b", "cycle", 3000, _LONG, Beyond.IGNORED, 3000
    XFREQ = "c", "xfreq", 1_000_000, _LONG, Beyond.IGNORED, 1_000_000
    ACC = "d", "acc", 100, NO_RAMP, Beyond.LARGEST, NO_RAMP
    DEC = "e", "dec", 100, NO_RAMP, Beyond.LARGEST, NO_RAMP
    L_ACC = "f", "l_acc", 1047, NO_RAMP, Beyond.LARGEST, NO_RAMP
    L_DEC = "g", "l_dec", 1047, NO_RAMP, Beyond.LARGEST, NO_RAMP
    OPS = "h", "ops", 36, _BYTE, Beyond.LOW_BITS
    SOFT_OPS = "i", "soft_ops", 0, 1, Beyond.ONE
    ACK = "j", "ACK", 1, 1, Beyond.ONE
    CRC = "k", "CRC", 1, 1, Beyond.ONE
    HW = "m", "hw", 38_400, _MAX_BAUD, Beyond.IGNORED, 38_400
    SW = "n", "sw", 38_400, _LONG, Beyond.IGNORED, 38_400
    #: Hidden: not on the screen. 1: full-step mode is overridden, as after $P.
    OVERRIDE = "u", "override", 0, 1, Beyond.ONE

    def __init__(
        self,
        letter: str,
        title: str,
        factory: int,
        largest: int,
        beyond: Beyond,
        zero: int | None = None,
    ) -> None:
        self.letter: Final = letter
        self.title: Final = title
        self.factory: Final = factory
        self.largest: Final = largest
        self.beyond: Final = beyond
        self.zero: Final = zero

    @property
    def decimal(self) -> bool:
        """Whether it is an acceleration, counted in hundredths."""
        return self.largest == NO_RAMP
