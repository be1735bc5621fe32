"""The qualifiers of a motion command, one reader a letter.

Owns what may stand after the steps of M. A reader is given the line, the index after its letter and
a draft of what was read so far; it puts its own field into the draft and gives the index after
what it read, None when it refused the line. Throw-away moves and queue edits are made of the same
table.
Source: manual, "Motion", "V", "Accel", "Decel", "sync", "T", Appendix C.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from .commands import BARE, Bare, Edit, Move
from .line import Line

__all__ = ["BITS_32", "QUALIFIERS", "Draft", "qualified", "read_velocity"]

BITS_32: Final = 2**32 - 1
"""Steps, cycle and T have 32 bits on the device; RPM is given the same."""


class Draft:
    """The qualifiers of a line as read so far; the fields are those of :class:`Move`."""

    __slots__ = (
        "acc100",
        "cycle_us",
        "dec100",
        "extra_pulses",
        "linear",
        "pulses",
        "rpm",
        "sync",
        "wait_us",
    )

    def __init__(self) -> None:
        self.rpm: int | Bare | None = None
        self.cycle_us: int | None = None
        self.acc100: int | Bare | None = None
        self.dec100: int | Bare | None = None
        self.linear: bool | None = None
        self.extra_pulses: int | None = None
        self.wait_us: int | None = None
        self.sync: bool | None = None
        self.pulses: bool | None = None

    def move(self, steps: int | None, *, opposite: bool) -> Move:
        """The motion command of these qualifiers."""
        return Move(
            steps,
            opposite,
            self.rpm,
            self.cycle_us,
            self.acc100,
            self.dec100,
            self.linear,
            self.extra_pulses,
            self.wait_us,
            self.sync,
            self.pulses,
        )

    def edit(self, steps: int | None, *, opposite: bool | None) -> Edit:
        """The edit of a stored motion that these qualifiers make."""
        return Edit(
            opposite,
            steps,
            self.rpm,
            self.cycle_us,
            self.acc100,
            self.dec100,
            self.linear,
            self.extra_pulses,
            self.wait_us,
            self.sync,
            self.pulses,
        )


_Qualifier = Callable[[Line, int, Draft], int | None]
"""Reads what follows a qualifier's letter, from the index given."""


def read_velocity(line: Line, at: int, draft: Draft) -> int | None:
    """Read the velocity in RPM or as a cycle; the last on a line wins, so either ends the other."""
    letter = at - 1
    by_cycle = line.word[at : at + 1] in ("c", "C")
    rpm: int | Bare | None = BARE
    cycle_us = None
    if by_cycle or line.word[at : at + 1].isdecimal():
        at += by_cycle
        name = "the cycle in microseconds" if by_cycle else "the velocity in RPM"
        read = line.whole(at, name, BITS_32, "the velocity is ignored")
        if read is None:
            return None
        value, after = read
        if value is None:
            return after
        if not value:
            line.remark(at, f"{name}, at least 1", "0", "the default cycle is used")
        elif by_cycle:
            rpm, cycle_us = None, value
        else:
            rpm = value
        at = after
    draft.rpm, draft.cycle_us = rpm, cycle_us
    for field in ("rpm", "cycle_us"):
        line.columns.pop(field, None)
    line.stands("rpm" if cycle_us is None else "cycle_us", letter)
    return at


def _a(line: Line, at: int, draft: Draft) -> int | None:
    read = line.hundredths(at, "an acceleration")
    if read is None:
        return None
    line.stands("acc100", at - 1)
    draft.acc100, after = read
    return after


def _d(line: Line, at: int, draft: Draft) -> int | None:
    read = line.hundredths(at, "a deceleration")
    if read is None:
        return None
    line.stands("dec100", at - 1)
    draft.dec100, after = read
    return after


def _l(line: Line, at: int, draft: Draft) -> int | None:
    flag = line.word[at : at + 1]
    if flag not in ("0", "1"):
        line.refuse(at, "0 (harmonic) or 1 (linear) after L")
        return None
    line.stands("linear", at - 1)
    draft.linear = flag == "1"
    return at + 1


def _u(line: Line, at: int, draft: Draft) -> int | None:
    read = line.whole(at, "the number of extra pulses", 255, "they are ignored")
    if read is None:
        return None
    value, after = read
    if value is not None:
        line.stands("extra_pulses", at - 1)
        draft.extra_pulses = value
    return after


def _t(line: Line, at: int, draft: Draft) -> int | None:
    read = line.whole(at, "the start wait in microseconds", BITS_32, "the wait is ignored")
    if read is None:
        return None
    value, after = read
    if value is not None:
        line.stands("wait_us", at - 1)
        draft.wait_us = value
    return after


def _s(line: Line, at: int, draft: Draft) -> int | None:
    flag = line.word[at : at + 1]
    line.stands("sync", at - 1)
    draft.sync = flag != "0"
    return at + (flag in ("0", "1"))


def _f(line: Line, at: int, draft: Draft) -> int | None:
    line.stands("pulses", at - 1)
    draft.pulses = False
    return at


def _p(line: Line, at: int, draft: Draft) -> int | None:
    line.stands("pulses", at - 1)
    draft.pulses = True
    return at


QUALIFIERS: Final[Mapping[str, _Qualifier]] = {
    "v": read_velocity, "a": _a, "d": _d, "l": _l, "u": _u, "t": _t, "s": _s, "f": _f, "p": _p,
}  # fmt: skip
"""What may follow the steps, in any order; either case."""

_A_QUALIFIER: Final = "one of " + " ".join(QUALIFIERS).upper() + ", a space or the end"


def qualified(line: Line, at: int) -> Draft | None:
    """All qualifiers from ``at`` to the end of the command; None when the line is refused."""
    draft = Draft()
    while at < len(line.word):
        qualifier = QUALIFIERS.get(line.word[at].lower())
        if qualifier is None:
            line.refuse(at, _A_QUALIFIER)
            return None
        after = qualifier(line, at + 1, draft)
        if after is None:
            return None
        at = after
    return draft
