"""The live table of ``serve``: what the nodes do, redrawn in place on a terminal.

Owns the look of it. Knows snapshots and counts only; where they come from, and how often, is the
caller's business. A leaf: nothing but the command line imports it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import click

from sacbus.node import Snapshot

__all__ = ["Screen", "table"]

_HEADINGS: Final = ("node", "state", "steps", "RPM", "current", "pending", "ACK", "NAK")
#: Width of each column; what is longer widens it while it lasts.
_WIDTHS: Final = (4, 7, 9, 7, 20, 16, 5, 4)
_GAP: Final = 2
#: The columns that give way, in this order, when the terminal is too narrow, and down to what. A
#: command cut short is still known by its beginning; a number cut short is another number.
_GIVE_WAY: Final = (5, 4)
_LEAST: Final = 8
_RIGHT: Final = frozenset((0, 2, 3, 6, 7))

_COLOURS: Final = {"ACCEL": "green", "CRUISE": "green", "DECEL": "yellow", "SYNC": "magenta"}


def table(
    snapshots: Sequence[Snapshot], columns: int, rows: int, *, colour: bool = False
) -> list[str]:
    """The nodes as lines of at most ``columns`` characters, at most ``rows`` of them (>= 3).

    When there are more nodes than lines, those that do something come first, and the last line says
    how many are not shown. Positions in full steps.
    """
    room = rows - 1
    shown = list(snapshots)
    hidden = ""
    if len(shown) > room:
        shown.sort(key=lambda snapshot: snapshot.state == "STANDBY")
        left_out = len(shown) - (room - 1)
        shown = sorted(shown[: room - 1], key=lambda snapshot: snapshot.address)
        hidden = f"… and {left_out} more nodes"
    cells = [_cells(snapshot) for snapshot in shown]
    widths = _widths(cells, columns)
    lines = [_line(_HEADINGS, widths)[:columns]]
    for snapshot, row in zip(shown, cells, strict=True):
        line = _line(row, widths)[:columns]
        wanted = _COLOURS.get(snapshot.state) if colour else None
        lines.append(click.style(line, fg=wanted) if wanted else line)
    if hidden:
        lines.append(hidden[:columns])
    return lines


class Screen:
    """Lines at the bottom of a terminal that are drawn over again and again.

    Text that is to stay goes through :meth:`above`, so that the two do not mix.
    """

    def __init__(self) -> None:
        self._drawn: list[str] = []

    def draw(self, lines: Sequence[str]) -> str:
        """What to write to the terminal to see ``lines`` in place of those of the last time."""
        if list(lines) == self._drawn:
            return ""
        text = self._erase() + "".join(f"{line}\n" for line in lines)
        self._drawn = list(lines)
        return text

    def above(self, text: str) -> str:
        """What to write to have ``text`` stay above the lines."""
        kept = self._drawn
        erased = self._erase()
        self._drawn = kept
        return f"{erased}{text}\n" + "".join(f"{line}\n" for line in kept)

    def _erase(self) -> str:
        # Up to the first drawn line, then clear to the end of the screen.
        # From the line's start: the terminal may have echoed a key, as it does Ctrl-C.
        return f"\r\x1b[{len(self._drawn)}A\x1b[J" if self._drawn else ""


def _cells(snapshot: Snapshot) -> tuple[str, ...]:
    pending = snapshot.pending
    waiting = f"{len(pending)}: {pending[0]}" if pending else ""
    return (
        str(snapshot.address),
        snapshot.state,
        _steps(snapshot),
        f"{snapshot.rpm:.1f}",
        snapshot.current,
        waiting,
        str(snapshot.counters.get("ack", 0)),
        str(snapshot.counters.get("nak", 0)),
    )


def _widths(cells: Sequence[Sequence[str]], columns: int) -> list[int]:
    """The columns' widths, such that the whole fits into ``columns`` characters if it can."""
    widths = [
        max(width, *(len(row[at]) for row in cells)) if cells else width
        for at, width in enumerate(_WIDTHS)
    ]
    excess = sum(widths) + _GAP * (len(widths) - 1) - columns
    for at in _GIVE_WAY:
        given = min(max(excess, 0), widths[at] - _LEAST)
        widths[at] -= given
        excess -= given
    return widths


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    return (
        (" " * _GAP)
        .join(
            cell.rjust(width) if at in _RIGHT else _cut(cell, width).ljust(width)
            for at, (cell, width) in enumerate(zip(cells, widths, strict=True))
        )
        .rstrip()
    )


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 1]}…"


def _steps(snapshot: Snapshot) -> str:
    """Full steps; fractions of one as exactly as microsteps make them."""
    return f"{snapshot.position_steps:.7f}".rstrip("0").rstrip(".")
