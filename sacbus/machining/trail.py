"""Where something went, kept in bounded memory however long it takes.

Owns the thinning: when there are too many points, each two are made one, and from then on each two
that come.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Generic, TypeVar

__all__ = ["MOST_POINTS", "Trail"]

_P = TypeVar("_P")

#: A picture has fewer columns of pixels.
MOST_POINTS: Final = 16_384


class Trail(Generic[_P]):
    """Points in order. ``merge`` makes one of two neighbours; without one the later stays."""

    def __init__(
        self, merge: Callable[[_P, _P], _P] | None = None, *, most: int = MOST_POINTS
    ) -> None:
        self._merge = merge or _later
        self._most = most
        self._points: list[_P] = []
        #: How many points that come make one that is kept; those of the next one so far.
        self.stride = 1
        self._last: _P | None = None
        self._count = 0

    def add(self, point: _P) -> None:
        """The next point."""
        self._last = point if self._last is None else self._merge(self._last, point)
        self._count += 1
        if self._count < self.stride:
            return
        self._points.append(self._last)
        self._last, self._count = None, 0
        if len(self._points) >= self._most:
            pairs = zip(self._points[::2], self._points[1::2], strict=True)
            self._points = [self._merge(one, other) for one, other in pairs]
            self.stride *= 2

    @property
    def points(self) -> list[_P]:
        """Those that are kept, and the last in any case."""
        return self._points if self._last is None else [*self._points, self._last]


def _later(_: _P, point: _P) -> _P:
    return point
