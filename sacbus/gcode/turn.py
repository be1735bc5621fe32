"""A line with an arc in it: from its words to the arc's plane, centre and angle.

Owns which words an arc needs, and what is refused about it. The geometry is ``arc``'s.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Arc at Feed Rate". Decisions: docs, "The
words of G-code".
"""

from __future__ import annotations

import math
from typing import Final

from sacbus.gcode.arc import SAME, Arc, Point, angle_between, centre_from_radius
from sacbus.gcode.frame import Frame
from sacbus.gcode.line import Line
from sacbus.gcode.modes import Modes, Motion

__all__ = ["ARC_LETTERS", "arc_of"]

ARC_LETTERS: Final = ("I", "J", "K", "R")

ROUNDING: Final = 0.01
"""mm by which the two ends of an arc may be at different distances from its centre, at least: what
is rounded to three decimals of a mm, or four of an inch, stays well below (decision)."""


def arc_of(line: Line, modes: Modes, frame: Frame, tolerance: float, feed: float) -> Arc:
    """The arc that a line asks for; GcodeError if it asks for none that there could be.

    tolerance: mm of the chords; feed: mm/min.
    """
    motion = modes.motion
    assert motion is Motion.CLOCKWISE or motion is Motion.COUNTERCLOCKWISE
    clockwise = motion is Motion.CLOCKWISE
    axes = _axes_of_plane(line, modes, frame, motion)
    to = frame.end(line, modes)
    start, end = _in_plane(frame.at, axes), _in_plane(to, axes)
    slack = max(tolerance, ROUNDING)
    if "R" in line.values:
        radius = _radius(line, start, end) * modes.mm
        found = centre_from_radius(start, end, radius, slack, clockwise=clockwise)
        if found is None:
            apart = math.dist(start, end)
            what = f"the ends are {apart:.4f} mm apart, more than twice {abs(radius):.4f} mm"
            raise line.mistake("R", what, "correct the radius or the end")
        centre = found
    else:
        centre = _centre(line, modes, frame, motion, axes)
        _check_radii(line, motion, math.dist(start, centre), math.dist(end, centre), slack)
    angle = angle_between(start, end, centre, clockwise=clockwise)
    return Arc(frame.at, to, axes, centre, angle, tolerance, feed, line.number)


def _in_plane(place: tuple[float, ...], axes: tuple[int, int]) -> Point:
    return place[axes[0]], place[axes[1]]


def _axes_of_plane(line: Line, modes: Modes, frame: Frame, motion: Motion) -> tuple[int, int]:
    plane = modes.plane
    for letter in (plane.first, plane.second):
        if letter not in frame.axes:
            what = f"an arc in this plane needs axis {letter}, which the machine does not have"
            remedy = f"give it one (--axis {letter}=NODE:STEPS) or choose G17, G18 or G19"
            raise line.mistake(motion.value, what, remedy)
    return frame.axes[plane.first], frame.axes[plane.second]


def _radius(line: Line, start: Point, end: Point) -> float:
    """R as written, once it is clear that it makes an arc."""
    radius = line.values["R"]
    if {"I", "J", "K"} & line.values.keys():
        raise line.mistake("R", "I, J or K give the centre as well", "keep one of both")
    if radius == 0:
        raise line.mistake("R", "expected a radius other than 0", "write one, or G1")
    if math.dist(start, end) < SAME:
        what = "the arc has no end apart from its beginning, so R leaves its centre open"
        raise line.mistake("R", what, "write the end, or the centre of a full circle")
    return radius


def _centre(line: Line, modes: Modes, frame: Frame, motion: Motion, axes: tuple[int, int]) -> Point:
    """The centre by I, J and K: from the beginning of the arc (G91.1), or a place (G90.1)."""
    values = line.values
    letters = modes.plane.along_first, modes.plane.along_second
    both = " and ".join(letters)
    for letter in ("I", "J", "K"):
        if letter in values and letter not in letters:
            what = f"an arc in this plane has its centre by {both}"
            raise line.mistake(letter, what, "choose the plane by G17, G18 or G19")
    given = [letter in values for letter in letters]
    if not any(given):
        raise line.mistake(motion.value, "the arc has no centre", f"write {both}, or R")
    if modes.centre_absolute and not all(given):
        missing = letters[given.index(False)]
        what = f"{missing} is missing, and G90.1 asks for the whole centre"
        raise line.mistake(motion.value, what, f"write {missing}, or G91.1")
    base = frame.origin if modes.centre_absolute else frame.at
    return (
        base[axes[0]] + values.get(letters[0], 0.0) * modes.mm,
        base[axes[1]] + values.get(letters[1], 0.0) * modes.mm,
    )


def _check_radii(line: Line, motion: Motion, first: float, last: float, slack: float) -> None:
    if first < SAME:
        raise line.mistake(motion.value, "the arc begins at its own centre", "correct the centre")
    if abs(first - last) > slack:
        what = (
            f"the arc begins {first:.4f} mm from its centre and ends {last:.4f} mm from it, "
            f"more than {slack:g} mm apart"
        )
        raise line.mistake(motion.value, what, "correct the centre or the end")
