"""Steps of several axes, in the order of time: what is encoded, and what is decoded again.

Owns the arrays and what they must be like. An axis is its number here, from 0; which node or letter
it is, is known to whoever asks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sacbus.simad.fault import SimadError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Times = NDArray[np.int64]
    Axes = NDArray[np.uint8]
    Signs = NDArray[np.int8]

__all__ = ["MOST_AXES", "Steps", "joined", "merge"]

#: Axes on one DIR line; an axis is a byte.
MOST_AXES: Final = 255

#: Instants that are handled: 52 days of ns. An instant and a line fit into one int64 for sorting.
LATEST: Final = 1 << 52


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Steps in the order of time; three arrays of one length.

    times: int64, ns, never falling. axes: uint8, the axis of each, from 0. directions: int8, +1 for
    clockwise, -1 for the other way. Steps of one axis at one instant follow one another as given.
    """

    times: Times
    axes: Axes
    directions: Signs

    @classmethod
    def of(cls, times: ArrayLike, axes: ArrayLike, directions: ArrayLike) -> Steps:
        """Whatever numpy makes arrays of, checked; SimadError for what is no stream of steps."""
        when, which, signs = (
            _whole(name, one)
            for name, one in (("times", times), ("axes", axes), ("directions", directions))
        )
        if not when.size == which.size == signs.size:
            raise SimadError(
                "expected as many times as axes and directions, "
                f"got {when.size}, {which.size} and {signs.size}"
            )
        if which.size and not 0 <= which.min() <= which.max() < MOST_AXES:
            raise SimadError(f"axes: expected 0 to {MOST_AXES - 1}, got {_odd(which)}")
        wrong = np.flatnonzero(np.abs(signs) != 1)
        if wrong.size:
            first = int(wrong[0])
            raise SimadError(f"directions[{first}]: expected 1 or -1, got {signs[first]}")
        steps = cls(when, which.astype(np.uint8), signs.astype(np.int8))
        steps.check()
        return steps

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.times.size)

    def check(self) -> None:
        """SimadError where time runs backwards, or is none that is handled."""
        times = self.times
        if not times.size:
            return
        fallen = np.flatnonzero(times[1:] < times[:-1])
        if fallen.size:
            place = int(fallen[0]) + 1
            raise SimadError(
                f"times[{place}]: expected no earlier than {times[place - 1]} ns, "
                f"got {times[place]} ns, sort the steps"
            )
        if times[0] < 0 or times[-1] >= LATEST:
            odd = times[0] if times[0] < 0 else times[-1]
            raise SimadError(f"times: expected 0 ns to 52 days, got {odd} ns")

    def slice(self, begin: int, end: int) -> Steps:
        """Some of them, without copying."""
        return Steps(self.times[begin:end], self.axes[begin:end], self.directions[begin:end])

    def of_axis(self, axis: int) -> tuple[Times, Signs]:
        """When an axis steps, and which way."""
        mine = self.axes == axis
        return self.times[mine], self.directions[mine]

    def pieces(self, most: int) -> Iterator[Steps]:
        """All of them, some at a time."""
        for begin in range(0, self.count, most):
            yield self.slice(begin, begin + most)


def merge(times: Sequence[ArrayLike], directions: Sequence[ArrayLike]) -> Steps:
    """The steps of all axes in one stream, from the times (ns) and directions (±1) of each.

    A direction may be one number for all of an axis. Steps of one instant are put in the order of
    the axes; the encoder takes them as its own rule says. SimadError for what is none.
    """
    if len(times) != len(directions):
        raise SimadError(
            f"expected directions of {len(times)} axes, as there are times, got {len(directions)}"
        )
    if len(times) > MOST_AXES:
        raise SimadError(f"expected {MOST_AXES} axes at most, got {len(times)}")
    whens = [_whole(f"times of axis {axis}", one) for axis, one in enumerate(times)]
    signs = [
        _as_many(axis, when.size, one)
        for axis, (when, one) in enumerate(zip(whens, directions, strict=True))
    ]
    if not whens:
        return Steps.of([], [], [])
    which = np.repeat(np.arange(len(whens)), [when.size for when in whens])
    when = np.concatenate(whens)
    # Stable: what one axis does at one instant stays in order. Sorted parts are merged fast.
    order = np.argsort(when, kind="stable")
    return Steps.of(when[order], which[order], np.concatenate(signs)[order])


def joined(parts: Sequence[Steps]) -> Steps:
    """One stream of several that follow one another."""
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return Steps.of([], [], [])
    return Steps(
        np.concatenate([one.times for one in parts]),
        np.concatenate([one.axes for one in parts]),
        np.concatenate([one.directions for one in parts]),
    )


def _as_many(axis: int, count: int, given: ArrayLike) -> Times:
    """The directions of an axis: one for each step, or one for all."""
    name = f"directions of axis {axis}"
    if np.ndim(given) == 0:
        given = np.full(count, given)
    signs = _whole(name, given)
    if signs.size != count:
        raise SimadError(f"{name}: expected {count}, as there are times, got {signs.size}")
    return signs


def _whole(name: str, given: ArrayLike) -> Times:
    """An array of whole numbers; SimadError for anything else, rather than rounding it."""
    array = np.asarray(given)
    if not array.size:
        return np.empty(0, dtype=np.int64)
    if array.ndim != 1:
        raise SimadError(f"{name}: expected one dimension, got {array.ndim}")
    if array.dtype.kind not in "iu":
        raise SimadError(f"{name}: expected whole numbers, got {array.dtype}")
    if array.dtype == np.uint64 and array.max() >= np.uint64(1 << 63):
        raise SimadError(f"{name}: expected 63 bits, got {array.max()}")
    return array.astype(np.int64, copy=False)


def _odd(which: Times) -> int:
    low = int(which.min())
    return low if low < 0 else int(which.max())
