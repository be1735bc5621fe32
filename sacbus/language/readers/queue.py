"""Lines of the queue: Q with what follows it, and the lines of its program mode.

Owns the reading of these.
Source: manual, "Queue", "sync", Appendix C; spec, "Queue".
"""

from __future__ import annotations

from typing import Final

from sacbus.language.commands import (
    ClearQueue,
    Command,
    Edit,
    EditQueue,
    ProgramQueue,
    RestoreQueue,
    SaveQueue,
    ShowQueue,
)
from sacbus.language.line import Line
from sacbus.language.qualifiers import QUALIFIERS, qualified
from sacbus.language.readers.motion import read_course
from sacbus.language.readers.reader import alone, by_letter

__all__ = ["QUEUE_LETTERS", "read_edit", "read_queue"]

QUEUE_LETTERS: Final = by_letter(
    {
        "p": alone(ProgramQueue()),
        "s": alone(SaveQueue()),
        "r": alone(RestoreQueue()),
        "c": alone(ClearQueue()),
    }
)

_AN_EDIT: Final = "M or one of " + " ".join(QUALIFIERS).upper() + ", what is to be changed"


def read_queue(line: Line, at: int) -> Command | None:
    """Q."""
    letter = line.word[at : at + 1]
    if not letter:
        return ShowQueue()
    reader = QUEUE_LETTERS.get(letter)
    if reader is not None:
        return reader(line, at + 1)
    if not letter.isdecimal():
        line.refuse(at, "P, S, R, C, a queue position or the end after Q")
        return None
    return read_edit(line, at)


def read_edit(line: Line, at: int) -> Command | None:
    """Queue position and what is to be changed there; M and its steps, if any, come first."""
    read = line.position(at)
    if read is None:
        return None
    position, at = read
    if at == len(line.word):
        line.refuse(at, _AN_EDIT)
        return None
    opposite = steps = None
    if line.word[at] in "mM":
        opposite, steps, at = read_course(line, at + 1, "the steps are left as they are")
    draft = qualified(line, at)
    if draft is None:
        return None
    edit = draft.edit(steps, opposite=opposite)
    # Every value may have been too large, and ignored.
    return EditQueue(position, edit) if edit != Edit() else None
