"""A machine to read programs for, and the shortest ways to what they come to."""

from __future__ import annotations

from sacbus.gcode import read_program
from sacbus.toolpath import Axis, Machine, PathItem, Straight

__all__ = ["MACHINE", "items", "machine", "places"]


def machine(letters: str = "XYZ", *, feed: float = 300.0, tolerance: float = 0.01) -> Machine:
    """A machine with these axes in this order."""
    axes = tuple(Axis(letter, node, steps_per_mm=400) for node, letter in enumerate(letters, 10))
    return Machine(axes, feed=feed, tolerance=tolerance)


MACHINE = machine()


def items(program: str, on: Machine = MACHINE, *, skipping: bool = True) -> list[PathItem]:
    """All that a program makes the machine do."""
    return list(read_program(program.splitlines(keepends=True), on, skipping=skipping))


def places(program: str, on: Machine = MACHINE) -> list[tuple[float, ...]]:
    """Where the stretches of a program end, without what else it does."""
    return [item.to for item in items(program, on) if isinstance(item, Straight)]
