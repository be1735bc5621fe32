"""Where the tool is, and where the program's figures count from.

Owns the tool's place and the origin that G92 moves, and turns figures of a line into places. Places
are mm from where the machine stood at the beginning, one figure for each of its axes, in its order.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Coordinate Systems". Decisions: docs,
"The words of G-code": the origin is where the machine stands; inches do not concern rotary axes.
"""

from __future__ import annotations

from sacbus.gcode.line import Line
from sacbus.gcode.modes import Modes
from sacbus.gcode.vocabulary import AXIS_LETTERS, ROTARY_LETTERS, Group
from sacbus.toolpath import Machine

__all__ = ["Frame", "Place"]

Place = tuple[float, ...]


class Frame:
    """The tool's place ``at``; ``axes`` by their letters; ``origin``: where figures count from."""

    __slots__ = ("at", "axes", "origin")

    def __init__(self, machine: Machine) -> None:
        self.axes = {
            axis.name: index for index, axis in enumerate(machine.axes) if axis.name in AXIS_LETTERS
        }
        self.at: Place = (0.0,) * len(machine.axes)
        self.origin: Place = self.at

    def end(self, line: Line, modes: Modes) -> Place:
        """Where the axis words of a line lead to; the same place if it has none."""
        values = line.values
        end = list(self.at)
        from_beginning = line.codes.get(Group.ONCE) == "G53"
        for letter, index in self.axes.items():
            if (value := values.get(letter)) is None:
                continue
            if modes.mm != 1.0 and letter not in ROTARY_LETTERS:
                value *= modes.mm
            if from_beginning:
                end[index] = value
            elif modes.absolute:
                end[index] = value + self.origin[index]
            else:
                end[index] += value
        return tuple(end)

    def home(self, line: Line, between: Place) -> Place:
        """``between`` with the axes that a line names at the beginning; all, if it names none."""
        named = {self.axes[letter] for letter in self.named(line)} or set(range(len(between)))
        return tuple(0.0 if index in named else mm for index, mm in enumerate(between))

    def named(self, line: Line) -> list[str]:
        """The letters of the axes that a line has words for."""
        return [letter for letter in line.values if letter in self.axes]

    def move_origin(self, line: Line, modes: Modes) -> None:
        """From now on, call the tool's place what the axis words of a line say."""
        origin = list(self.origin)
        for letter in self.named(line):
            index = self.axes[letter]
            mm = 1.0 if letter in ROTARY_LETTERS else modes.mm
            origin[index] = self.at[index] - line.values[letter] * mm
        self.origin = tuple(origin)

    def restore_origin(self) -> None:
        """Count from where the machine stood at the beginning."""
        self.origin = (0.0,) * len(self.at)
