"""A part program as a CAM program writes one: a relief, finished line by line with a ball mill.

    python examples/relief.py [LINES [FILE]]

Writes a program of LINES lines, 120000 unless said otherwise, to FILE or to standard output: the
tool goes back and forth over a surface of 80 by 60 mm with a rosette in its middle, raised up to
4 mm, in bands between which it is lifted. It needs axes X, Y and Z. The same number gives the same
program, byte by byte. The status is 0 when it is written, 1 when FILE cannot be, 2 when LINES is no
number of at least 1000.

    python examples/relief.py 120000 relief.ngc
    sacbus gcode relief.ngc --axis X=10:400 --axis Y=11:400 --axis Z=12:400
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

LINES = 120_000
LEAST = 1_000
"""Fewer would leave rows so far apart that nothing is finished."""

WIDTH, HEIGHT, RAISED = 80.0, 60.0, 4.0
"""mm along X, along Y, and of the rosette."""

SAFE, NEAR = 15.0, 6.0
"""mm above the plate: where nothing is in the way, and where plunging begins."""

BANDS = 6
"""Parts of the surface; the tool is lifted between them."""

PLUNGE, FINISH = 200, 900
"""Feeds, mm/min."""

HEADER = (
    "%",
    "(RELIEF 80 X 60, FINISHING)",
    "(T1 BALL MILL D3)",
    "G90 G94 G91.1 G40 G49 G17",
    "G21",
    "(MSG, CLAMP THE PLATE AND SET THE ORIGIN TO ITS LOWER LEFT CORNER)",
    "G54",
    "T1 M6",
    "S12000 M3",
    "G4 P2.",
    "M8",
    f"G0 Z{SAFE:g}",
)
FOOTER = ("M9", f"G0 Z{SAFE:g}", "M5", "G91 G28 Z0.", "G28 X0. Y0.", "G90", "M30", "%")


def height(x: float, y: float) -> float:
    """The surface over a place, in mm above the plate: a rosette of seven petals, flat around."""
    across, along = x - WIDTH / 2, y - HEIGHT / 2
    radius, angle = math.hypot(across, along), math.atan2(along, across)
    reach = 24 + 4 * math.cos(7 * angle)
    if radius >= reach:
        return 0.0
    bell = math.cos(math.pi / 2 * radius / reach) ** 2
    return RAISED * bell * (0.8 + 0.2 * math.cos(radius * 1.4 - 2 * angle))


def figure(mm: float) -> str:
    """A length as CAM programs write it: three decimals at most, and a point always."""
    text = f"{mm:.3f}".rstrip("0")
    return "0." if text == "-0." else text


def program(lines: int) -> Iterator[str]:
    """A part program of so many lines, without line feeds."""
    yield from HEADER
    yield from islice(surface(lines), lines - len(HEADER) - len(FOOTER))
    yield from FOOTER


def surface(lines: int) -> Iterator[str]:
    """The lines between, at least so many: rows back and forth, band by band."""
    # As far from point to point as from row to row, so that the points are shared out evenly.
    columns = max(4, round(math.sqrt(lines * WIDTH / HEIGHT)))
    rows = lines // columns + 1
    for row in range(rows + 1):
        y = HEIGHT * row / rows
        points = [WIDTH * column / columns for column in range(columns + 1)]
        if row % 2:
            points.reverse()
        if row % (rows // BANDS + 1) == 0:
            yield from approach(row // (rows // BANDS + 1) + 1, points[0], y)
        else:
            yield f"Y{figure(y)} Z{figure(height(points[0], y))}"
        before = figure(height(points[0], y))
        for x in points[1:]:
            z = figure(height(x, y))
            yield f"X{figure(x)}" if z == before else f"X{figure(x)} Z{z}"
            before = z


def approach(band: int, x: float, y: float) -> Iterator[str]:
    """From wherever the tool is to the beginning of a band."""
    yield f"(BAND {band})"
    yield f"G0 Z{figure(SAFE)}"
    yield f"X{figure(x)} Y{figure(y)}"
    yield f"Z{figure(NEAR)}"
    yield f"G1 Z{figure(height(x, y))} F{PLUNGE}."
    yield f"F{FINISH}."


def main(argv: Sequence[str]) -> int:
    """Write the program that ``argv`` asks for; the exit status."""
    asked = argv[0] if argv else str(LINES)
    if not asked.isascii() or not asked.isdigit() or int(asked) < LEAST:
        print(
            f"error: expected a number of lines from {LEAST}, got {asked!r}, "
            "examples/relief.py [LINES [FILE]], name one",
            file=sys.stderr,
        )
        return 2
    lines = program(int(asked))
    if len(argv) < 2:
        sys.stdout.writelines(f"{line}\n" for line in lines)
        return 0
    try:
        with Path(argv[1]).open("w", encoding="ascii", newline="\n") as file:
            file.writelines(f"{line}\n" for line in lines)
    except OSError as fault:
        print(
            f"error: the program cannot be written ({fault.strerror or fault}), {argv[1]}, "
            "name a file in a directory that is there",
            file=sys.stderr,
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
