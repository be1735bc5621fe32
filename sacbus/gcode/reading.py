"""Part programs read: what they make the machine do, and what is wrong with them.

Owns the two ways through a program: once to check all of it before anything moves, and once to
carry it out. Both take a line at a time.
Source: spec, mother ("G-code").
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from sacbus.gcode.arc import Arc
from sacbus.gcode.mistake import GcodeError, Mistake
from sacbus.gcode.program import Program
from sacbus.toolpath import MOST_STEPS, Dwell, Halt, Machine, PathItem, Straight

__all__ = ["Checked", "check_program", "read_program"]

MOST: Final = 20
"""Mistakes that are told at once: about a screen of them."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What a program comes to that nothing is wrong with.

    lines: read, up to the program's end. stretches: straight ones, chords of arcs included.
    length: mm of its path. dwell: s of standing still. halts: how many times somebody is told
    something; waits: how many of them wait for somebody.
    """

    lines: int
    stretches: int
    length: float
    dwell: float
    halts: int
    waits: int


def read_program(
    lines: Iterable[str], machine: Machine, name: str = "the program", *, skipping: bool = True
) -> Iterator[PathItem]:
    """What a program makes a machine do, one thing after the other, as its lines are read.

    lines: with or without their line feeds, such as an open text file. Nothing is read beyond the
    program's end: M2, M30, or the second line with a percent sign. name: what the program is
    called in mistakes. skipping: leave out lines that begin with a slash.
    Raises GcodeError at the first line that is wrong; ``check_program`` finds out before.
    """
    program = Program(machine, name, skipping=skipping)
    for number, text in enumerate(lines, 1):
        for element in program.obey(number, text):
            if isinstance(element, Arc):
                yield from element.straights()
            else:
                yield element
        if program.ended:
            return


def check_program(
    lines: Iterable[str],
    machine: Machine,
    name: str = "the program",
    *,
    skipping: bool = True,
    most: int = MOST,
) -> Checked:
    """Read a whole program and tell what it comes to, without working out a chord.

    Arguments as of ``read_program``. Raises GcodeError with all that is wrong with it, in the order
    of its lines; at ``most`` mistakes it gives up.
    """
    program = Program(machine, name, skipping=skipping)
    mistakes: list[Mistake] = []
    number = stretches = halts = waits = 0
    length = dwell = 0.0
    place = (0.0,) * len(machine.axes)
    for number, text in enumerate(lines, 1):
        try:
            elements = program.obey(number, text)
        except GcodeError as fault:
            mistakes += fault.mistakes
            if len(mistakes) >= most:
                break
            elements = ()
        for element in elements:
            match element:
                case Straight():
                    stretches += 1
                    if (far := machine.too_far(place, element.to)) is not None:
                        what = f"would go {far[1]:.0f} steps at once, {MOST_STEPS} at most"
                        mistakes.append(
                            Mistake(name, number, 1, far[0], what, "check units and steps per mm")
                        )
                    length += math.dist(place, element.to)
                    place = element.to
                case Arc():
                    stretches += element.chords
                    length += element.length
                    place = element.to
                case Dwell():
                    dwell += element.seconds
                case Halt():
                    halts += 1
                    waits += element.waits
        if program.ended:
            break
    if mistakes:
        raise GcodeError(mistakes[:most])
    return Checked(number, stretches, length, dwell, halts, waits)
