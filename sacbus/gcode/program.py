"""A part program carried out line by line: where the tool is, and what each line makes it do.

Owns the order in which the words of a line act, and which of them may not stand together or alone.
It holds a line at a time, so a program may be of any length.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Order of Execution"; spec, mother
("G-code"). Decisions: docs, "The words of G-code".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from sacbus.gcode.arc import Arc
from sacbus.gcode.frame import Frame
from sacbus.gcode.line import Line, read_line
from sacbus.gcode.mistake import GcodeError, Mistake
from sacbus.gcode.modes import Modes, Motion
from sacbus.gcode.turn import ARC_LETTERS, arc_of
from sacbus.gcode.vocabulary import REPORTED, Group
from sacbus.toolpath import Dwell, Halt, Machine, Straight

__all__ = ["Element", "Program"]

Element = Straight | Arc | Dwell | Halt
"""What a line comes to; an arc is not yet chords."""

_ENDS: Final = frozenset({"M2", "M30"})


class Program:
    """A part program as it is carried out on a machine.

    machine: its axes, feed and tolerance count. name: what the program is called in mistakes.
    skipping: whether lines that begin with a slash are left out. ValueError for a tolerance that
    is not positive.
    """

    __slots__ = (
        "_begun",
        "_feed",
        "_frame",
        "_modes",
        "_name",
        "_plain",
        "_skipping",
        "_speed",
        "_tolerance",
        "ended",
    )

    def __init__(self, machine: Machine, name: str, *, skipping: bool = True) -> None:
        if not machine.tolerance > 0:
            raise ValueError(f"chords need a tolerance above 0 mm, got {machine.tolerance}")
        self._tolerance = machine.tolerance
        self._name = name
        self._skipping = skipping
        self._frame = Frame(machine)
        self._plain = self._frame.axes.keys() | {"F"}
        self._modes = Modes()
        self._feed = machine.feed
        self._speed: float | None = None
        self._begun = False
        #: Whether the program's end has been read: there is nothing more to come.
        self.ended = False

    def obey(self, number: int, text: str) -> Sequence[Element]:
        """What line ``number`` makes the machine do; GcodeError with all that is wrong with it.

        After an error the program stands as if the line had been right, as far as that can be
        told, so that the lines that follow can be read for their own mistakes.
        """
        bare = text.strip()
        if not bare:
            return ()
        if bare[0] == "%":
            return self._percent(number, text, bare)
        if bare[0] == "/":
            if self._skipping:
                return ()
            text = text.replace("/", " ", 1)
        line = read_line(text, number, self._name, self._frame.axes)
        self._begun = self._begun or bool(line.words)
        if line.codes:
            self._modes.take(line.codes)
        try:
            if line.mistakes:
                raise GcodeError(line.mistakes)
            return self._carried_out(line)
        except GcodeError:
            self._frame.at = self._frame.end(line, self._modes)
            self.ended = line.codes.get(Group.STOP) in _ENDS
            raise

    def _percent(self, number: int, text: str, bare: str) -> Sequence[Element]:
        if bare != "%":
            column = text.index("%") + 1
            what, remedy = "it stands in a line of its own", "write it there"
            raise GcodeError([Mistake(self._name, number, column, "%", what, remedy)])
        self.ended = self._begun
        self._begun = True
        return ()

    def _carried_out(self, line: Line) -> Sequence[Element]:
        """The words of a line in their order of execution."""
        if (feed := line.values.get("F")) is not None:
            if feed <= 0:
                raise line.mistake("F", "expected a feed above 0", "write one")
            self._feed = feed * self._modes.mm
        if line.values.keys() <= self._plain and not line.messages:
            if not line.codes:
                return self._moved(line)
            if len(line.codes) == 1 and Group.MOTION in line.codes:
                return self._moved(line)
        self._check_together(line)
        done: list[Element] = [Halt(text, line=line.number) for text in line.messages]
        if told := self._told(line):
            done.append(Halt(told, line=line.number))
        once = line.codes.get(Group.ONCE)
        if once == "G4":
            done.append(Dwell(self._seconds(line), line.number))
        elif once == "G92.1":
            self._frame.restore_origin()
        if once == "G28":
            done += self._returned(line)
        elif once == "G92":
            self._frame.move_origin(line, self._modes)
        else:
            done += self._moved(line)
        if (stop := line.codes.get(Group.STOP)) is not None:
            done.append(Halt(stop, waits=stop == "M0", line=line.number))
            self.ended = stop in _ENDS
        return done

    def _check_together(self, line: Line) -> None:
        """Words that mean nothing beside, or without, the others of their line."""
        codes, values = line.codes, line.values
        once, motion = codes.get(Group.ONCE), codes.get(Group.MOTION)
        if once in {"G28", "G92"} and motion is not None:
            what = f"{motion} and {once} would both use the axis words"
            raise line.mistake(once, what, "write them in two lines")
        if once == "G53":
            if self._modes.motion not in {Motion.RAPID, Motion.FEED}:
                raise line.mistake("G53", "it goes with G0 and G1 alone", "write one of them")
            if not self._frame.named(line):
                raise line.mistake("G53", "no axis word stands in its line", "write where to go")
        if once == "G92" and not self._frame.named(line):
            raise line.mistake("G92", "no axis word stands in its line", "write one, or G92.1")
        if "P" in values and once != "G4":
            raise line.mistake("P", "it is the time of G4, which is not here", "take it out")
        if "T" in values and codes.get(Group.TOOL) is None:
            raise line.mistake("T", "tools are not chosen in advance", "write it beside M6")
        arc = self._modes.motion in {Motion.CLOCKWISE, Motion.COUNTERCLOCKWISE}
        for letter in ARC_LETTERS:
            if letter in values and (not arc or once in {"G28", "G92"}):
                raise line.mistake(letter, "it belongs to an arc", "write G2 or G3, or take it out")

    def _told(self, line: Line) -> str:
        """The words that somebody else has to see to, in their order of execution."""
        words = []
        if (speed := line.values.get("S")) is not None:
            if speed < 0:
                raise line.mistake("S", "expected a speed of 0 or more", "write one")
            if speed != self._speed:
                words.append(f"S{_figure(speed)}")
                self._speed = speed
        if (tool := line.values.get("T")) is not None:
            if tool < 0 or tool != int(tool):
                raise line.mistake("T", "expected the whole number of a tool", "write one")
            words.append(f"T{_figure(tool)}")
        words += [line.codes[group] for group in REPORTED if group in line.codes]
        return " ".join(words)

    def _seconds(self, line: Line) -> float:
        seconds = line.values.get("P")
        if seconds is None:
            raise line.mistake("G4", "P with the seconds is missing", "write them as P0.5")
        if seconds < 0:
            raise line.mistake("P", "expected 0 s or more", "write a time to stand still")
        return seconds

    def _moved(self, line: Line) -> Sequence[Element]:
        """The motion that is in force, if the line has a word for it."""
        motion, frame = self._modes.motion, self._frame
        end = frame.end(line, self._modes)
        if motion is Motion.FEED or motion is Motion.RAPID:
            if end == frame.at:
                return ()
            frame.at = end
            return (Straight(end, self._feed if motion is Motion.FEED else None, line.number),)
        named = frame.named(line)
        if motion is None:
            if named:
                self._modes.motion = Motion.FEED  # told once, not for every line that follows
                what = "no motion is in force"
                raise line.mistake(named[0], what, "write G0, G1, G2 or G3 in this line or before")
            return ()
        if not named and not any(letter in line.values for letter in ARC_LETTERS):
            return ()
        arc = arc_of(line, self._modes, frame, self._tolerance, self._feed)
        frame.at = end
        return (arc,)

    def _returned(self, line: Line) -> Sequence[Element]:
        """G28: to the place that its axis words give, then with those axes to the beginning.

        Without axis words with all of them, and straight there. Both at the rapid rate.
        """
        frame = self._frame
        between = frame.end(line, self._modes)
        done: list[Element] = []
        for to in (between, frame.home(line, between)):
            if to != frame.at:
                done.append(Straight(to, None, line.number))
                frame.at = to
        return done


def _figure(value: float) -> str:
    """A figure as short as it can be written: ``12000``, ``0.5``."""
    return str(int(value)) if value == int(value) else str(value)
