"""A part program on its way from items to blocks, and what is noted of it in passing.

Owns the noting: sums, the path that was asked for, the deviation along it, the listing. Everything
passes one by one, so a program may be of any length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from sacbus.machining.listing import listing_of
from sacbus.machining.trail import Trail
from sacbus.toolpath import MOST_STEPS, Block, Machine, PathItem, Straight, Survey, plan_path

__all__ = ["Course", "TooFar"]

Point = tuple[float, ...]


class TooFar(ValueError):
    """A stretch that goes further than any machine does."""


class Course:
    """A program's way through the planner.

    ``survey``: the sums of its blocks so far. ``asked``: the path's points, mm by axis. ``end``:
    the last of them. ``deviations``: (s of motion, mm), the worst of each part. ``write`` takes the
    lines of the listing.
    """

    def __init__(
        self,
        items: Iterable[PathItem],
        machine: Machine,
        *,
        write: Callable[[str], object] | None = None,
    ) -> None:
        self.machine = machine
        self._items = items
        self._write = write
        self.survey = Survey()
        self.end: Point = (0.0,) * len(machine.axes)
        self.asked: Trail[Point] = Trail()
        self.asked.add(self.end)
        self.deviations: Trail[tuple[float, float]] = Trail(
            lambda one, other: (other[0], max(one[1], other[1]))
        )

    def blocks(self, command_seconds: float) -> Iterator[Block]:
        """The blocks, for a line that carries a command in so many s.

        :class:`TooFar`, when it is reached, for a stretch that no machine has.
        """
        planned = plan_path(self._noted(), self.machine, command_seconds=command_seconds)
        for number, block in enumerate(planned, 1):
            self.survey.add(block)
            self.deviations.add((self.survey.planned, block.deviation.mm))
            if self._write is not None:
                for line in listing_of(block, number, self.machine):
                    self._write(f"{line}\n")
            yield block

    def _noted(self) -> Iterator[PathItem]:
        for item in self._items:
            if isinstance(item, Straight):
                self._check(item)
                self.end = item.to
                self.asked.add(item.to)
            yield item

    def _check(self, item: Straight) -> None:
        if (far := self.machine.too_far(self.end, item.to)) is not None:
            raise TooFar(
                f"line {item.line}: {far[0]} would go {far[1]:.0f} steps at once, "
                f"{MOST_STEPS} at most, check units and steps per mm"
            )
