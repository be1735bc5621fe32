"""The qualifiers of a motion command, one reader a letter.

Owns what may stand after the steps of M. A reader is given the line, the index after its letter and
the move so far, and gives the move with its own field set and the index after what it read; None
when it refused the line. Throw-away moves and queue edits are made of the same table.
Source: manual, "Motion", "V", "Accel", "Decel", "sync", "T", Appendix C.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

from .commands import BARE, Move
from .line import Line

__all__ = ["BITS_32", "QUALIFIERS", "qualified", "read_velocity"]

BITS_32: Final = 2**32 - 1
"""Steps, cycle and T have 32 bits on the device; RPM is given the same."""

_Read = tuple[Move, int] | None
"""The move so far and the index after what was read; None when the line is refused."""

_Qualifier = Callable[[Line, int, Move], _Read]
"""Reads what follows a qualifier's letter, from the index given."""


def read_velocity(line: Line, at: int, move: Move) -> _Read:
    by_cycle = line.word[at : at + 1] in ("c", "C")
    if not by_cycle and not line.word[at : at + 1].isdecimal():
        return replace(move, rpm=BARE, cycle_us=None), at
    at += by_cycle
    name = "the cycle in microseconds" if by_cycle else "the velocity in RPM"
    read = line.whole(at, name, BITS_32, "the velocity is ignored")
    if read is None:
        return None
    value, after = read
    if value is None:
        return move, after
    if not value:
        line.remark(at, f"{name}, at least 1", "0", "the default cycle is used")
        return replace(move, rpm=BARE, cycle_us=None), after
    if by_cycle:
        return replace(move, rpm=None, cycle_us=value), after
    return replace(move, rpm=value, cycle_us=None), after


def _a(line: Line, at: int, move: Move) -> _Read:
    read = line.hundredths(at, "an acceleration")
    return None if read is None else (replace(move, acc100=read[0]), read[1])


def _d(line: Line, at: int, move: Move) -> _Read:
    read = line.hundredths(at, "a deceleration")
    return None if read is None else (replace(move, dec100=read[0]), read[1])


def _l(line: Line, at: int, move: Move) -> _Read:
    flag = line.word[at : at + 1]
    if flag not in ("0", "1"):
        line.refuse(at, "0 (harmonic) or 1 (linear) after L")
        return None
    return replace(move, linear=flag == "1"), at + 1


def _u(line: Line, at: int, move: Move) -> _Read:
    read = line.whole(at, "the number of extra pulses", 255, "they are ignored")
    if read is None or read[0] is None:
        return read and (move, read[1])
    return replace(move, extra_pulses=read[0]), read[1]


def _t(line: Line, at: int, move: Move) -> _Read:
    read = line.whole(at, "the start wait in microseconds", BITS_32, "the wait is ignored")
    if read is None or read[0] is None:
        return read and (move, read[1])
    return replace(move, wait_us=read[0]), read[1]


def _s(line: Line, at: int, move: Move) -> _Read:
    flag = line.word[at : at + 1]
    return replace(move, sync=flag != "0"), at + (flag in ("0", "1"))


def _f(_line: Line, at: int, move: Move) -> _Read:
    return replace(move, pulses=False), at


def _p(_line: Line, at: int, move: Move) -> _Read:
    return replace(move, pulses=True), at


QUALIFIERS: Final[Mapping[str, _Qualifier]] = {
    "v": read_velocity, "a": _a, "d": _d, "l": _l, "u": _u, "t": _t, "s": _s, "f": _f, "p": _p,
}  # fmt: skip
"""What may follow the steps, in any order; either case."""

_A_QUALIFIER: Final = "one of " + " ".join(QUALIFIERS).upper() + ", a space or the end"


def qualified(line: Line, at: int, move: Move) -> Move | None:
    """Add every qualifier from ``at`` to the end of the command."""
    while at < len(line.word):
        qualifier = QUALIFIERS.get(line.word[at].lower())
        if qualifier is None:
            line.refuse(at, _A_QUALIFIER)
            return None
        read = qualifier(line, at + 1, move)
        if read is None:
            return None
        move, at = read
    return move
