"""Queue files: the companion's CSV, one row a queue position, read and written one to one.

Owns the two forms of a row and what may stand in each field. A row is a position and a ``Motion``,
nothing more. Imports nothing of the project but this room; opens no file: lines come in, lines go
out, one at a time, so that a file may be of any length.

The present form has 12 fields: Q, steps, direction (0 CW, 1 CCW), full steps (1) or pulses (0),
RPM, cycle, linear, acc, dec, extra pulses, sync, start wait. The older one has 14: index, 1, Q,
steps, direction (1 CW, 0 CCW: the other way round), pulses (1) or full steps (0), then as above.
The companion puts blanks around its commas and ends lines with CR LF; neither is asked for.

Decisions: the first row decides the form of the file, since the forms disagree about direction; a
cycle that disagrees with its RPM wins; a cycle of 0 is the default cycle; 0 steps are continuous,
as in a command; what a command would ignore as too large is refused here, with its place.
Source: manual, Appendix E; spec, "Queue".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from .commands import BARE, Acceleration, Move
from .line import Line, Remark, short
from .session import Defaults, Motion

__all__ = ["Form", "QueueRow", "ReadRow", "WrongRow", "read_rows", "write_rows"]

BITS_32: Final = 2**32 - 1
EXTRA_MAX: Final = 255
_FACTORY: Final = Defaults()


class Form(Enum):
    """Which of the companion's two forms a file has; the value is its number of fields."""

    PRESENT = 12
    OLDER = 14


class WrongRow(ValueError):
    """A line that is no row of a queue file.

    name: the file's, as the caller gave it. line and column count from 1; expected and got are
    words for people.
    """

    def __init__(self, name: str, line: int, column: int, expected: str, got: str) -> None:
        super().__init__(
            f"this is no row of a queue file, {name} line {line} column {column}, "
            f"expected {expected}, got {got}"
        )
        self.name, self.line, self.column = name, line, column
        self.expected, self.got = expected, got


@dataclass(frozen=True, slots=True)
class QueueRow:
    """One queue position and the command in it.

    position: from 1; 30 at most on a device, more in a file that is streamed. The motion's
    direction is the true one; ``steps`` None stands as 0.
    """

    position: int
    motion: Motion

    def move(self, defaults: Defaults = _FACTORY) -> Move:
        """The command that puts this motion into a queue, whatever the session's defaults are.

        Its velocity in RPM where that gives this very cycle, as ``v100`` gives 3000 us. Extra
        pulses, wait and sync start clear with every command and are left out when they are.
        """
        motion = self.motion
        by_rpm = defaults.says(motion.rpm, motion.cycle_us)
        return Move(
            motion.steps,
            opposite=motion.cw is not defaults.cw,
            rpm=motion.rpm if by_rpm else None,
            cycle_us=None if by_rpm else motion.cycle_us,
            acc100=motion.acc100,
            dec100=motion.dec100,
            linear=motion.linear,
            extra_pulses=motion.extra_pulses or None,
            wait_us=motion.wait_us or None,
            sync=motion.sync or None,
            pulses=motion.pulses,
        )

    def text(self, form: Form = Form.PRESENT, index: int | None = None) -> str:
        """The row as the companion writes it, without the end of the line.

        index: the first field of the older form, by default the position.
        """
        motion = self.motion
        if form is Form.PRESENT:
            begin = [self.position, motion.steps or 0, not motion.cw, not motion.pulses]
        else:
            first = self.position if index is None else index
            begin = [first, 1, self.position, motion.steps or 0, motion.cw, motion.pulses]
        fields = [
            *(str(int(one)) for one in (*begin, motion.rpm, motion.cycle_us, motion.linear)),
            # The number as a command prints it: 1, 10.47, .5, 999.
            *(Acceleration(one).text()[1:] for one in (motion.acc100, motion.dec100)),
            *(str(int(one)) for one in (motion.extra_pulses, motion.sync, motion.wait_us)),
        ]
        return f" {' , '.join(fields)} "


@dataclass(frozen=True, slots=True)
class ReadRow:
    """A row as it stood in a file: on which line, and what was not taken as written."""

    row: QueueRow
    line: int
    remarks: tuple[Remark, ...] = ()


def write_rows(rows: Iterable[QueueRow], form: Form = Form.PRESENT) -> Iterator[str]:
    """The lines of a queue file, ended with CR LF: write them without translating newlines."""
    for index, row in enumerate(rows, start=1):
        yield row.text(form, index) + "\r\n"


def read_rows(
    lines: Iterable[str], name: str = "the queue file", defaults: Defaults = _FACTORY
) -> Iterator[ReadRow]:
    """The rows of a queue file of either form, one by one; empty lines are passed over.

    The defaults' sprf is what RPM and cycle are compared by. :class:`WrongRow` at the first line
    that is no row; what was cut or replaced in a row is among its remarks.
    """
    form: Form | None = None
    for number, text in enumerate(lines, start=1):
        if not text.strip():
            continue
        fields = _Fields(text.removeprefix("\ufeff"), name, number)
        form = fields.form(form)
        yield ReadRow(fields.row(form, defaults), number, tuple(fields.remarks))


