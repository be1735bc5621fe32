"""What a reader is, and the simplest ones: a command that is one letter, a table by a letter.

Owns these shapes; knows no command.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sacbus.language.commands import Command
from sacbus.language.line import Line

__all__ = ["Reader", "alone", "by_letter"]

Reader = Callable[[Line, int], Command | None]
"""Reads a line from the index behind the letter, or letters, that chose this reader."""


def alone(command: Command) -> Reader:
    """Reader of a command that takes nothing after it."""

    def read(line: Line, at: int) -> Command | None:
        return command if line.ends(at) else None

    return read


def by_letter(letters: Mapping[str, Reader]) -> dict[str, Reader]:
    """A table by letter in either case, from one by lower-case letters."""
    return {case: reader for key, reader in letters.items() for case in (key, key.upper())}
