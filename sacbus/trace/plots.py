"""A recording as pictures: axes against time, and the path of two axes against the straight line.

Owns what is drawn where; what a picture is drawn through is ``strips.py``'s and ``paths.py``'s, and
its look ``sacbus/drawing.py``'s. The same recording gives the same file, byte for byte. Importing
this needs matplotlib, the extra ``plot``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import BinaryIO, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sacbus.drawing import GREY, LINE, SHADES, house_style, save_figure, time_unit
from sacbus.kernel import SECOND, Ns
from sacbus.picture_format import PictureError
from sacbus.trace.paths import Path, paths
from sacbus.trace.reading import Recording
from sacbus.trace.strips import MOST_NODES, Strips, Talk, curve, stretches, strips_of
from sacbus.trace.track import Track

__all__ = ["draw_axes", "draw_path"]

POSITION: Final = "#1f5fa8"
HIT: Final = "#c8321e"

#: Rows of talkers; the nodes share one where there are more.
MOST_TALKERS: Final = 14

#: Points of a motion's path.
MOST_POINTS: Final = 4_000

#: Inches: the width of a picture, and the height of its parts.
WIDTH: Final = 10.0
AN_AXIS: Final = 1.7
A_TALKER: Final = 0.22
AROUND: Final = 1.2


def draw_axes(
    recording: Recording,
    file: BinaryIO,
    form: str,
    *,
    since: Ns | None = None,
    flags: Sequence[Ns] = (),
    nodes: Sequence[int] = (),
) -> None:
    """Velocity and position of each node that moved, its states shaded; below who talked when.

    At most :data:`MOST_NODES` are drawn; or ``nodes``, moved or not. ``since``: what is time 0, and
    where the picture begins, or else with the first record. ``flags``: instants at which a line is
    drawn across. :class:`PictureError` for nodes that are not in it, or too many.
    """
    _look_for(recording, nodes)
    strips = strips_of(recording, since, nodes)
    with house_style():
        save_figure(_axes(recording, strips, flags), file, form)


def draw_path(recording: Recording, file: BinaryIO, form: str, nodes: tuple[int, int]) -> None:
    """Where two nodes were, as x and y, and how far off the straight line of each motion.

    :class:`PictureError` for nodes that are not on one bus of it, or that did not move.
    """
    x, y = _pair(recording, nodes)
    found = [_drawn(one) for one in paths((x, y), 0, recording.end + 1)]
    if not found:
        raise PictureError(
            f"{recording.name}: neither of nodes {nodes[0]} and {nodes[1]} moved, "
            "there is no path to draw"
        )
    with house_style():
        save_figure(_path(found, nodes), file, form)


# ---- axes against time ----


def _look_for(recording: Recording, nodes: Sequence[int]) -> None:
    """:class:`PictureError` for nodes that are not there, or too many of them."""
    there = {node.address for node in recording.nodes}
    missing = [node for node in nodes if node not in there]
    if missing:
        raise PictureError(
            f"{recording.name}: expected nodes that are in it, got {missing[0]}, name others"
        )
    if len(nodes) > MOST_NODES:
        raise PictureError(
            f"{recording.name}: expected {MOST_NODES} nodes at most in a picture, "
            f"got {len(nodes)}, name fewer"
        )


def _axes(recording: Recording, strips: Strips, flags: Sequence[Ns]) -> Figure:
    talkers = _rows(recording, strips)
    height = max(len(talkers), 1) * A_TALKER + 0.4
    figure = Figure(
        figsize=(WIDTH, AROUND + len(strips.tracks) * AN_AXIS + height), layout="constrained"
    )
    *rows, below = figure.subplots(
        len(strips.tracks) + 1,
        1,
        sharex=True,
        squeeze=False,
        height_ratios=[AN_AXIS] * len(strips.tracks) + [height],
    )[:, 0]
    whole = (strips.last - strips.first) / SECOND
    factor, unit = time_unit(whole)
    scale = factor / SECOND
    for axes, (node, track) in zip(rows, strips.tracks.items(), strict=True):
        _axis(axes, _name(recording, *node), track, strips, scale)
    _talk(below, talkers, strips, scale)
    for axes in (*rows, below):
        for flag in flags:
            axes.axvline((flag - strips.first) * scale, color=HIT, linewidth=1.0, linestyle=":")
    below.set_xlim(0, whole * factor)
    below.set_xlabel(f"time, {unit}")
    figure.align_ylabels()
    figure.suptitle(_title(recording, strips, whole), x=0.01, ha="left", fontsize=11)
    handles: list[Patch | Line2D] = []
    if strips.tracks:
        handles += [
            Line2D([], [], color=LINE, label="velocity"),
            Line2D([], [], color=POSITION, linestyle="--", label="position"),
            *(Patch(facecolor=shade, label=state) for state, shade in SHADES.items()),
        ]
    if any(talk.hit.starts for talk in talkers.values()):
        handles.append(Patch(facecolor=HIT, label="collided, damaged or missed"))
    if flags:
        handles.append(Line2D([], [], color=HIT, linestyle=":", label="not as expected"))
    if handles:
        figure.legend(
            handles=handles, loc="outside lower center", ncols=len(handles), frameon=False
        )
    return figure


def _axis(axes: Axes, name: str, track: Track, strips: Strips, scale: float) -> None:
    first, last = strips.first, strips.last
    for state, spans in stretches(track, first, last).items():
        if state in SHADES:
            axes.broken_barh(
                [((begin - first) * scale, length * scale) for begin, length in spans],
                (0, 1),
                transform=axes.get_xaxis_transform(),
                facecolor=SHADES[state],
                linewidth=0,
                zorder=0,
            )
    times, rpm, steps = curve(track, first, last)
    seconds = (times - first) * scale
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=0.5)
    axes.plot(seconds, rpm, color=LINE, linewidth=1.3, solid_joinstyle="miter")
    axes.set_ylabel("RPM")
    axes.set_title(name, loc="left", fontsize=9, pad=3)
    position = axes.twinx()
    position.plot(seconds, steps, color=POSITION, linewidth=1.1, linestyle="--")
    position.set_ylabel("full steps", color=POSITION)
    position.tick_params(axis="y", colors=POSITION)
    position.spines["right"].set_visible(True)
    # Whole figures: a position of 100000 is not "0.0 + 1e5".
    position.ticklabel_format(useOffset=False, style="plain", axis="y")


def _talk(axes: Axes, talkers: dict[str, Talk], strips: Strips, scale: float) -> None:
    """A row for each talker, a tick for each transmission; what was hit lies above the rest."""
    for row, talk in enumerate(talkers.values()):
        for ticks, colour in ((talk.whole, LINE), (talk.hit, HIT)):
            if ticks.starts:
                axes.broken_barh(
                    [
                        ((start - strips.first) * scale, length * scale)
                        for start, length in ticks.spread(strips.first, strips.last)
                    ],
                    (row - 0.35, 0.7),
                    facecolor=colour,
                    edgecolor=colour,
                    linewidth=0.5,
                )
    axes.set_yticks(range(len(talkers)), list(talkers), fontsize=8)
    axes.set_ylim(max(len(talkers), 1) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.set_title("on the line" if talkers else "nobody talked", loc="left", fontsize=9, pad=3)


def _rows(recording: Recording, strips: Strips) -> dict[str, Talk]:
    """The talkers by what they are called; many nodes are one row together."""
    rows: dict[str, Talk] = {}
    several = len(strips.talks) > MOST_TALKERS
    for (bus, who), talk in strips.talks.items():
        if several and isinstance(who, int):
            together = rows.setdefault("nodes", Talk())
            for ticks, more in ((together.whole, talk.whole), (together.hit, talk.hit)):
                ticks.starts.extend(more.starts)
                ticks.ends.extend(more.ends)
        else:
            rows[_name(recording, bus, who)] = talk
    return rows


def _name(recording: Recording, bus: int, who: int | str) -> str:
    name = f"node {who}" if isinstance(who, int) else who
    return name if len(recording.buses) == 1 else f"{recording.buses[bus].name}: {name}"


def _title(recording: Recording, strips: Strips, whole: float) -> str:
    nodes = len(recording.nodes)
    drawn = len(strips.tracks)
    some = f", {drawn} drawn" if strips.moved != drawn else ""
    moved = f"{strips.moved} moved{some}" if strips.moved else "none moved"
    return f"{nodes} node{'s' if nodes != 1 else ''}, {moved}, {whole:.6f} s"


# ---- the path of two axes ----


def _pair(recording: Recording, nodes: tuple[int, int]) -> tuple[Track, Track]:
    tracks = recording.tracks
    for bus in recording.buses:
        x, y = (tracks.get((bus.number, node)) for node in nodes)
        if x is not None and y is not None:
            return x, y
    known = ", ".join(str(node.address) for node in recording.nodes[:20])
    raise PictureError(
        f"{recording.name}: expected nodes {nodes[0]} and {nodes[1]} on one bus of it, "
        f"got {known or 'none'}, name two of them"
    )


def _drawn(path: Path) -> Path:
    """Of a long motion as many points as can be seen, the worst among them."""
    worst = int(np.abs(path.away).argmax())
    chosen = np.unique(
        [*np.linspace(0, path.times.size - 1, MOST_POINTS).round().astype(int), worst]
    )
    return Path(path.times[chosen], path.points[:, chosen], path.away[chosen])


def _path(found: list[Path], nodes: tuple[int, int]) -> Figure:
    figure = Figure(figsize=(WIDTH, 7.6), layout="constrained")
    plane, off = figure.subplots(2, 1, height_ratios=(5, 2))
    first = int(found[0].times[0])
    factor, unit = time_unit((int(found[-1].times[-1]) - first) / SECOND)
    for path in found:
        x, y = path.points
        plane.plot(x[[0, -1]], y[[0, -1]], color=HIT, linewidth=1.0, linestyle="--", zorder=1)
        plane.plot(x, y, color=LINE, linewidth=1.3, zorder=2)
        plane.plot(x[[0, -1]], y[[0, -1]], "o", color=LINE, markersize=3.5, zorder=3)
        off.plot((path.times - first) * factor / SECOND, path.away, color=LINE, linewidth=1.1)
    worst, when = max(path.worst for path in found)
    number = next(one for one in found if one.worst == (worst, when))
    place = int(np.abs(number.away).argmax())
    plane.plot(*number.points[:, place], "o", color=HIT, markersize=6, fillstyle="none", zorder=4)
    off.plot(
        (when - first) * factor / SECOND,
        number.away[place],
        "o",
        color=HIT,
        markersize=6,
        fillstyle="none",
    )
    plane.set(xlabel=f"node {nodes[0]}, full steps", ylabel=f"node {nodes[1]}, full steps")
    plane.set_aspect("equal", adjustable="datalim")
    plane.ticklabel_format(useOffset=False, style="plain")
    plane.grid(visible=True, color="#e4e8ee", linewidth=0.6)
    plane.set_axisbelow(True)
    off.axhline(0, color=HIT, linewidth=1.0, linestyle="--", zorder=0.5)
    off.set(xlabel=f"time from the first pulse, {unit}", ylabel="off the line,\nfull steps")
    off.margins(x=0.01)
    motions = f"{len(found)} motions" if len(found) > 1 else "one motion"
    after = (when - first) / SECOND
    figure.suptitle(
        f"nodes {nodes[0]} and {nodes[1]}, {motions}: at most {worst:.3f} full steps off the "
        f"straight line, {after:.6f} s after the first pulse",
        x=0.01,
        ha="left",
        fontsize=11,
    )
    figure.legend(
        handles=[
            Line2D([], [], color=LINE, label="path"),
            Line2D([], [], color=HIT, linestyle="--", label="straight line"),
            Line2D([], [], color=HIT, marker="o", fillstyle="none", linestyle="", label="worst"),
        ],
        loc="outside lower center",
        ncols=3,
        frameon=False,
    )
    return figure
