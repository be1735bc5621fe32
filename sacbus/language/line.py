"""One line under a reader's eye: where words, numbers and remarks come from.

Owns ``Remark``, the reading of numbers with all that SAC cuts, caps and ignores, and the columns at
which the fields of a command stand: columns are worked out here, and only here. Imports nothing of
the project but the command types.
Source: manual, "Accel"; spec, "Motion" (numbers).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from .commands import BARE, NO_RAMP, QUEUE_LENGTH, Bare

__all__ = ["DIGITS", "NOTHING", "Line", "Remark", "end_of", "low_byte", "quoted", "short"]

NOTHING: Final = "the line does nothing"
DIGITS: Final = re.compile(r"[0-9]*")


@dataclass(frozen=True, slots=True)
class Remark:
    """What is wrong with a line and what came of it.

    column counts characters from 1; expected and got are words for a user; text is the
    consequence: what the node makes of the line now.
    """

    column: int
    expected: str
    got: str
    text: str

    def __str__(self) -> str:
        return f"column {self.column}: expected {self.expected}, got {self.got}: {self.text}"


class Line:
    """A line under a reader's eye: the command up to its first space, and the remarks so far.

    columns: from 1, of each field of the command that the line gave.
    """

    __slots__ = ("columns", "remarks", "text", "word")

    def __init__(self, text: str) -> None:
        self.text = text
        self.word = text.partition(" ")[0]
        self.remarks: list[Remark] = []
        self.columns: dict[str, int] = {}

    def stands(self, field: str, at: int) -> None:
        """Say that a field of the command is what stands at index ``at``."""
        self.columns[field] = at + 1

    def remark(self, at: int, expected: str, got: str, text: str) -> None:
        """Keep a remark on index ``at``."""
        self.remarks.append(Remark(at + 1, expected, got, text))

    def refuse(self, at: int, expected: str) -> None:
        """Say what was expected at an index where something else, or nothing, stands."""
        got = repr(self.word[at]) if at < len(self.word) else "the end of the command"
        self.remark(at, expected, got, NOTHING)

    def ends(self, at: int) -> bool:
        """Whether the command ends here; refuses it when it does not."""
        if at < len(self.word):
            self.refuse(at, "the end of the command")
        return at >= len(self.word)

    def number(self, at: int, name: str, limit: int, ignored: str) -> tuple[int | None, int]:
        """Read a whole number, digits or none at all, and the index after it.

        None without digits; None too over the limit, with a remark that ends in ``ignored``.
        """
        after = end_of(DIGITS, self.word, at)
        if after == at:
            return None, at
        # int() refuses strings of thousands of digits: look at the length first.
        digits = self.word[at:after].lstrip("0") or "0"
        if len(digits) > len(str(limit)) or int(digits) > limit:
            self.remark(at, f"{name}, at most {limit}", short(digits), ignored)
            return None, after
        return int(digits), after

    def whole(self, at: int, name: str, limit: int, ignored: str) -> tuple[int | None, int] | None:
        """As ``number``, but None, refused, without a digit."""
        value, after = self.number(at, name, limit, ignored)
        if after == at:
            self.refuse(at, name)
            return None
        return value, after

    def within(self, at: int, name: str, least: int, most: int) -> tuple[int, int] | None:
        """Read a whole number; None, refused, without a digit or out of these bounds."""
        after = end_of(DIGITS, self.word, at)
        expected = f"{name}, {least} to {most}"
        if after == at:
            self.refuse(at, expected)
            return None
        digits = self.word[at:after].lstrip("0") or "0"
        if len(digits) > len(str(most)) or not least <= int(digits) <= most:
            self.remark(at, expected, short(digits), NOTHING)
            return None
        return int(digits), after

    def position(self, at: int) -> tuple[int, int] | None:
        """Read a queue position, and the index after it; None when there is none, refused."""
        read = self.within(at, "a queue position", 1, QUEUE_LENGTH)
        if read is not None:
            self.stands("position", at)
        return read

    def hundredths(self, at: int, name: str) -> tuple[int | Bare, int] | None:
        """Read an acceleration in hundredths, cut as the device cuts it; BARE without a number.

        Two decimals below 100, none above, 999 at most; None, refused, for a lone dot.
        """
        dot = end_of(DIGITS, self.word, at)
        after = end_of(DIGITS, self.word, dot + 1) if self.word[dot : dot + 1] == "." else dot
        if after == at:
            return BARE, at
        if after == at + 1 and dot == at:
            self.refuse(after, f"the digits of {name}")
            return None
        digits, decimals = self.word[at:dot].lstrip("0") or "0", self.word[dot + 1 : after]
        got = short(self.word[at:after])
        if len(digits) > 3:
            self.remark(at, f"{name} of at most 999", got, "999 is used: no ramp")
            return NO_RAMP, after
        places = 0 if len(digits) == 3 else 2
        value100 = int(digits) * 100 + int(decimals[:places].ljust(2, "0"))
        if not value100:
            self.remark(at, f"{name} of at least 0.01", got, "it acts as 999: no ramp")
            return NO_RAMP, after
        if decimals[places:].strip("0"):
            precision = "two decimals" if places else "no decimals from 100 on"
            self.remark(at, f"{name} with {precision}", got, "the rest is cut off")
        return value100, after


def end_of(pattern: re.Pattern[str], text: str, at: int) -> int:
    """Index after what a pattern that also matches nothing matches at ``at``."""
    return pattern.match(text, at).end()  # type: ignore[union-attr]  # it always matches


def low_byte(digits: str) -> int:
    """The low 8 bits of a number of any length, of which SAC keeps no more where it has 8."""
    # 10**8 is a multiple of 256: the low 8 bits are those of the last 8 digits.
    return int(digits[-8:]) & 0xFF


def quoted(line: str) -> str:
    """How a line is quoted that people gave, who may give one of any length."""
    return repr(line) if len(line) <= 60 else f"{line[:57]!r}…"


def short(digits: str) -> str:
    """What is quoted of a number that may have thousands of digits."""
    return digits if len(digits) <= 20 else f"{digits[:17]}..."
