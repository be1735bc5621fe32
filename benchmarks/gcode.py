"""How fast part programs are read: lines per second, checked before anything moves and carried out.

The baseline reads the figures alone: a regular expression and ``float``, nothing else. The goal is
that checking a program of a million lines, which everybody waits for, is a matter of seconds.
"""

from __future__ import annotations

import re
from functools import partial

from benchmarks.figure import Figure, alternate
from examples import relief
from sacbus.gcode import check_program, read_program
from sacbus.toolpath import Axis, Machine

LINES = 20_000
MACHINE = Machine(tuple(Axis(name, node, 400.0) for node, name in enumerate("XYZ", 10)))
FIGURE = re.compile(r"[XYZ]([-.0-9]+)")


def figures_alone(program: list[str]) -> float:
    return sum(float(figure) for line in program for figure in FIGURE.findall(line))


def checked(program: list[str]) -> int:
    return check_program(program, MACHINE).stretches


def carried_out(program: list[str]) -> int:
    return sum(1 for _ in read_program(program, MACHINE))


def worded(count: int) -> list[str]:
    """Lines with all words that a CAM program without modes would write."""
    return [
        f"N{line} G1 X{line % 97}.125 Y{line % 89}.5 Z-{line % 7}.25 F{100 + line % 800}"
        for line in range(count)
    ]


def figures(rounds: int) -> list[Figure]:
    """All figures of reading part programs."""
    finishing = list(relief.program(LINES))
    found = []
    for name, program, act, goal in (
        ("lines checked, a relief", finishing, checked, 100_000),
        ("lines carried out, a relief", finishing, carried_out, None),
        ("lines checked, six words each", worded(LINES), checked, 60_000),
    ):
        took, base = alternate(partial(act, program), partial(figures_alone, program), rounds)
        found.append(
            Figure(
                name=name,
                value=LINES / took,
                unit="lines/s",
                ratio=base / took,
                baseline="reading the figures alone",
                goal=goal,
                goal_is="value, at least" if goal else "",
            )
        )
    return found
