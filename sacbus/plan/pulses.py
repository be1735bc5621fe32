"""The times of all pulses of a plan, as a file.

Owns the two formats. CSV has a line a pulse: its time in µs from the first load of the plan, the
number of the command, and the position in pulses after it (clockwise counts up, from 0). ``.npy``
has the times alone: one array of float64, in µs, every one exact. Pulses are computed and written
in pieces, so that memory stays the same for any number of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from sacbus.motion import TICKS_PER_US
from sacbus.plan.entries import PlanError
from sacbus.plan.sequence import Planned, Survey

__all__ = ["PulseFormat", "format_of", "write_pulses"]

PIECE: Final = 1 << 16
"""Pulses computed at a time: some MB as text."""

EXACT: Final = 1 << 53
"""Ticks up to which a float64 holds every half µs: 142 years."""


class PulseFormat(Enum):
    """How times are written; the value is the file's ending."""

    CSV = ".csv"
    NPY = ".npy"


def format_of(path: Path) -> PulseFormat:
    """The format that a file's ending asks for; :class:`PlanError` for any other."""
    for one in PulseFormat:
        if path.suffix.lower() == one.value:
            return one
    raise PlanError(
        f"pulse times are written as CSV or for numpy, {path}, give a name that ends in "
        + " or ".join(one.value for one in PulseFormat)
    )


def write_pulses(
    plan: Iterable[Planned],
    survey: Survey,
    file: BinaryIO,
    form: PulseFormat,
    wrote: Callable[[int], object] = lambda _count: None,
) -> None:
    """Write all pulses of a plan; ``wrote`` is told how many each time some are.

    :class:`PlanError` when there is no end to them, or when the last is later than a file can say.
    """
    if survey.pulses is None or survey.duration is None:
        raise PlanError(
            "the pulses of a plan that never ends cannot be written, its last command is "
            "continuous: give it steps"
        )
    if survey.duration >= EXACT:
        raise PlanError(
            "the last pulse is more than 142 years away, --pulses, make the plan shorter"
        )
    if form is PulseFormat.NPY:
        # Written by hand, because numpy's own `save` wants the whole array.
        header = {"descr": "<f8", "fortran_order": False, "shape": (survey.pulses,)}
        npy.write_array_header_1_0(file, header)
    else:
        file.write(b"time_us,command,position\n")
    for piece in _pieces(plan):
        file.write(_binary(piece) if form is PulseFormat.NPY else _text(piece))
        wrote(len(piece.ticks))


class _Piece(NamedTuple):
    """Some pulses of one command: times in ticks, and the position after each."""

    command: int
    ticks: NDArray[np.int64]
    positions: NDArray[np.int64]


def _pieces(plan: Iterable[Planned]) -> Iterator[_Piece]:
    position = 0
    for number, planned in enumerate(plan, start=1):
        profile, sign = planned.profile, 1 if planned.motion.cw else -1
        pulses = profile.pulses or 0
        for first in range(0, pulses, PIECE):
            last = min(first + PIECE, pulses)
            # The time of a pulse is the end of the one before, and so ends this piece exactly.
            ticks = profile.pulse_times(profile.time_of(first), profile.time_of(last))
            count = np.arange(first + 1, last + 1, dtype=np.int64)
            yield _Piece(number, ticks + planned.start, position + sign * count)
        position += sign * pulses


def _binary(piece: _Piece) -> bytes:
    return (piece.ticks / TICKS_PER_US).astype("<f8").tobytes()


def _text(piece: _Piece) -> bytes:
    lines = [
        f"{tick >> 1}{'.5' if tick & 1 else ''},{piece.command},{position}\n"
        for tick, position in zip(piece.ticks.tolist(), piece.positions.tolist(), strict=True)
    ]
    return "".join(lines).encode()
