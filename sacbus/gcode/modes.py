"""What holds from line to line until another word of its group: the modes of a program.

Owns the modes, what they are at the beginning, and which word sets which.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Modal Groups". Decisions: docs, "The words
of G-code": millimetres at the beginning, and no motion until G0 to G3.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final, NamedTuple

from sacbus.gcode.vocabulary import Group

__all__ = ["MM_PER_INCH", "Modes", "Motion", "Plane"]

MM_PER_INCH: Final = 25.4


class Motion(Enum):
    """What a line with axis words does; the value is the word that says so."""

    RAPID = "G0"
    FEED = "G1"
    CLOCKWISE = "G2"
    COUNTERCLOCKWISE = "G3"


class Plane(NamedTuple):
    """Where arcs lie: the letters of its axes and of the centre's offsets along them.

    Seen from where the third axis points to, the first axis turns into the second counterclockwise.
    """

    first: str
    second: str
    along_first: str
    along_second: str


_MOTIONS: Final[Mapping[str, Motion | None]] = {
    **{motion.value: motion for motion in Motion},
    "G80": None,
}
_PLANES: Final[Mapping[str, Plane]] = {
    "G17": Plane("X", "Y", "I", "J"),
    "G18": Plane("Z", "X", "K", "I"),
    "G19": Plane("Y", "Z", "J", "K"),
}


class Modes:
    """The modes in force.

    motion: None before the first of its group and after G80. absolute: of ends, G90 or G91;
    centre_absolute: of arcs' centres, G90.1 or G91.1. mm: how many a unit of length has.
    """

    __slots__ = ("absolute", "centre_absolute", "mm", "motion", "plane")

    def __init__(self) -> None:
        self.motion: Motion | None = None
        self.plane = _PLANES["G17"]
        self.absolute = True
        self.centre_absolute = False
        self.mm = 1.0

    def take(self, codes: Mapping[Group, str]) -> None:
        """Set what the words of a line say; they hold for all of that line."""
        if (name := codes.get(Group.MOTION)) is not None:
            self.motion = _MOTIONS[name]
        if (name := codes.get(Group.PLANE)) is not None:
            self.plane = _PLANES[name]
        if (name := codes.get(Group.DISTANCE)) is not None:
            self.absolute = name == "G90"
        if (name := codes.get(Group.ARC_DISTANCE)) is not None:
            self.centre_absolute = name == "G90.1"
        if (name := codes.get(Group.UNITS)) is not None:
            self.mm = MM_PER_INCH if name == "G20" else 1.0
