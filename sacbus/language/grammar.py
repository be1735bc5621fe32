"""One grammar for every line: text to a typed command, or to words about why not.

Owns what a line may look like. ``parse`` never raises, whatever the bytes; what SAC would silently
do nothing with comes back as no command and one ``Remark`` or more.

Theory of operation. A good motion line is recognised whole by one regular expression (``_GOOD``)
and never looked at again. Everything else goes to a table by its first character (``_READERS``) and
is read piece by piece, each piece by a reader that knows what it expects; columns are worked out
only there. Two rules for whoever edits this file: the readers alone define the language, ``_GOOD``
is a short cut through the part that needs no remark, and the tests hold the two together; and
alternatives of ``_GOOD`` must not overlap, or a bad line costs exponential time.

To add a command: a type in ``commands.py``, a reader here, a row in ``_READERS`` in the place of
its row in ``_NOT_YET``. The qualifiers of M are a table of their own (``qualifiers.py``).

Decisions where the manual is silent: a qualifier given twice counts once, the last one; V without a
number is the default cycle in a motion command too; RPM has 32 bits like the cycle.
Source: manual, "Functional Specifications", "Motion", "Accel", "V", Appendix C; spec, "Two ports".
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from .commands import (
    BARE,
    Acceleration,
    Bare,
    Command,
    Deceleration,
    Empty,
    Forward,
    Message,
    Move,
    Next,
    ReleaseSync,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    Stop,
    Velocity,
)
from .line import DIGITS, NOTHING, Line, Remark, end_of, short
from .qualifiers import BITS_32, qualified, read_velocity
from .values import maker

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

__all__ = ["Parsed", "parse"]

_CACHED_LINES: Final = 4096
"""Lines remembered: one broadcast goes to 250 nodes, a loop repeats 30 lines."""
_CACHED_LENGTH: Final = 255
"""Longer lines (no packet has them) are not remembered, so the cache is bounded in bytes too."""


@dataclass(frozen=True, slots=True)
class Parsed:
    """A command, or None when the line does nothing; and what there is to say about the line.

    With a command, remarks tell of values that were cut, replaced or ignored. Without one there is
    always at least one remark.
    """

    command: Command | None
    remarks: tuple[Remark, ...] = ()


def parse(line: bytes | str) -> Parsed:
    """What a line means; from the network the packet's body, from a terminal the line without CR.

    Bytes are taken as Latin-1, one character each; characters beyond that in a str become ``?``. A
    space ends a command and the rest is ignored. Repeated lines come from a cache.
    """
    text = line.decode("latin-1") if isinstance(line, bytes) else _one_byte_each(line)
    return _parse(text) if len(text) <= _CACHED_LENGTH else _read(text)


def _one_byte_each(line: str) -> str:
    if line.isascii():
        return line
    return line.encode("latin-1", "replace").decode("latin-1")


# --- the short cut -----------------------------------------------------------------------------

_RAMP: Final = r"((?:[1-9][0-9]{2}|[1-9][0-9]?(?:\.[0-9]{0,2})?|0?\.(?:[1-9][0-9]?|0[1-9]))?)"

_GOOD: Final = re.compile(
    r"[mM](-?)([0-9]{0,9})"
    r"(?:[vV]((?:[cC]?[1-9][0-9]{0,8})?)"
    rf"|[aA]{_RAMP}"
    rf"|[dD]{_RAMP}"
    r"|[lL]([01])"
    r"|[uU]([0-9]{1,2})"
    r"|[tT]([0-9]{1,9})"
    r"|[sS]([01]?)"
    r"|([fFpP])"
    r")*(?: .*)?",
    re.DOTALL,
)
"""Motion lines that leave nothing to remark: no zero speed or ramp, even one that is overwritten.

A group that repeats keeps its last match.

