"""The queue screen: rows to the text that ``q`` shows on a terminal, and that text back to rows.

Owns both directions, so that who prints and who reads agree; every value of a row survives. The
text is the manual's own, tab for tab: a dumb terminal with its stops 8 apart shows columns, and a
program finds its cells. Flags stand before what they are about: ``+`` (the steps are pulses) before
the direction, ``*`` (linear ramp) before the acceleration, ``s`` (held for sync) before the start
wait. ``usteps`` are the extra pulses of U, ``deltaT`` is the start wait of T in microseconds.

Decisions where the manual is silent: continuous motion has 0 steps; numbers of over seven
digits push their line one stop to the right; the reader takes any blanks for a tab, and passes over
empty lines and rules of any length.
Source: manual, "Queue" (its picture of a session) and Appendix E; spec, "Queue".
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Self

from .commands import NO_RAMP, QUEUE_LENGTH
from .commands.quantities import fixed_text
from .queue_file import BITS_32, EXTRA_MAX, QueueRow
from .session import Motion

__all__ = ["QueueScreen", "WrongScreen"]

_HEADER: Final = "Q\tSteps\t\tRPM\tCycle\tAcc\tDec\tusteps\tdeltaT"
_TITLES: Final = _HEADER.split()
_RULE: Final = "====="

_LINE_END: Final = re.compile(r"\r\n|\r|\n")
_LAST_LINE: Final = re.compile(r"Q is at ([0-9]{1,2})\b.*", re.ASCII)
_NUMBER: Final = r"([0-9]{1,10})"
_FIXED: Final = r"([0-9]{1,3}\.[0-9]{2})"
_ROW: Final = re.compile(
    rf"([0-9]{{1,2}})\s+{_NUMBER}\s+(\+?)(CC?W)\s+{_NUMBER}\s+{_NUMBER}\s+"
    rf"(\*?){_FIXED}\s+{_FIXED}\s+([0-9]{{1,3}})\s+(s\s+)?{_NUMBER}",
    re.ASCII,
)


class WrongScreen(ValueError):
    """A line of a queue screen that is no row. line: counted from 1 in the text that was read."""

    def __init__(self, line: int, got: str) -> None:
        super().__init__(
            f"this is no row of a queue screen, line {line}, expected position, steps, direction, "
            f"RPM, cycle, acc, dec, usteps and deltaT, got {got[:100]!r}; show the queue again"
        )
        self.line, self.got = line, got


@dataclass(frozen=True, slots=True)
class QueueScreen:
    """What a queue screen shows: its rows from top to bottom, and the next free position.

    Positions are 1 to 30; in debug mode the hidden ones, 0 and 31, are there as well.
    """

    rows: tuple[QueueRow, ...]
    next_free: int

    def lines(self) -> list[str]:
        """The screen line by line, without line ends."""
        return [
            _HEADER,
            _RULE,
            *map(_row_text, self.rows),
            _RULE,
            f"Q is at {self.next_free}  + pulse  * linear  s sync",
        ]

    @classmethod
    def read(cls, text: str) -> Self | None:
        """The last whole screen in what a terminal printed; None while there is none.

        Echo, prompts and whatever else was printed around it do not matter. :class:`WrongScreen`
        for a line within it that is no row.
        """
        lines = _LINE_END.split(text)
        found: tuple[int, int, int] | None = None
        top: int | None = None
        for index, line in enumerate(lines):
            last = _LAST_LINE.fullmatch(line)
            if line.split() == _TITLES:
                top = index
            elif last is not None and top is not None:
                found = top + 1, index, int(last[1])
                top = None
        if found is None:
            return None
        begin, end, next_free = found
        rows = [
            _row(lines[index], index + 1)
            for index in range(begin, end)
            if lines[index].strip(" \t=")
        ]
        return cls(tuple(rows), next_free)


def _row_text(row: QueueRow) -> str:
    motion = row.motion
    cells = (
        row.position,
        motion.steps or 0,
        f"{'+' if motion.pulses else ''}{'CW' if motion.cw else 'CCW'}",
        motion.rpm,
        motion.cycle_us,
        f"{'*' if motion.linear else ''}{fixed_text(motion.acc100)}",
        fixed_text(motion.dec100),
        motion.extra_pulses,
        f"{'s ' if motion.sync else ''}{motion.wait_us}",
    )
    return "\t".join(map(str, cells))


def _row(line: str, number: int) -> QueueRow:
    cells = _ROW.fullmatch(line.strip())
    if cells is None:
        raise WrongScreen(number, line)
    position, steps, plus, way, rpm, cycle, star, acc, dec, extra, sync, wait = cells.groups()
    motion = Motion(
        int(steps) or None,
        cw=way == "CW",
        rpm=int(rpm),
        cycle_us=int(cycle),
        acc100=int(acc.replace(".", "")),
        dec100=int(dec.replace(".", "")),
        linear=bool(star),
        extra_pulses=int(extra),
        wait_us=int(wait),
        sync=bool(sync),
        pulses=bool(plus),
    )
    if (
        int(position) > QUEUE_LENGTH + 1
        or max(motion.steps or 0, motion.rpm, motion.cycle_us, motion.wait_us) > BITS_32
        or not motion.cycle_us
        or not 1 <= motion.acc100 <= NO_RAMP
        or not 1 <= motion.dec100 <= NO_RAMP
        or motion.extra_pulses > EXTRA_MAX
    ):
        raise WrongScreen(number, line)
    return QueueRow(int(position), motion)
