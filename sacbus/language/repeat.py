"""Which lines may reach a node twice without harm.

Owns mother's list. SAC has no sequence numbers, so a lost ACK leaves open whether a command was
obeyed; sending again is safe only for what does the same the second time. The list is a list of
leave: whatever is not on it, unknown lines too, may not be repeated. It covers commands that the
grammar does not read yet, since mother also talks to real nodes.
Source: spec, "Mother", Transactions.
"""

from __future__ import annotations

import re
from typing import Final

from .commands import (
    Acceleration,
    Deceleration,
    Empty,
    Move,
    ReleaseSync,
    ShowVelocity,
    Stop,
    Velocity,
)
from .grammar import parse
from .line import Line
from .qualifiers import qualified

__all__ = ["repeatable"]

_SETS: Final = (
    Velocity,
    ShowVelocity,
    Acceleration,
    Deceleration,
    Stop,
    ReleaseSync,
    Empty,
)

_SETTINGS: Final = re.compile(
    r"[qQ][sSrRcC]"
    r"|[lL][sSfF][0-9]{1,2}"
    r"|[lL][nN][0-9]{1,5}"
    r"|\$[HK][0-9]*"
    r"|\$[LO][01]"
    r"|\$[FP]"
    r"|\$C[A-CE-NUa-kmnu](?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"
)
"""Case counts after the dollar only. $C: the letters of the table of persistent parameters."""

_EDIT: Final = re.compile(r"[qQ]0*(?:[1-9]|[12][0-9]|30)(?![0-9])([mM]-?[0-9]*)?")
"""A queue edit up to its qualifiers; positions 1 to 30."""


def repeatable(line: bytes) -> bool:
    """Whether a node that gets this line twice ends up as if it came once.

    line: a packet's body. The empty body, with which mother scans, is repeatable as well.
    """
    if isinstance(parse(line).command, _SETS):
        return True
    word = line.decode("latin-1").partition(" ")[0]
    return _SETTINGS.fullmatch(word) is not None or _is_edit(word)


def _is_edit(word: str) -> bool:
    edit = _EDIT.match(word)
    if edit is None or (edit[1] is None and edit.end() == len(word)):
        return False
    return qualified(Line(word), edit.end(), Move()) is not None
