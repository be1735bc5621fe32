"""What is wrong with a part program: where, which word, why, and what to do.

Owns how a mistake reads. One line each, in the form of all errors of sacbus.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["GcodeError", "Mistake"]


@dataclass(frozen=True, slots=True)
class Mistake:
    """One thing that is wrong: ``WORD: WHAT, NAME:LINE:COLUMN, WHAT TO DO``.

    ``name`` is what the program was called, line and column count from 1. ``word`` is the word as
    it is read, upper case and without blanks.
    """

    name: str
    line: int
    column: int
    word: str
    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.word}: {self.what}, {self.name}:{self.line}:{self.column}, {self.remedy}"


class GcodeError(ValueError):
    """A part program that cannot be carried out: its ``mistakes``; the text has one a line."""

    mistakes: tuple[Mistake, ...]

    def __init__(self, mistakes: Sequence[Mistake]) -> None:
        super().__init__("\n".join(map(str, mistakes)))
        self.mistakes = tuple(mistakes)