Each bound is the largest that needs no look at the value; beyond it the readers decide.
"""


@lru_cache(maxsize=_CACHED_LINES)
def _parse(text: str) -> Parsed:
    good = _GOOD.fullmatch(text)
    if good is None:
        return _read(text)
    minus, steps, speed, acc, dec, ramp, extra, wait, sync, unit = good.groups()
    rpm: int | Bare | None = None
    cycle_us: int | None = None
    acc100: int | Bare | None = None
    dec100: int | Bare | None = None
    if speed is not None:
        if not speed:
            rpm = BARE
        elif speed[0] in "cC":
            cycle_us = int(speed[1:])
        else:
            rpm = int(speed)
    if acc is not None:
        acc100 = _hundredths(acc)
    if dec is not None:
        dec100 = _hundredths(dec)
    return _make_parsed(
        _make_move(
            int(steps) if steps else None,
            minus == "-",
            rpm,
            cycle_us,
            acc100,
            dec100,
            None if ramp is None else ramp == "1",
            None if extra is None else int(extra),
            None if wait is None else int(wait),
            None if sync is None else sync != "0",
            None if unit is None else unit in "pP",
        )
    )


@lru_cache(maxsize=1024)
def _hundredths(number: str) -> int | Bare:
    """What ``_RAMP`` matched; five characters at most, so the nearest hundredth is exact.

    Cached because a line takes two, and the same few are used over and over.
    """
    return int(float(number) * 100 + 0.5) if number else BARE


_make_move = maker(Move)
_make_parsed = maker(Parsed)


_SIGNS: Final = re.compile(r"[+-]*")


def _move(line: Line) -> Command | None:
    """``M``, from its second character to the end."""
    opposite = line.word[1:2] == "-"
    at = 1 + opposite
    steps, after = line.number(
        at, "the number of steps", BITS_32, "the command is refused: without steps it never ends"
    )
    if steps is None and after > at:
        return None
    at = after
    return qualified(line, at, Move(steps, opposite))


def _velocity(line: Line) -> Command | None:
    if line.word in ("VD", "Vd", "vD", "vd"):
        return ShowVelocity()
    read = read_velocity(line, 1, Move())
    if read is None or not line.ends(read[1]):
        return None
    move = read[0]
    if move.rpm is None and move.cycle_us is None:  # too large, ignored: nothing is left
        return None
    return Velocity(move.rpm, move.cycle_us)


def _acceleration(line: Line) -> Command | None:
    read = line.hundredths(1, "an acceleration")
    return Acceleration(read[0]) if read and line.ends(read[1]) else None


def _deceleration(line: Line) -> Command | None:
    read = line.hundredths(1, "a deceleration")
    return Deceleration(read[0]) if read and line.ends(read[1]) else None


def _signs(line: Line) -> Command | None:
    after = end_of(_SIGNS, line.word, 0)
    if after < len(line.word):
        line.refuse(after, "+ and - alone, one pulse each")
        return None
    return SinglePulses(line.word)


def _message(line: Line) -> Command | None:
    """Text, unless it is nothing but spaces: those are padding."""
    return Message(line.text) if line.text.strip(" ") else Empty()


def _forward(line: Line) -> Command | None:
    after = end_of(DIGITS, line.text, 0)
    if not after:
        return Forward(None, line.text[1:])
    digits = line.text[:after]
    # 10**8 is a multiple of 256: the low 8 bits of any number are those of its last 8 digits.
    address = int(digits[-8:]) & 0xFF
    if len(digits.lstrip("0")) > 3 or int(digits[-8:]) > 255:
        line.remark(0, "an address of at most 255", short(digits), f"{address} is used")
    return Forward(address, line.text[after:])


def _alone(command: Command) -> Callable[[Line], Command | None]:
    """Reader of a command that is one character and takes nothing after it."""

    def read(line: Line) -> Command | None:
        return command if line.ends(1) else None

    return read


_READERS: Final[Mapping[str, Callable[[Line], Command | None]]] = {
    **dict.fromkeys("mM", _move),
    **dict.fromkeys("vV", _velocity),
    **dict.fromkeys("aA", _acceleration),
    **dict.fromkeys("dD", _deceleration),
    **dict.fromkeys("+-", _signs),
    **dict.fromkeys(" .", _message),
    **dict.fromkeys("0123456789/", _forward),
    "S": _alone(Stop(grace=False)),
    "s": _alone(Stop(grace=True)),
    "N": _alone(Next(grace=False)),
    "n": _alone(Next(grace=True)),
    "y": _alone(ReleaseSync()),
    "\x11": _alone(SoftOp(start=True)),
    "\x12": _alone(SoftOp(start=False)),
}
"""First character to reader. Case counts where only one of the two is here."""

_NOT_YET: Final[Mapping[str, str]] = {
    "XM": "a throw-away motion",
    "X": "references",
    "Q": "the queue",
    "L": "loops",
    "G": "the GAP test",
    "B": "debug",
    "CC": "show the configuration",
    "CF": "show the session defaults",
    "Z": "undo",
    "$": "a system command",
}
"""What SAC knows and this version does not: the longest beginning counts, either case."""


def _read(text: str) -> Parsed:
    """Read any line piece by piece: the slow and complete way."""
    line = Line(text)
    command: Command | None = None
    if not text:
        command = Empty()
    elif (reader := _READERS.get(text[0])) is not None:
        command = reader(line)
    else:
        _refuse_verb(line)
    return Parsed(command, tuple(line.remarks))


def _refuse_verb(line: Line) -> None:
    """Say of a line that no reader takes whether SAC, at least, would know it."""
    for start in (line.word[:2].upper(), line.word[0].upper()):
        if start in _NOT_YET:
            # With its letter, unless that is none that can be shown.
            name = line.word[:2] if start == "$" and line.word[:2].isprintable() else start
            got = f"{name} ({_NOT_YET[start]})"
            why = f"this version does not have it yet; {NOTHING}"
            line.remark(0, "a command of this version", got, why)
            return
    line.refuse(0, "y in lower case" if line.word[0] == "Y" else "a SAC command")
