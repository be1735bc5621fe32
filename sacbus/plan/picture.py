"""A plan as a picture: velocity, position and pulse rate against time, the states shaded.

Owns what is drawn of a plan; how it looks is ``sacbus/drawing.py``'s. A picture of the same plan is
the same file, byte for byte. Importing this needs matplotlib, the extra ``plot``.
"""

from __future__ import annotations

from typing import BinaryIO, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import EngFormatter

from sacbus.drawing import (
    GREY,
    LINE,
    house_style,
    save_figure,
    time_unit,
)
from sacbus.drawing import SHADES as SHADES_BY_NAME
from sacbus.motion import Drive
from sacbus.plan.curve import MOVING, Curve, Mark, curve_of
from sacbus.plan.entries import PlanError
from sacbus.plan.report import seconds
from sacbus.plan.sequence import Plan, Survey

__all__ = ["SHADES", "draw_plan", "house_style", "save_figure"]

MOST_COMMANDS: Final = 5_000
"""More than a picture has columns of pixels for."""

SHADES: Final = {state: SHADES_BY_NAME[state.value] for state in MOVING}

CHARACTER: Final = 0.0072
"""Width of a character of a label, of the width of the plot."""


def draw_plan(plan: Plan, survey: Survey, file: BinaryIO, form: str) -> None:
    """Draw a plan into a file; :class:`PlanError` when it has too many commands to be seen."""
    if survey.commands > MOST_COMMANDS:
        raise PlanError(
            f"{survey.commands} commands are too many for a picture, --plot, "
            f"draw {MOST_COMMANDS} at most"
        )
    with house_style():
        curve = curve_of(plan, survey)
        save_figure(_figure(curve, plan, survey), file, form)


def _figure(curve: Curve, plan: Plan, survey: Survey) -> Figure:
    figure = Figure(figsize=(10, 6.6), layout="constrained")
    velocity, position, rate = figure.subplots(3, 1, sharex=True, height_ratios=(5, 4, 3))
    factor, unit = time_unit(curve.seconds[-1])
    times = [second * factor for second in curve.seconds]
    drive = plan.drive
    steps = [pulses / drive.m for pulses in curve.pulses]
    pulse_rates = [abs(rpm) * drive.steps_per_rev * drive.m / 60 for rpm in curve.rpm]
    for axes, values in ((velocity, curve.rpm), (position, steps), (rate, pulse_rates)):
        _shade(axes, curve, factor)
        axes.plot(times, values, color=LINE, linewidth=1.4, solid_joinstyle="miter")
        axes.axhline(0, color=GREY, linewidth=0.8, zorder=0.5)
        axes.margins(x=0)
    both_ways = min(curve.rpm) < 0 < max(curve.rpm)
    velocity.set_ylabel("velocity, RPM" + ("\nCW up, CCW down" if both_ways else ""))
    position.set_ylabel("position, full steps")
    _turns(position, drive)
    rate.set_ylabel("pulses per second")
    rate.yaxis.set_major_formatter(EngFormatter(sep=""))
    rate.set_xlabel(f"time, {unit}")
    rate.set_xlim(0, times[-1] or 1)
    if len(curve.marks) > 1:
        _name_commands(velocity, curve.marks, factor, times[-1])
    figure.align_ylabels()
    figure.suptitle(_title(plan, survey), x=0.01, ha="left", fontsize=11)
    figure.legend(
        handles=[Patch(facecolor=shade, label=state.value) for state, shade in SHADES.items()],
        loc="outside lower center",
        ncols=len(SHADES),
        frameon=False,
    )
    return figure


def _shade(axes: Axes, curve: Curve, factor: float) -> None:
    for state, spans in curve.spans.items():
        stretches = [(begin * factor, length * factor) for begin, length in spans]
        axes.broken_barh(
            stretches,
            (0, 1),
            transform=axes.get_xaxis_transform(),
            facecolor=SHADES[state],
            linewidth=0,
            zorder=0,
        )


def _turns(position: Axes, drive: Drive) -> None:
    """Turns of the motor, on the right of its position."""
    a_turn = drive.steps_per_rev
    turns = position.secondary_yaxis(
        "right",
        functions=(
            lambda steps: np.asarray(steps, float) / a_turn,
            lambda turns: np.asarray(turns, float) * a_turn,
        ),
    )
    turns.set_ylabel("turns")
    turns.spines["right"].set_visible(True)


def _name_commands(axes: Axes, marks: list[Mark], factor: float, whole: float) -> None:
    """Each command's name over its stretch: its text where that fits, else its number."""
    free = [0.0, 0.0]  # from where on each of two rows has room, of the width of the plot
    for mark in marks:
        begin, end = mark.begin * factor / whole, mark.end * factor / whole
        if mark.number > 1:
            axes.axvline(mark.begin * factor, color="#ffffff", linewidth=0.8, zorder=0.4)
        middle = (begin + end) / 2
        whole_name, number = f"{mark.number}: {mark.text}", str(mark.number)
        text = whole_name if _width(whole_name) <= end - begin else number
        half = _width(text) / 2
        for row, taken in enumerate(free):
            if middle - half >= taken:
                place = middle, 1.01 + row * 0.05
                axes.text(*place, text, transform=axes.transAxes, ha="center", fontsize=8)
                free[row] = middle + half
                break


def _width(text: str) -> float:
    """Room that a label takes, of the width of the plot."""
    return (len(text) + 1) * CHARACTER


def _title(plan: Plan, survey: Survey) -> str:
    time = "endless" if survey.duration is None else f"{seconds(survey.duration)} s"
    if survey.commands > 1:
        loops = f" in {plan.loops} loops" if plan.loops > 1 else ""
        return f"{survey.commands} commands{loops}, {time}"
    (planned,) = plan
    profile = planned.profile
    cruise = "endless" if profile.n_cruise is None else profile.n_cruise
    unit = "pulses" if planned.motion.pulses else "steps"
    shares = f"{profile.n_acc} + {cruise} + {profile.n_dec} {unit}"
    return f"{planned.line}   {shares}, {'linear' if planned.motion.linear else 'harmonic'}" + (
        "" if survey.duration is None else f", {time}"
    )
