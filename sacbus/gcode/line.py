"""A line of a part program, its words sorted by what they are for.

Owns which words may stand together, and finds everything that is wrong with the words themselves.
What a line does where the tool is, is the program's (``program``).
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Format of a Line", "Modal Groups".
"""

from __future__ import annotations

from collections.abc import Collection

from sacbus.gcode.mistake import GcodeError, Mistake
from sacbus.gcode.vocabulary import (
    AXIS_LETTERS,
    GROUPS,
    VALUE_LETTERS,
    Group,
    name_of,
    why_refused,
)
from sacbus.gcode.words import Flaw, Word, column_of, flaw_at, split_words, uncommented

__all__ = ["Line", "read_line"]

_VALUE_LETTERS = VALUE_LETTERS - {"N"}


class Line:
    """What is written in one line: ``values`` by letter, ``codes`` by group, messages, mistakes.

    ``codes`` has G and M words by their names, ``G1`` for ``G01``. Values are as written, in the
    line's own units.
    """

    __slots__ = ("_name", "_text", "codes", "messages", "mistakes", "number", "values", "words")

    def __init__(self, text: str, number: int, name: str, messages: tuple[str, ...]) -> None:
        self._text = text
        self._name = name
        self.number = number
        self.messages = messages
        self.words: list[Word] = []
        self.values: dict[str, float] = {}
        self.codes: dict[Group, str] = {}
        self.mistakes: list[Mistake] = []

    def mistake(self, word: str, what: str, remedy: str) -> GcodeError:
        """What to raise about a word of this line: a letter, or the name of a G or M word.

        A word that is not there, because an earlier line's is in force, stands for the first one.
        """
        for index, (letter, number) in enumerate(self.words):
            if word in (letter, name_of(letter, number)):
                return GcodeError([self._about(index, what, remedy)])
        return GcodeError([Mistake(self._name, self.number, self._column(0), word, what, remedy)])

    def read(self, axes: Collection[str]) -> None:
        """Sort the words; ``axes`` are the letters of those that the machine has."""
        codes, values = self.codes, self.values
        for index, (letter, number) in enumerate(self.words):
            if letter in axes or letter in _VALUE_LETTERS:
                if letter in values:
                    self._wrong(index, f"{letter} stands here twice", "write it once")
                values[letter] = float(number)
            elif (group := GROUPS.get(name := letter + number)) or (
                group := GROUPS.get(name := name_of(letter, number))
            ):
                if group in codes:
                    what = f"{codes[group]} stands in the same line, and excludes it"
                    self._wrong(index, what, "keep one of them")
                codes[group] = name
            elif letter == "N":
                self._number(index, number)
            elif letter in AXIS_LETTERS:
                what = f"the machine has no axis {letter}"
                self._wrong(index, what, f"give it one (--axis {letter}=NODE:STEPS) or take it out")
            else:
                self._wrong(index, *why_refused(name_of(letter, number)))

    def flawed(self, flaw: Flaw, column: int) -> None:
        """Something is wrong with the form of the line."""
        self.mistakes.append(
            Mistake(self._name, self.number, column, flaw.shown, flaw.what, flaw.remedy)
        )

    def _number(self, index: int, number: str) -> None:
        if not number.isdigit():
            self._wrong(index, "a line number is a whole number without a sign", "write one")
        elif index:
            self._wrong(index, "a line number begins its line", "write it there")

    def _wrong(self, index: int, what: str, remedy: str) -> None:
        self.mistakes.append(self._about(index, what, remedy))

    def _about(self, index: int, what: str, remedy: str) -> Mistake:
        place = sum(len(letter) + len(number) for letter, number in self.words[:index])
        word = "".join(self.words[index])
        return Mistake(self._name, self.number, self._column(place), word, what, remedy)

    def _column(self, place: int) -> int:
        return column_of(self._text, place)


def read_line(text: str, number: int, name: str, axes: Collection[str]) -> Line:
    """A line of a program called ``name``; never raises: ``mistakes`` has what is wrong.

    axes: the letters of those that the machine has. number: the line's in its file, from 1.
    """
    body, messages, flaws = uncommented(text)
    line = Line(text, number, name, messages)
    line.words, end = split_words(body)
    line.read(axes)
    for flaw in flaws:
        line.flawed(flaw, flaw.at)
    subprogram = any(letter == "O" for letter, _ in line.words)
    if end < len(body) and not subprogram:  # its keywords are no words, and the O tells enough
        flaw = flaw_at(body, end)
        line.flawed(flaw, column_of(text, flaw.at))
    return line
