"""The manual's own pictures of motion, drawn from planned pulse times.

    python examples/pictures.py DIRECTORY

Writes five files into DIRECTORY: the harmonic curve from 10 to 100 RPM, its last steps before the
target, the linear ramp, the pulses of a move of (240, 200) steps as Bresenham's algorithm gives
them and as two SACs do, and how even they are all along the move. It needs matplotlib: python -m
pip install 'sacbus[plot]'. The status is 0 when all are written, 1 when a file cannot be, 2 without
matplotlib.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from sacbus.fresh import fresh_file
from sacbus.motion import TICKS_PER_US, Drive
from sacbus.plan import Planned, plan_sequence
from sacbus.toolpath import Axis, Machine, Pulses, bresenham, plan_line, side_by_side

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOTOR = Drive()
"""200 full steps a revolution, slow at 10 RPM: as it comes from the factory."""

LEAD, MINOR = "#b4520f", "#1f5fa8"
INK, PAPER = "#1b2a41", "#7a869a"


def planned(command: str) -> Planned:
    """One command, planned from rest."""
    (one,) = plan_sequence([command], MOTOR)
    return one


def pulse_times(command: str) -> list[float]:
    """When each pulse of a command is issued, and when the last period has run out; in ms."""
    profile = planned(command).profile
    assert profile.duration is not None  # it has steps, so it ends
    ticks = [*profile.pulse_times(0, profile.duration).tolist(), profile.duration]
    return [tick / TICKS_PER_US / 1_000 for tick in ticks]


def velocities(times: Sequence[float]) -> list[float]:
    """RPM of each pulse, from the time to the next one: 300 ms a step are 1 RPM."""
    return [300 / (after - before) for before, after in pairwise(times)]


def harmonic() -> Figure:
    """A step of the curve is 1 RPM, whatever time it takes: slowly off the mark, then steeper."""
    times = pulse_times("m110v100a1d999")
    figure, axes = one_plot("The harmonic curve: 10 to 100 RPM in 90 steps of 1 RPM")
    axes.step(times[:-1], velocities(times), where="post", color=INK, linewidth=1.4)
    axes.axvline(times[90], color=PAPER, linewidth=0.8, linestyle="--")
    axes.annotate(
        f"step 90, {times[90]:.0f} ms", (times[90], 12), ha="right", xytext=(times[90] - 8, 12)
    )
    axes.set(xlabel="time, ms", ylabel="velocity, RPM", ylim=(0, 110), xlim=(0, times[-1]))
    return figure


def last_steps() -> Figure:
    """Near the target a step of 1 RPM is 30 us of 3000: "virtually unnoticeable"."""
    times = pulse_times("m110v100a1d999")
    first, last = 80, 96
    figure, axes = one_plot("The last steps before the target")
    shown, rpm = times[first : last + 1], velocities(times)[first : last + 1]
    axes.step(shown, rpm, where="post", color=INK, linewidth=1.4)
    axes.plot(shown, rpm, "o", color=LEAD, markersize=4)
    for pulse in (first, 85, 89, 90):
        period = (times[pulse + 1] - times[pulse]) * 1_000
        axes.annotate(
            f"{period:.0f} µs",
            (times[pulse], rpm[pulse - first]),
            xytext=(0, 8),
            textcoords="offset points",
            ha="right",
            fontsize=8,
        )
    axes.set(xlabel="time, ms", ylabel="velocity, RPM", ylim=(89, 102))
    axes.set_xlim(times[first] - 5, times[last])
    return figure


def linear() -> Figure:
    """The ramp against the straight line that it approximates."""
    times = pulse_times("m200v100l1a10.47d999")
    figure, axes = one_plot("The linear ramp: 10.47 rad/s², 100 RPM in a second")
    axes.plot([0, 1_000], [0, 100], color=LEAD, linewidth=1, linestyle="--", label="10.47 rad/s²")
    axes.step(times[:-1], velocities(times), where="post", color=INK, linewidth=1.4, label="pulses")
    axes.set(xlabel="time, ms", ylabel="velocity, RPM", ylim=(0, 110), xlim=(0, times[-1]))
    axes.legend(loc="lower right", frameon=False)
    return figure


def two_axes() -> Figure:
    """A move of (240, 200): one clock for both axes, or each axis on its own."""
    # The minor axis has 5/6 of the steps, of the velocity (a cycle 6/5 as long) and of the
    # acceleration, so that both are at speed, and through, at the same time.
    x = pulse_times("m240vc3000l1a50d50")
    y = pulse_times("m200vc3600l1a41.66d41.66")
    tethered = [x[at] for at in bresenham(200, 240)]
    figure = new_figure(4.2)
    above, below = figure.subplots(2, 1, sharex=True)
    pairs = (
        (above, tethered, "Bresenham: the minor axis waits for the clock of the lead axis"),
        (below, y[:-1], "SAC: two clocks, two even streams"),
    )
    begin, end = x[100], x[124]
    for axes, minor, title in pairs:
        axes.set_title(title, fontsize=10, loc="left")
        shown = [time for time in minor if begin <= time <= end]
        axes.eventplot([shown, x[100:125]], colors=[MINOR, LEAD], linelengths=0.8, linewidths=1.6)
        axes.set_yticks([0, 1], ["200 steps", "240 steps"])
        axes.set_ylim(-0.5, 1.9)
        gaps = [after - before for before, after in pairwise(shown)]
        told = " or ".join(sorted({f"{gap:.1f} ms" for gap in gaps}))
        axes.text(end, 1.55, f"steps of the minor axis {told} apart", ha="right", fontsize=8)
    below.set(xlabel="time, ms", xlim=(begin - 1, end + 1))
    return figure


def jitter() -> Figure:
    """The periods of the minor axis of (240, 200), as it is planned, beside Bresenham's."""
    machine = Machine((Axis("X", 10, 100.0), Axis("Y", 11, 100.0)))
    block = plan_line(machine, (240, 200), 300)
    lead, minor = (
        Pulses(axis, run).times(0, run.end) / TICKS_PER_US / 1_000
        for axis, run in zip(machine.axes, block.runs, strict=True)
    )
    found = side_by_side(machine, block)
    assert found is not None  # two axes, and pulses enough
    figure = new_figure(4.2)
    above, below = figure.subplots(2, 1, sharex=True, sharey=True)
    tethered = lead[bresenham(200, 240)]
    for axes, times, told, title in (
        (above, tethered, found.tethered, "Bresenham: every sixth step of the lead axis is missed"),
        (below, minor, found.own, "Two SACs, as mother plans the line"),
    ):
        axes.set_title(title, fontsize=10, loc="left")
        periods = [after - before for before, after in pairwise(times)]
        axes.plot(times[1:], periods, color=MINOR, linewidth=0.8)
        axes.text(
            0.5,
            0.85,
            f"jitter at speed {100 * told.std:.1f} %, at most {100 * told.most:.1f} %",
            ha="center",
            transform=axes.transAxes,
            fontsize=8,
        )
        axes.set(ylabel="period, ms", ylim=(0, 12))
    below.set(xlabel="time, ms", xlim=(0, float(lead[-1])))
    return figure


