"""The look of pictures: what is drawn by any part of sacbus looks alike, and the same every time.

Owns the colours, the settings of matplotlib whatever the user's own are, and that no
date or version gets into a file. Importing this needs matplotlib, the extra ``plot``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, Final

import matplotlib as mpl
from matplotlib.figure import Figure

__all__ = [
    "GREY",
    "LINE",
    "SHADES",
    "house_style",
    "save_figure",
    "time_unit",
]

SHADES: Final = {"ACCEL": "#bfe3d3", "CRUISE": "#d3e6f5", "DECEL": "#fbe0bd"}
"""By state: light tints of the colours of Okabe and Ito, which the colour-blind tell apart too."""

LINE: Final = "#1b2a41"
GREY: Final = "#7a869a"


@contextmanager
def house_style() -> Iterator[None]:
    """What matplotlib is set to meanwhile, whatever it was before."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(
            {
                # Without a salt the names inside an SVG are drawn by chance.
                "svg.hashsalt": "sacbus",
                # Text stays text: a tenth of the size, and it can be searched and read aloud.
                "svg.fonttype": "none",
                "font.size": 10,
                "axes.spines.top": False,
                "axes.spines.right": False,
                "axes.edgecolor": GREY,
                "axes.labelcolor": LINE,
                "xtick.color": LINE,
                "ytick.color": LINE,
                "text.color": LINE,
                "text.parse_math": False,
            }
        )
        yield


def save_figure(figure: Figure, file: BinaryIO, form: str) -> None:
    """Write a figure without a date or a version in it."""
    metadata = {"Software": None} if form == "png" else {"Date": None, "Creator": None}
    figure.savefig(file, format=form, dpi=120, metadata=metadata)


def time_unit(whole: float) -> tuple[float, str]:
    """What to count time in, and how many of it a second has; ``whole`` in seconds."""
    if whole < 0.1:
        return 1_000.0, "ms"
    if whole < 600:
        return 1.0, "s"
    return (1 / 60, "min") if whole < 36_000 else (1 / 3_600, "h")
