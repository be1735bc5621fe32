"""Lines of loops and references: L, X, and the lines of the program mode of X.

Owns the reading of these.
Source: manual, "Loop", "xRef", "Throw-away", Appendix C; spec, "Loops and references".
"""

from __future__ import annotations

from typing import Final

from sacbus.language.commands import (
    MAX_LOOPS,
    MAX_REFERENCE,
    QUEUE_LENGTH,
    Command,
    EndLoop,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    ProgramReferences,
    RunPosition,
    RunReferences,
    SetReference,
    ShowReferences,
    ThrowAway,
)
from sacbus.language.line import NOTHING, Line
from sacbus.language.readers.motion import read_move
from sacbus.language.readers.reader import alone, by_letter

__all__ = ["LOOP_LETTERS", "REFERENCE_LETTERS", "read_loop", "read_reference", "read_set_reference"]


def read_loop(line: Line, at: int) -> Command | None:
    """L."""
    letter = line.word[at : at + 1]
    if not letter:
        return EndLoop()
    reader = LOOP_LETTERS.get(letter)
    if reader is not None:
        return reader(line, at + 1)
    if not letter.isdecimal():
        line.refuse(at, "S, F, N, A, a number of loops or the end after L")
        return None
    count = _count(line, at)
    return None if count is None else RunReferences(count)


def _start(line: Line, at: int) -> Command | None:
    position = _position(line, at)
    return None if position is None else LoopStart(position)


def _finish(line: Line, at: int) -> Command | None:
    position = _position(line, at)
    return None if position is None else LoopFinish(position)


def _number(line: Line, at: int) -> Command | None:
    """LN; without a number as with 0: for ever (Appendix C has it without)."""
    if at == len(line.word):
        return LoopCount(0)
    count = _count(line, at)
    return None if count is None else LoopCount(count)


LOOP_LETTERS: Final = by_letter({"s": _start, "f": _finish, "n": _number, "a": alone(LoopQueue())})


def read_reference(line: Line, at: int) -> Command | None:
    """X."""
    letter = line.word[at : at + 1]
    reader = REFERENCE_LETTERS.get(letter)
    if reader is not None:
        return reader(line, at + 1)
    if not letter.isdecimal():
        line.refuse(at, "a queue position, M, P, D or L after X")
        return None
    position = _position(line, at)
    return None if position is None else RunPosition(position)


def _throw_away(line: Line, at: int) -> Command | None:
    move = read_move(line, at)
    return None if move is None else ThrowAway(move)


def _program(line: Line, at: int) -> Command | None:
    return ProgramReferences() if at == len(line.word) else read_set_reference(line, at)


REFERENCE_LETTERS: Final = by_letter(
    {
        "m": _throw_away,
        "p": _program,
        "d": alone(ShowReferences()),
        "l": alone(RunReferences(0)),
    }
)


def read_set_reference(line: Line, at: int) -> Command | None:
    """An entry of the xRef array: its index, a comma, a queue position or 0 for the end."""
    read = line.within(at, "an index of the xRef array", 0, MAX_REFERENCE)
    if read is None:
        return None
    line.stands("index", at)
    index, at = read
    if line.word[at : at + 1] != ",":
        line.refuse(at, "a comma between index and queue position")
        return None
    at += 1
    read = line.within(at, "a queue position or 0 for the end of the array", 0, QUEUE_LENGTH)
    if read is None or not line.ends(read[1]):
        return None
    line.stands("position", at)
    return SetReference(index, read[0])


def _position(line: Line, at: int) -> int | None:
    """The queue position that ends the command."""
    read = line.position(at)
    return read[0] if read is not None and line.ends(read[1]) else None


def _count(line: Line, at: int) -> int | None:
    """The number of loops that ends the command."""
    read = line.whole(at, "the number of loops", MAX_LOOPS, NOTHING)
    if read is None or read[0] is None or not line.ends(read[1]):
        return None
    line.stands("count", at)
    return read[0]
