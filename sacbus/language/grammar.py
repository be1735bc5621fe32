"""One grammar for every line: text to a typed command, or to words about why not.

Owns what a line may look like. ``parse`` and ``parse_in`` never raise, whatever the bytes; what SAC
would silently do nothing with comes back as no command and one ``Remark`` or more.

Theory of operation. A good motion line is recognised whole by one regular expression (``_GOOD``)
and never looked at again. Everything else goes to a table by its first character (``LETTERS``) and
is read piece by piece, each piece by a reader that knows what it expects (``readers/``, a file for
each noun); columns are worked out only there. Two rules for whoever edits this file: the readers
alone define the language, ``_GOOD`` is a short cut through the part that needs no remark, and the
tests hold the two together; and alternatives of ``_GOOD`` must not overlap, or a bad line costs
exponential time.

To add a command: a type in ``commands/``, its words in ``describe.py``, a reader in ``readers/``, a
row in a table here or there, and a row in ``docs/commands.md``. The qualifiers of M are a table of
their own (``qualifiers.py``).

Decisions where the manual is silent: a qualifier given twice counts once, the last one; V without a
number is the default cycle in a motion command too; RPM has 32 bits like the cycle; S and s stop
the motor from every mode of a terminal.
Source: manual, "Functional Specifications", "Command Detail", "Configure", "System Commands",
Appendix C; spec, commands.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from .commands import (
    BARE,
    Bare,
    Command,
    Empty,
    Leave,
    Mode,
    Move,
    Next,
    ReleaseSync,
    ShowConfiguration,
    ShowSession,
    SoftOp,
    Stop,
    ToggleDebug,
    ToggleGap,
    Undo,
)
from .line import Line, Remark
from .readers.loops import read_loop, read_reference, read_set_reference
from .readers.motion import (
    read_acceleration,
    read_deceleration,
    read_move,
    read_signs,
    read_velocity_line,
)
from .readers.queue import read_edit, read_queue
from .readers.reader import Reader, alone, by_letter
from .readers.system import read_parameter, read_system
from .readers.traffic import read_forward, read_message
from .values import maker

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Parsed", "columns", "parse", "parse_in"]

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


def parse_in(mode: Mode, line: bytes | str) -> Parsed:
    """What a line means that is typed in a mode of a terminal, without its CR; as :func:`parse`.

    In a mode other than the prompt its own lines are known, X that leaves it, and S and s: motion
    may go on under it, and who watches a motor must be able to stop it. Nothing is sent on from
    there, and nothing is a message.
    """
    if mode is Mode.PROMPT:
        return parse(line)
    text = line.decode("latin-1") if isinstance(line, bytes) else _one_byte_each(line)
    return _read(text, mode)


def columns(line: bytes | str, mode: Mode = Mode.PROMPT) -> Mapping[str, int]:
    """Where each field of a line's command stands: columns from 1, by the name of the field.

    The column is that of the field's letter, or of its number where it has none of its own; of a
    field that stands twice, that of the one that counts. Fields that the line does not give, or
    whose value is ignored, have none; nothing has one on a line without a command.
    """
    text = line.decode("latin-1") if isinstance(line, bytes) else _one_byte_each(line)
    read = Line(text)
    return read.columns if _MODES[mode](read, 0) is not None else {}


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


# --- the readers -------------------------------------------------------------------------------


SHOW_LETTERS: Final = by_letter({"c": alone(ShowConfiguration()), "f": alone(ShowSession())})
"""What follows a C."""


def _read_show(line: Line, at: int) -> Command | None:
    reader = SHOW_LETTERS.get(line.word[at : at + 1])
    if reader is None:
        line.refuse(at, "C or F after C")
        return None
    return reader(line, at + 1)


LETTERS: Final[Mapping[str, Reader]] = {
    **by_letter(
        {
            "m": read_move,
            "v": read_velocity_line,
            "a": read_acceleration,
            "d": read_deceleration,
            "q": read_queue,
            "l": read_loop,
            "x": read_reference,
            "g": alone(ToggleGap()),
            "b": alone(ToggleDebug()),
            "c": _read_show,
            "z": alone(Undo()),
        }
    ),
    "S": alone(Stop(grace=False)),
    "s": alone(Stop(grace=True)),
    "N": alone(Next(grace=False)),
    "n": alone(Next(grace=True)),
    "y": alone(ReleaseSync()),
    "$": read_system,
    **dict.fromkeys("+-", read_signs),
    **dict.fromkeys(" .", read_message),
    **dict.fromkeys("0123456789/", read_forward),
    "\x11": alone(SoftOp(start=True)),
    "\x12": alone(SoftOp(start=False)),
}
"""First character of a line at the prompt to reader. Case counts where only one of the two is
here."""


def _at_prompt(line: Line, at: int) -> Command | None:
    if not line.text:
        return Empty()
    reader = LETTERS.get(line.text[0])
    if reader is None:
        line.refuse(at, "y in lower case" if line.text[0] == "Y" else "a SAC command")
        return None
    return reader(line, at + 1)


def _inside(read_entry: Reader) -> Reader:
    """Reader of the lines of a mode that is not the prompt."""

    def read(line: Line, at: int) -> Command | None:
        if not line.text.strip(" "):
            return Empty()
        match line.word[:1]:
            case "x" | "X":
                return alone(Leave())(line, at + 1)
            case "s" | "S" as letter:
                return LETTERS[letter](line, at + 1)
            case _:
                return read_entry(line, at)

    return read


_MODES: Final[Mapping[Mode, Reader]] = {
    Mode.PROMPT: _at_prompt,
    Mode.QUEUE: _inside(read_edit),
    Mode.REFERENCES: _inside(read_set_reference),
    Mode.CONFIGURE: _inside(read_parameter),
}


def _read(text: str, mode: Mode = Mode.PROMPT) -> Parsed:
    """Read any line piece by piece: the slow and complete way."""
    line = Line(text)
    command = _MODES[mode](line, 0)
    return Parsed(command, tuple(line.remarks))