def new_figure(height: float) -> Figure:
    """An empty figure of the width that all have; inches."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (main says so if it is not there)

    return Figure(figsize=(7, height), layout="constrained")


def one_plot(title: str) -> tuple[Figure, Axes]:
    """A figure with one plot in it."""
    figure = new_figure(3.2)
    axes = figure.subplots()
    axes.set_title(title, fontsize=10, loc="left")
    return figure, axes


PICTURES: dict[str, Callable[[], Figure]] = {
    "harmonic.svg": harmonic,
    "last-steps.svg": last_steps,
    "linear.svg": linear,
    "two-axes.svg": two_axes,
    "jitter.svg": jitter,
}


def main(argv: Sequence[str]) -> int:
    """Draw all pictures into the directory named in ``argv``; the exit status."""
    directory = Path(argv[0] if argv else ".")
    try:
        from sacbus.plan.picture import house_style, save_figure  # noqa: PLC0415
    except ImportError as fault:
        print(
            f"error: drawing needs matplotlib ({fault}), examples/pictures.py, "
            "install it: python -m pip install 'sacbus[plot]'",
            file=sys.stderr,
        )
        return 2
    for name, draw in PICTURES.items():
        place = directory / name
        try:
            with house_style(), fresh_file(place) as file:
                save_figure(draw(), file, "svg")
        except OSError as fault:
            print(
                f"error: a picture cannot be written ({fault.strerror or fault}), {place}, "
                "name a directory that is there",
                file=sys.stderr,
            )
            return 1
        print(place)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
