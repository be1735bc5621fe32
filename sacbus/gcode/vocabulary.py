"""The G and M words: which are read, which exclude one another, and why others are refused.

Owns the tables; docs/gcode-words.md is held against them by a test.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Modal Groups"; spec, mother ("G-code").
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum, auto
from typing import Final

__all__ = [
    "AXIS_LETTERS",
    "GROUPS",
    "REFUSED",
    "REFUSED_LETTERS",
    "REPORTED",
    "ROTARY_LETTERS",
    "VALUE_LETTERS",
    "Group",
    "name_of",
    "why_refused",
]


class Group(IntEnum):
    """Of the words of a group, a line has one at most."""

    # IntEnum: its members are looked up in dictionaries for every line, and Enum hashes in Python.

    ONCE = auto()
    """What holds for its line alone (RS274: non-modal, group 0)."""
    MOTION = auto()
    PLANE = auto()
    DISTANCE = auto()
    ARC_DISTANCE = auto()
    FEED_MODE = auto()
    UNITS = auto()
    CUTTER = auto()
    TOOL_LENGTH = auto()
    SYSTEM = auto()
    STOP = auto()
    TOOL = auto()
    SPINDLE = auto()
    COOLANT = auto()


AXIS_LETTERS: Final = frozenset("XYZABCUVW")
"""The letters that name axes, where a machine has them."""

ROTARY_LETTERS: Final = frozenset("ABC")
"""Axes that count in degrees: inches do not concern them."""

VALUE_LETTERS: Final = frozenset("FIJKNPRST")
"""The other letters that carry a figure."""

GROUPS: Final[Mapping[str, Group]] = {
    **dict.fromkeys(("G4", "G28", "G53", "G92", "G92.1"), Group.ONCE),
    **dict.fromkeys(("G0", "G1", "G2", "G3", "G80"), Group.MOTION),
    **dict.fromkeys(("G17", "G18", "G19"), Group.PLANE),
    **dict.fromkeys(("G90", "G91"), Group.DISTANCE),
    **dict.fromkeys(("G90.1", "G91.1"), Group.ARC_DISTANCE),
    "G94": Group.FEED_MODE,
    **dict.fromkeys(("G20", "G21"), Group.UNITS),
    "G40": Group.CUTTER,
    "G49": Group.TOOL_LENGTH,
    "G54": Group.SYSTEM,
    **dict.fromkeys(("M0", "M1", "M2", "M30"), Group.STOP),
    "M6": Group.TOOL,
    **dict.fromkeys(("M3", "M4", "M5"), Group.SPINDLE),
    **dict.fromkeys(("M7", "M8", "M9"), Group.COOLANT),
}
"""Every word that is read, by its group."""

REPORTED: Final = (Group.TOOL, Group.SPINDLE, Group.COOLANT)
"""Groups whose words are told before the motion of their line, in this order of execution."""

_OFFSETS = ("offsets of a coordinate system are not kept", "move the origin with G92")
_CYCLE = ("canned cycles are not read", "have the cycle written out as G0 and G1")
_CUTTER = ("cutter compensation is not read", "have the path written for the tool's radius")
_LENGTH = ("tool lengths are not kept", "move the origin with G92")
_PROBE = ("there is no probe", "take it out")
_THREAD = ("feed cannot follow a spindle", "use G94 and F in units a minute")
_SPLINE = ("splines are not read", "have the curve written as G1, G2 and G3")
_BLEND = ("corners are passed as fast as the axes' settings allow", "take it out")
_CALL = ("subprograms are not read", "have them written out")
_OVERRIDE = ("there is no override of feeds", "take it out")

REFUSED: Final[Mapping[str, tuple[str, str]]] = {
    **dict.fromkeys(("G5", "G5.1", "G5.2", "G5.3"), _SPLINE),
    **dict.fromkeys(("G7", "G8"), ("there is no lathe's diameter mode", "write radii")),
    **dict.fromkeys(
        ("G10", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"), _OFFSETS
    ),
    **dict.fromkeys(("G28.1", "G30", "G30.1"), ("no place but the origin is kept", "use G28")),
    **dict.fromkeys(("G33", "G33.1", "G93", "G95", "G96"), _THREAD),
    **dict.fromkeys(("G38.2", "G38.3", "G38.4", "G38.5"), _PROBE),
    **dict.fromkeys(("G41", "G41.1", "G42", "G42.1"), _CUTTER),
    **dict.fromkeys(("G43", "G43.1", "G43.2"), _LENGTH),
    **dict.fromkeys(("G61", "G61.1", "G64"), _BLEND),
    **dict.fromkeys(("G73", "G76", "G81", "G82", "G83", "G84", "G85", "G86", "G87"), _CYCLE),
    **dict.fromkeys(("G88", "G89", "G98", "G99"), _CYCLE),
    **dict.fromkeys(("G92.2", "G92.3"), ("offsets are not kept aside", "use G92.1 and G92")),
    **dict.fromkeys(("M48", "M49"), _OVERRIDE),
    "M60": ("there is no pallet", "use M0"),
    **dict.fromkeys(("M98", "M99"), _CALL),
}
"""Words that other machines obey: what is in the way, and what to do instead."""

REFUSED_LETTERS: Final[Mapping[str, tuple[str, str]]] = {
    "D": _CUTTER,
    "E": ("there is no extruder", "take it out"),
    "H": _LENGTH,
    "L": _CYCLE,
    "O": _CALL,
    "Q": _CYCLE,
}
"""Letters that are refused with any number."""


def name_of(letter: str, number: str) -> str:
    """How a G or M word is called whatever its zeros: ``G1`` for ``G01`` and ``G1.0``."""
    whole, _, fraction = number.removeprefix("+").partition(".")
    fraction = fraction.rstrip("0")
    return f"{letter}{whole.lstrip('0') or '0'}{'.' if fraction else ''}{fraction}"


def why_refused(name: str) -> tuple[str, str]:
    """What is in the way of a word that is not read, and what to do."""
    known = REFUSED.get(name) or REFUSED_LETTERS.get(name[0])
    return known or ("this word is not read", "take it out; docs/gcode-words.md has all that are")
