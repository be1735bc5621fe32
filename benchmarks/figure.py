"""One measurement and how it is taken: alternating with its baseline, median of several rounds.

Machines differ, and neighbours make one machine differ from itself; both meet the same weather, so
the ratio travels and the figure does not.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Figure", "alternate", "seconds"]


@dataclass(frozen=True, slots=True)
class Figure:
    """``value`` in ``unit``; ``ratio`` to ``baseline``; ``goal`` in the unit of what it is about.

    ``goal_is`` tells which: "value, at least", "ratio, at most" and so on; empty without a goal.
    """

    name: str
    value: float
    unit: str
    ratio: float
    baseline: str
    goal: float | None = None
    goal_is: str = ""

    @property
    def met(self) -> bool | None:
        """Whether this run met the goal; None without one."""
        if self.goal is None:
            return None
        what, _, sense = self.goal_is.partition(", ")
        got = self.value if what == "value" else self.ratio
        return got >= self.goal if sense == "at least" else got <= self.goal


def seconds(act: Callable[[], object]) -> float:
    """Processor time of one call: what others on the machine use is not counted."""
    began = time.process_time()
    act()
    return time.process_time() - began


def alternate(
    act: Callable[[], object], baseline: Callable[[], object], rounds: int
) -> tuple[float, float]:
    """Median seconds of both."""
    took: list[float] = []
    base: list[float] = []
    for _ in range(rounds):
        base.append(seconds(baseline))
        took.append(seconds(act))
    return statistics.median(took), statistics.median(base)
