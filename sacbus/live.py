"""The live table of ``serve``: what the nodes do, redrawn in place on a terminal.

Owns the look of it. Knows nodes as far as they can be looked at; which ones, at what time and how
often is the caller's business. A leaf: nothing but the command line imports it.

Tables are drawn in pieces (``spare.py``): the process that draws has a line to keep in time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final
from typing import Protocol as Contract

import click

from sacbus.kernel import Ns
from sacbus.node import Snapshot
from sacbus.spare import Job

__all__ = ["Screen", "Seen", "table"]

_HEADINGS: Final = ("node", "state", "steps", "RPM", "current", "pending", "ACK", "NAK")
#: Width of each column; what is longer widens it while it lasts.
_WIDTHS: Final = (4, 7, 9, 7, 20, 16, 5, 4)
_GAP: Final = 2
#: The columns that give way, in this order, when the terminal is too narrow, and down to what. A
#: command cut short is still known by its beginning; a number cut short is another number.
_GIVE_WAY: Final = (5, 4)
_LEAST: Final = 8
_RIGHT: Final = frozenset((0, 2, 3, 6, 7))

#: Nodes whose state is asked for in one piece of work, at 1 to 3 us each.
_AT_A_LOOK: Final = 8

_COLOURS: Final = {"ACCEL": "green", "CRUISE": "green", "DECEL": "yellow", "SYNC": "magenta"}


class Seen(Contract):
    """What the table asks of a node (``sacbus.node.Node``)."""

    @property
    def address(self) -> int: ...

    def state(self, now: Ns) -> str: ...

    def snapshot(self, now: Ns) -> Snapshot: ...


def table(
    nodes: Sequence[Seen], now: Callable[[], Ns], columns: int, rows: int, *, colour: bool = False
) -> Job[list[str]]:
    """The nodes as lines of at most ``columns`` characters, at most ``rows`` of them (>= 3).

    When there are more nodes than lines, those that do something come first, and the last line says
    how many are not shown. Positions in full steps. A job; ``now`` is asked before each look, so
    every row is true, if not of the same instant.
    """
    room = rows - 1
    shown = nodes
    hidden = ""
    if len(nodes) > room:
        shown = yield from _busiest(nodes, now, room - 1)
        hidden = f"… and {len(nodes) - len(shown)} more nodes"
    cells: list[tuple[str, ...]] = []
    colours: list[str | None] = []
    widths = list(_WIDTHS)
    for node in shown:
        yield
        snapshot = node.snapshot(now())
        row = _cells(snapshot)
        cells.append(row)
        colours.append(_COLOURS.get(snapshot.state) if colour else None)
        for at, cell in enumerate(row):
            if len(cell) > widths[at]:
                widths[at] = len(cell)
    _narrow(widths, columns)
    lines = [_line(_HEADINGS, widths)[:columns]]
    for row, wanted in zip(cells, colours, strict=True):
        yield
        line = _line(row, widths)[:columns]
        lines.append(click.style(line, fg=wanted) if wanted else line)
    if hidden:
        lines.append(hidden[:columns])
    return lines


def _busiest(nodes: Sequence[Seen], now: Callable[[], Ns], room: int) -> Job[list[Seen]]:
    """As many as there is room for, those in motion first, in order of their addresses."""
    busy: list[Seen] = []
    idle: list[Seen] = []
    for first in range(0, len(nodes), _AT_A_LOOK):
        yield
        moment = now()
        for node in nodes[first : first + _AT_A_LOOK]:
            (idle if node.state(moment) == "STANDBY" else busy).append(node)
    yield
    return sorted((busy + idle)[:room], key=lambda node: node.address)


class Screen:
    """Lines at the bottom of a terminal that are drawn over again and again.

    Text that is to stay goes through :meth:`above`, so that the two do not mix.
    """

    def __init__(self) -> None:
        self._drawn: list[str] = []

    def draw(self, lines: Sequence[str], columns: int) -> str:
        """What to write to see ``lines`` in place of those of the last time.

        ``columns`` is how wide the terminal is now. One that has been made narrower has wrapped the
        lines of the last time, which then take more of its rows.
        """
        if list(lines) == self._drawn:
            return ""
        text = self._erase(columns) + "".join(f"{line}\n" for line in lines)
        self._drawn = list(lines)
        return text

    def above(self, text: str, columns: int) -> str:
        """What to write to have ``text`` stay above the lines; ``columns`` as in :meth:`draw`."""
        again = "".join(f"{line}\n" for line in self._drawn)
        return f"{self._erase(columns)}{text}\n{again}"

    def _erase(self, columns: int) -> str:
        # Up to the first drawn line, then clear to the end of the screen.
        # From the line's start: the terminal may have echoed a key, as it does Ctrl-C.
        rows = sum(max(-(-len(click.unstyle(line)) // columns), 1) for line in self._drawn)
        return f"\r\x1b[{rows}A\x1b[J" if rows else ""


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


def _narrow(widths: list[int], columns: int) -> None:
    """Have the whole fit into ``columns`` characters if it can."""
    excess = sum(widths) + _GAP * (len(widths) - 1) - columns
    for at in _GIVE_WAY:
        given = min(max(excess, 0), widths[at] - _LEAST)
        widths[at] -= given
        excess -= given


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
