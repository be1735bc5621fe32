"""A few steps on the lines as a picture, to be held beside the announcement's own drawings.

Owns what is drawn where; which steps is ``excerpt.py``'s, the look ``sacbus/drawing.py``'s. Times
between edges are to scale as long as they are short; longer ones are cut, which is shown. The same
steps give the same file, byte for byte. Importing this needs matplotlib, the extra ``plot``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np
from matplotlib.figure import Figure

from sacbus.drawing import GREY, LINE, house_style, save_figure
from sacbus.simad.edges import DIR, HIGH
from sacbus.simad.excerpt import Excerpt

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sacbus.simad.steps import Times

    Floats = NDArray[np.float64]

__all__ = ["draw_lines"]

CLOCKWISE: Final = "#1f5fa8"
OTHER_WAY: Final = "#c8321e"

#: us that are drawn of a longer time without an edge, and before the first edge and after the last.
LONGEST: Final = 6.0
AROUND: Final = 2.0

#: How high a line is drawn of the 1 that it has.
HEIGHT: Final = 0.55


class _Scale:
    """Instants as places on the picture: us to scale, but for times that are cut."""

    def __init__(self, instants: Times) -> None:
        self._instants = np.unique(instants)
        gaps = np.diff(self._instants) / 1_000
        self._places = np.concatenate(([0.0], np.cumsum(np.minimum(gaps, LONGEST))))
        #: The middles of the times that are cut.
        cut = np.flatnonzero(gaps > LONGEST)
        self.cuts = (self._places[cut] + self._places[cut + 1]) / 2
        self.width = float(self._places[-1])

    def places(self, instants: Times) -> Floats:
        """Where instants are that there are edges, or steps due, at."""
        return np.asarray(np.interp(instants, self._instants, self._places))


def draw_lines(found: Excerpt, names: Sequence[str], file: BinaryIO, form: str) -> None:
    """DIR and the lines of all axes; ``names``: of the axes; ``form``: png or svg."""
    with house_style():
        save_figure(_Drawing(found, names).figure, file, form)


class _Drawing:
    """The picture while it is drawn: a row a line, DIR's on top, low levels at whole numbers."""

    def __init__(self, found: Excerpt, names: Sequence[str]) -> None:
        self._found = found
        self._names = ("DIR", *names)
        edges = found.edges
        self._scale = _Scale(np.concatenate((edges.times, found.due.times, found.falls)))
        width = min(max(7.5, 2.0 + 0.22 * (self._scale.width + 2 * AROUND)), 16.0)
        height = 1.4 + 0.62 * len(self._names)
        self.figure = Figure(figsize=(width, height), layout="constrained")
        self._axes = self.figure.subplots()
        for line in range(len(self._names)):
            self._line(line)
        self._turns()
        self._steps()
        self._cuts()
        self._frame()

    def _row(self, line: int) -> float:
        return float(len(self._names) - 1 - line)

    def _line(self, line: int) -> None:
        """A line's level, from before the first edge until after the last."""
        edges = self._found.edges
        times, levels = edges.of_line(line)
        places = [-AROUND, *self._scale.places(times), self._scale.width + AROUND]
        shown = np.array([edges.direction if line == DIR else HIGH, *levels])
        self._axes.step(
            places,
            self._row(line) + HEIGHT * np.append(shown, shown[-1]),
            where="post",
            color=LINE,
            linewidth=1.4,
            solid_joinstyle="miter",
            zorder=3,
        )

    def _turns(self) -> None:
        """How long DIR has been set when the next step falls."""
        turns, _ = self._found.edges.of_line(DIR)
        falls = np.sort(self._found.falls)
        for turn in turns.tolist():
            later = falls[falls > turn]
            if later.size:
                begin, end = self._scale.places(np.array([turn, later[0]]))
                height = self._row(DIR) + HEIGHT / 2
                arrow = {"arrowstyle": "<->", "color": GREY, "linewidth": 0.8}
                self._axes.annotate("", (end, height), (begin, height), arrowprops=arrow)
                told = f"{(int(later[0]) - turn) / 1_000:g} µs"
                self._word((begin + end) / 2, height + 0.04, told, GREY)

    def _steps(self) -> None:
        """Which way each step goes, and from where it was moved."""
        found = self._found
        falls, dues = self._scale.places(found.falls), self._scale.places(found.due.times)
        for fall, due, axis, way in zip(
            falls.tolist(),
            dues.tolist(),
            found.due.axes.tolist(),
            found.due.directions.tolist(),
            strict=True,
        ):
            row = self._row(axis + 1)
            colour = CLOCKWISE if way > 0 else OTHER_WAY
            self._word(fall, row + HEIGHT + 0.05, "CW" if way > 0 else "CCW", colour)
            self._axes.plot(fall, row + HEIGHT / 2, "v", color=colour, markersize=4, zorder=4)
            if fall > due:
                height = row - 0.12
                self._axes.plot([due, fall], [height] * 2, ":", color=colour, linewidth=1.2)
                self._axes.plot(due, height, "|", color=colour, markersize=7)

    def _word(self, place: float, height: float, told: str, colour: str) -> None:
        self._axes.text(
            place, height, told, ha="center", va="bottom", fontsize=7, color=colour, zorder=6
        )

    def _cuts(self) -> None:
        """Where time is cut, every line is."""
        for cut in self._scale.cuts.tolist():
            self._axes.axvspan(cut - 0.3, cut + 0.3, color="white", zorder=4)
            for line in range(len(self._names)):
                middle = self._row(line) + HEIGHT / 2
                self._axes.text(cut, middle, "≈", ha="center", va="center", color=GREY, zorder=5)

    def _frame(self) -> None:
        found, axes, last = self._found, self._axes, len(self._names) - 1
        axes.set_yticks([row + HEIGHT / 2 for row in range(last + 1)], self._names[::-1])
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(-0.35, last + 1)
        axes.set_xlim(-AROUND, self._scale.width + AROUND)
        begin = int(found.falls.min())
        instants = np.unique(found.falls)
        told = [f"{(one - begin) / 1_000:g}" for one in instants.tolist()]
        axes.set_xticks(self._scale.places(instants), told, rotation=90, fontsize=8)
        axes.set_xlabel("µs after the first fall; ≈ time that is cut; … from when a step was due")
        axes.spines["left"].set_visible(False)
        steps = f"{found.due.count} step{'s' if found.due.count > 1 else ''}"
        self.figure.suptitle(
            f"{steps}, number {found.number} on, from {begin / 1e9:.9f} s",
            x=0.01,
            ha="left",
            fontsize=11,
        )
