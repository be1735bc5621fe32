"""A part program as a picture: the path asked for, the path done, and how far they are apart.

Owns what is drawn; how it looks is ``sacbus/drawing.py``'s. Importing this needs matplotlib, the
extra ``plot``.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import BinaryIO, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sacbus.drawing import GREY, LINE, house_style, save_figure, time_unit
from sacbus.machining.course import Course
from sacbus.machining.run import Machined

__all__ = ["draw_course"]

ASKED: Final = "#e69f00"
"""Orange of Okabe and Ito's."""


def draw_course(name: str, course: Course, machined: Machined, file: BinaryIO, form: str) -> None:
    """Draw it into a file: the first two axes that move in a plane, and the deviation below."""
    with house_style():
        save_figure(_figure(name, course, machined), file, form)


def _figure(name: str, course: Course, machined: Machined) -> Figure:
    figure = Figure(figsize=(9, 9), layout="constrained")
    plane, deviation = figure.subplots(2, 1, height_ratios=(5, 2))
    _draw_plane(plane, course, machined)
    _draw_deviation(deviation, course)
    survey = course.survey
    figure.suptitle(
        f"{name}   {survey.commands} commands, {survey.length:.1f} mm, {survey.planned:.1f} s",
        x=0.01,
        ha="left",
        fontsize=11,
    )
    return figure


def _draw_plane(plane: Axes, course: Course, machined: Machined) -> None:
    asked = np.array(course.asked.points)
    names = [axis.name for axis in course.machine.axes]
    across, along = _plane(asked)
    plane.plot(
        *_columns(asked, across, along), color=ASKED, linewidth=2.4, label="asked for", zorder=1
    )
    if machined.done is not None:
        done = _columns(np.array(machined.done.points), across, along)
        plane.plot(*done, color=LINE, linewidth=0.8, label="done", zorder=2)
    plane.set_xlabel(f"{names[across]}, mm")
    plane.set_ylabel(f"{names[along]}, mm" if along != across else "")
    plane.set_aspect("equal", adjustable="datalim")
    plane.legend(frameon=False, loc="upper right")


def _plane(points: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> tuple[int, int]:
    """The first two axes that go anywhere."""
    moving = [index for index in range(points.shape[1]) if np.ptp(points[:, index]) > 0]
    return next(combinations(moving, 2), (moving[0] if moving else 0,) * 2)


def _columns(
    points: np.ndarray[tuple[int, ...], np.dtype[np.float64]], across: int, along: int
) -> Sequence[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    if across == along:
        return points[:, across], np.zeros(len(points))
    return points[:, across], points[:, along]


def _draw_deviation(axes: Axes, course: Course) -> None:
    points = course.deviations.points
    factor, unit = time_unit(points[-1][0] if points else 1.0)
    times = [0.0, *(seconds * factor for seconds, _ in points)]
    # A block's worst, from its beginning to its end.
    axes.stairs([mm for _, mm in points], times, color=LINE, fill=True, alpha=0.3)
    axes.stairs([mm for _, mm in points], times, color=LINE)
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=0.5)
    axes.set_xlim(0, times[-1] or 1)
    axes.set_ylim(bottom=0)
    axes.set_ylabel("deviation of a block, mm")
    axes.set_xlabel(f"time of motion, {unit}")
