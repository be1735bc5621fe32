"""Steps in files: CSV for everybody, npy for numpy.

Owns both forms. CSV has a line a step, ``time_ns,axis,direction``, with that as a first line or
without; blank lines count for nothing; the axis is its number, the direction 1 or -1. npy has one
array with fields of these names, or of whole numbers in three columns. In the order of time. An
axis's number in a file is its name, not its place: nodes have addresses.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final, NamedTuple, TextIO

import numpy as np

from sacbus.simad.fault import SimadError
from sacbus.simad.steps import MOST_AXES, Steps

if TYPE_CHECKING:
    from sacbus.simad.steps import Times

__all__ = ["FORMS", "axes_in", "read_steps", "write_csv", "write_npy"]

FIELDS: Final = ("time_ns", "axis", "direction")
FORMS: Final = (".csv", ".npy")

#: Steps that are read or written at a time.
PIECE: Final = 1 << 17

#: Of what is counted here, int64.
_LARGEST: Final = (1 << 63) - 1

_STORED: Final = np.dtype([("time_ns", "<i8"), ("axis", "<i4"), ("direction", "i1")])


class _Columns(NamedTuple):
    """Some steps of a file: arrays of int64; ``numbers`` are those of their lines or rows."""

    times: Times
    axes: Times
    directions: Times
    numbers: Times


def axes_in(path: Path) -> tuple[int, ...]:
    """The numbers of the axes that a file has steps of, sorted; goes through all of it."""
    found: set[int] = set()
    for columns in _columns(path):
        found.update(np.unique(columns.axes).tolist())
        if len(found) > MOST_AXES:
            raise SimadError(f"{path}: expected {MOST_AXES} axes at most, got more, name some")
    return tuple(sorted(found))


def read_steps(path: Path, axes: Sequence[int]) -> Iterator[Steps]:
    """The steps of these axes, an axis being its place among them; others are left out.

    SimadError, naming the line, for what is none; OSError for what cannot be read.
    """
    numbers = np.array(axes, dtype=np.int64)
    order = np.argsort(numbers)
    now = 0
    for columns in _columns(path):
        _check(path, columns, now)
        now = int(columns.times[-1])
        place = np.searchsorted(numbers[order], columns.axes).clip(max=len(axes) - 1)
        which = order[place]
        mine = numbers[which] == columns.axes
        if mine.any():
            yield Steps(
                columns.times[mine],
                which[mine].astype(np.uint8),
                columns.directions[mine].astype(np.int8),
            )


def write_csv(parts: Iterable[Steps], out: TextIO, names: Sequence[str]) -> int:
    """Write steps, as they come; how many. ``names``: of the axes."""
    out.write(",".join(FIELDS) + "\n")
    written = 0
    for part in parts:
        columns = part.times.tolist(), part.axes.tolist(), part.directions.tolist()
        out.write(
            "".join(
                [f"{when},{names[axis]},{way}\n" for when, axis, way in zip(*columns, strict=True)]
            )
        )
        written += part.count
    return written


def write_npy(steps: Steps, out: BinaryIO, numbers: Sequence[int]) -> int:
    """Write steps as one array; how many. ``numbers``: of the axes."""
    stored = np.empty(steps.count, dtype=_STORED)
    stored["time_ns"] = steps.times
    stored["axis"] = np.array(numbers, dtype=np.int32)[steps.axes]
    stored["direction"] = steps.directions
    np.save(out, stored, allow_pickle=False)
    return steps.count


def _columns(path: Path) -> Iterator[_Columns]:
    if path.suffix.lower() == ".npy":
        yield from _of_array(path)
    else:
        with path.open(encoding="utf-8", errors="replace") as file:
            yield from _of_lines(path, file)


def _of_array(path: Path) -> Iterator[_Columns]:
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (EOFError, ValueError) as fault:  # EOFError: there is nothing in it
        raise SimadError(f"{path}: expected an array of numpy's, {fault}") from fault
    names = array.dtype.names
    if array.ndim == 1 and names is not None and set(FIELDS) <= set(names):
        parts = [array[name] for name in FIELDS]
    elif array.ndim == 2 and array.shape[1] == len(FIELDS):
        parts = list(array.T)
    else:
        raise SimadError(
            f"{path}: expected fields {', '.join(FIELDS)} or three columns, "
            f"got {array.dtype} of shape {array.shape}"
        )
    if any(part.dtype.kind not in "iu" for part in parts):
        raise SimadError(f"{path}: expected whole numbers, got {array.dtype}")
    for first in range(0, len(array), PIECE):
        pieces = [part[first : first + PIECE] for part in parts]
        for piece in pieces:
            if int(piece.max()) > _LARGEST:
                raise SimadError(f"{path}: expected numbers below 2**63, got {piece.max()}")
        times, axes, ways = (piece.astype(np.int64) for piece in pieces)
        yield _Columns(times, axes, ways, np.arange(first, first + len(times), dtype=np.int64))


def _of_lines(path: Path, file: TextIO) -> Iterator[_Columns]:
    number, begun = 1, False
    while lines := list(islice(file, PIECE)):
        numbers = np.arange(number, number + len(lines), dtype=np.int64)
        number += len(lines)
        if not begun:
            first = next((place for place, line in enumerate(lines) if line.strip()), len(lines))
            begun = first < len(lines)
            first += begun and lines[first].split(",")[0].strip() == FIELDS[0]
            lines, numbers = lines[first:], numbers[first:]
        found = _all_at_once(lines)
        if found is None:
            # Only now, for it costs as much as the reading: nearly no file has blank lines.
            kept = [place for place, line in enumerate(lines) if line.strip()]
            lines, numbers = [lines[place] for place in kept], numbers[kept]
            found = _all_at_once(lines)
        if found is None:
            found = _one_by_one(path, lines, numbers.tolist())
        if len(found):
            times, axes, ways = found.T
            yield _Columns(times, axes, ways, numbers)


def _all_at_once(rows: Sequence[str]) -> Times | None:
    """The three columns of lines; None where one of them is wrong, or blank."""
    try:
        found = np.array([row.split(",") for row in rows]).astype(np.int64)
    except (ValueError, OverflowError):
        return None
    return found if found.shape == (len(rows), len(FIELDS)) or not rows else None


def _one_by_one(path: Path, rows: Sequence[str], numbers: Sequence[int]) -> Times:
    """Lines of which one at least is wrong; SimadError names the first."""
    found = []
    for line, row in zip(numbers, rows, strict=True):
        try:
            values = [int(word) for word in row.split(",")]
        except ValueError:
            values = []
        if len(values) != len(FIELDS) or any(abs(value) > _LARGEST for value in values):
            raise SimadError(
                f"{path}, line {line}: expected {','.join(FIELDS)} as whole numbers, "
                f"got {row.strip()[:40]!r}"
            )
        found.append(values)
    return np.array(found, dtype=np.int64)


def _check(path: Path, columns: _Columns, now: int) -> None:
    """SimadError for steps out of order, and for directions that are none."""
    what = "row" if path.suffix.lower() == ".npy" else "line"
    before = np.append(now, columns.times[:-1])
    early = np.flatnonzero(columns.times < before)
    if early.size:
        place = int(early[0])
        raise SimadError(
            f"{path}, {what} {columns.numbers[place]}: expected a time of {before[place]} ns or "
            f"later, got {columns.times[place]}, sort the steps"
        )
    wrong = np.flatnonzero(np.abs(columns.directions) != 1)
    if wrong.size:
        place = int(wrong[0])
        raise SimadError(
            f"{path}, {what} {columns.numbers[place]}: expected a direction of 1 or -1, "
            f"got {columns.directions[place]}"
        )
