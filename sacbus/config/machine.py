"""Machine files: TOML to the axes and limits that a part program is run with.

Owns the keys of a machine file and their checks, as ``keys.py`` owns those of a configuration.
Source: spec, command line (``sacbus gcode``), mother ("G-code": settings); page: docs/gcode.md.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from sacbus.config.keys import Key
from sacbus.config.mistake import ConfigError, Findings
from sacbus.config.notation import HIGHEST_ADDRESS
from sacbus.config.source import Source, load
from sacbus.config.table import Table, tables
from sacbus.motion import Drive
from sacbus.toolpath import Axis, Machine

__all__ = ["AXIS", "LETTERS", "MACHINE", "read_machine", "read_machine_source"]

#: What axes are called in G-code.
LETTERS: Final = ("X", "Y", "Z", "A", "B", "C", "U", "V", "W")

#: Of a SAC, which is what moves an axis: 0 to 3 have other uses in its packets (manual).
_LOWEST_NODE: Final = 4

_DEFAULT: Final = Machine(())
_AXIS: Final = Axis("X", _LOWEST_NODE, 1.0)
_DRIVE: Final = Drive()


def _number(low: float, high: float) -> Callable[[object], bool]:
    def fits(value: object) -> bool:
        return (
            isinstance(value, int | float)
            and not isinstance(value, bool)
            and low <= value <= high  # not nan
        )

    return fits


def _whole(low: int, high: int) -> Callable[[object], bool]:
    def fits(value: object) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high

    return fits


def _measure(
    name: str, low: float, high: float, meaning: str, default: float | None = None, **of: object
) -> Key:
    allowed = f"a number from {low:g} to {high:g}"
    return Key(name, allowed, _number(low, high), meaning, default, **of)  # type: ignore[arg-type]  # Key's own


def _count(
    name: str, low: int, high: int, meaning: str, default: int | None = None, **of: object
) -> Key:
    allowed = f"a whole number from {low} to {high}"
    return Key(name, allowed, _whole(low, high), meaning, default, **of)  # type: ignore[arg-type]  # Key's own


MACHINE: Final = (
    _measure("rapid", 0.1, 100_000, "mm/min of G0", _DEFAULT.rapid),
    _measure("feed", 0.1, 100_000, "mm/min of G1, G2, G3 before the first F", _DEFAULT.feed),
    _measure(
        "acceleration",
        0.01,
        999,
        "rad/s² of the axis that takes most steps; the others' follow from it",
        _DEFAULT.acceleration,
    ),
    _measure("tolerance", 1e-6, 10, "mm by which chords may part from an arc", _DEFAULT.tolerance),
    Key(
        "axis",
        "one [[axis]] at least",
        lambda value: isinstance(value, list | dict),
        "an axis",
        required=True,
    ),
)

AXIS: Final = (
    Key(
        "name",
        f"one of {', '.join(LETTERS)}",
        lambda value: value in LETTERS,
        "its letter in G-code; every axis its own",
        choices=LETTERS,
        required=True,
    ),
    _count(
        "node",
        _LOWEST_NODE,
        HIGHEST_ADDRESS,
        "address of the node that moves it; every axis its own",
        required=True,
    ),
    _measure("steps_per_mm", 1e-3, 1e6, "full steps a mm; for A, B, C a degree", required=True),
    Key(
        "inverted",
        "true or false",
        lambda value: isinstance(value, bool),
        "whether a positive way is counterclockwise",
        default=_AXIS.inverted,
    ),
    _count("max_rpm", 1, 10_000, "what its motor never exceeds", _AXIS.max_rpm),
    _measure(
        "max_acceleration",
        0.01,
        999,
        "rad/s² that it never exceeds",
        otherwise="the machine's acceleration",
    ),
    _count(
        "jump_rpm",
        1,
        1_000,
        "the change of velocity that it follows without a ramp",
        otherwise="its slow",
    ),
    _count("ustep", 0, 7, "the node's microsteps, as a power of two", _DRIVE.ustep),
    _count("sprf", 1, 65_535, "the node's full steps per revolution", _DRIVE.sprf),
    _count("slow", 1, 255, "the node's RPM up to which there are no ramps", _DRIVE.slow_rpm),
)


def read_machine(file: str | Path) -> Machine:
    """The machine in a file, or on standard input for ``-``; ConfigError with all its mistakes."""
    return read_machine_source(load(file, "machine file"))


def read_machine_source(source: Source) -> Machine:
    """The machine in a text that has been read; ConfigError with all its mistakes."""
    findings = Findings(source.name, source.lines)
    top = Table.read(findings, (), source.content, MACHINE)
    axes = [
        Table.read(findings, path, content, AXIS)
        for path, content in tables(findings, top.at("axis"), top.get("axis"), "axis")
    ]
    if not axes and top.get("axis") == []:
        findings.add(top.at("axis"), "expected one [[axis]] at least, got none", "add one")
    for key in ("name", "node"):
        _refuse_twice(findings, axes, key)
    if findings:
        raise ConfigError(findings.mistakes())
    of_all = {key.name: top.values[key.name] for key in MACHINE[:-1] if key.name in top.values}
    return Machine(tuple(map(_axis, axes)), **of_all)


def _refuse_twice(findings: Findings, axes: list[Table], key: str) -> None:
    seen: dict[object, Table] = {}
    for axis in axes:
        value = axis.get(key)
        if value is None:
            continue
        if (first := seen.setdefault(value, axis)) is not axis:
            what = f"expected each axis's own {key}, got {value} as in {findings.place(first.path)}"
            findings.add(axis.at(key), what, "give it another")


def _axis(table: Table) -> Axis:
    drive = Drive(
        sprf=table.get("sprf", _DRIVE.sprf),
        slow_rpm=table.get("slow", _DRIVE.slow_rpm),
        ustep=table.get("ustep", _DRIVE.ustep),
    )
    given = {key.name: table.values[key.name] for key in AXIS[:-3] if key.name in table.values}
    return Axis(**given, drive=drive)