class _Fields:
    """The fields of a line under a reader's eye, taken one after the other."""

    __slots__ = ("_at", "_column", "_fields", "_line", "_name", "remarks")

    def __init__(self, text: str, name: str, line: int) -> None:
        self._name = name
        self._line = line
        self._fields: list[tuple[int, str]] = []
        self._at = 0
        self._column = 1
        self.remarks: list[Remark] = []
        at = 1
        for field in text.split(","):
            word = field.strip()
            self._fields.append((at + (field.index(word) if word else 0), word))
            at += len(field) + 1

    def form(self, known: Form | None) -> Form:
        """The form that the number of fields tells; that of the rows before, if there were any."""
        count = len(self._fields)
        if known is None and count in (Form.PRESENT.value, Form.OLDER.value):
            return Form(count)
        if known is not None and count == known.value:
            return known
        expected = "12 or 14 fields" if known is None else f"{known.value} fields as before"
        wanted = known.value if known else Form.PRESENT.value
        # The first field too many, or the last there is.
        self._column = self._fields[min(wanted, count - 1)][0]
        raise self._wrong(expected, f"{count}")

    def row(self, form: Form, defaults: Defaults) -> QueueRow:
        """The row; every field is taken in the order of the file."""
        if form is Form.OLDER:
            self._whole("the index")
            self._whole("1, as in every file of 14 fields that is known", 1, 1)
        position = self._whole("the queue position", 1)
        steps = self._whole("the steps")
        if form is Form.PRESENT:
            cw = not self._flag("0 (CW) or 1 (CCW)")
            pulses = not self._flag("1 (full steps) or 0 (pulses)")
        else:
            cw = self._flag("1 (CW) or 0 (CCW)")
            pulses = self._flag("0 (full steps) or 1 (pulses)")
        rpm, cycle_us = self._velocity(defaults)
        linear = self._flag("0 (harmonic) or 1 (linear)")
        motion = Motion(
            steps or None,
            cw,
            rpm,
            cycle_us,
            self._hundredths("an acceleration"),
            self._hundredths("a deceleration"),
            linear,
            self._whole("the extra pulses", 0, EXTRA_MAX),
            sync=self._flag("0 (no sync) or 1 (sync)"),
            wait_us=self._whole("the start wait in microseconds"),
            pulses=pulses,
        )
        return QueueRow(position, motion)

    def _velocity(self, defaults: Defaults) -> tuple[int, int]:
        """RPM and cycle; they go together, or the cycle counts and the row has a remark."""
        rpm = self._whole("the velocity in RPM")
        column = self._column
        cycle_us = self._whole("the cycle in microseconds")
        if not cycle_us:
            cycle_us = defaults.cycle_us
            self._remark("a cycle of at least 1", "0", f"the default of {cycle_us} is used")
        real = defaults.rpm_of(cycle_us)
        if rpm not in (real, 0) and defaults.cycle_of(rpm) == cycle_us:
            return rpm, cycle_us  # above some 550 RPM several RPM have one cycle
        if rpm != real:
            self._column = column
            expected = f"{real}, the RPM of a cycle of {cycle_us}"
            self._remark(expected, str(rpm), "the cycle counts")
        return real, cycle_us

    def _next(self) -> str:
        self._column, word = self._fields[self._at]
        self._at += 1
        return word

    def _flag(self, expected: str) -> bool:
        word = self._next()
        if word not in ("0", "1"):
            raise self._wrong(expected, _shown(word))
        return word == "1"

    def _whole(self, name: str, least: int = 0, most: int = BITS_32) -> int:
        word = self._next()
        digits = word.lstrip("0") or "0"
        # int() refuses strings of thousands of digits: look at the length first.
        if word.isascii() and word.isdecimal() and len(digits) <= len(str(most)):
            value = int(digits)
            if least <= value <= most:
                return value
        limits = "" if least == most else f", {least} to {most}"
        raise self._wrong(f"{name}{limits}", _shown(word))

    def _hundredths(self, name: str) -> int:
        word = self._next()
        line = Line(word)
        read = line.hundredths(0, name)
        if read is None or read[0] is BARE or read[1] < len(word):
            raise self._wrong(f"{name} such as 1 or 10.47", _shown(word))
        for remark in line.remarks:
            self._remark(remark.expected, remark.got, remark.text)
        return read[0]

    def _remark(self, expected: str, got: str, text: str) -> None:
        self.remarks.append(Remark(self._column, expected, got, text))

    def _wrong(self, expected: str, got: str) -> WrongRow:
        return WrongRow(self._name, self._line, self._column, expected, got)


def _shown(word: str) -> str:
    return repr(short(word)) if word else "nothing"
