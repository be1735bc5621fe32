"""Steps of N axes to edges of N + 1 lines: in one call, or as they come.

Owns what is kept from one call to the next: the steps of the last instant, which may get company,
and the edges that others may still come before. In what pieces the steps come makes no difference
to the result. Which step comes when is ``order.py``'s and ``schedule.py``'s.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from sacbus.simad.edges import HIGH, LOW, Edges, joined_edges
from sacbus.simad.fault import DelayTooLong, SimadError
from sacbus.simad.order import first_direction, stretches, taking_order
from sacbus.simad.report import Report, Tally
from sacbus.simad.report import report as report_of
from sacbus.simad.schedule import Progress
from sacbus.simad.sorting import EdgeSorter
from sacbus.simad.steps import MOST_AXES, Steps, joined
from sacbus.simad.timing import GECKO, Timing

if TYPE_CHECKING:
    from sacbus.simad.order import Flags
    from sacbus.simad.steps import Axes, Times

__all__ = ["MAX_DELAY", "Encoded", "Encoder", "Encoding", "encode"]

#: How late a step may fall unless something else is said: ns. Source: spec.
MAX_DELAY: Final = 1_000_000

#: Steps that are worked on at a time: what fits into a processor's cache, and is worth the calls.
PIECE: Final = 1 << 15


class Encoded(NamedTuple):
    """What became of some steps: the edges, and when each step falls (ns, int64), as they came."""

    edges: Edges
    falls: Times


@dataclass(frozen=True, slots=True, eq=False)
class Encoding:
    """What :func:`encode` gives: edges, falls (ns, int64, one a step as given), and the report."""

    edges: Edges
    falls: Times
    report: Report


def encode(
    steps: Steps,
    axes: int,
    timing: Timing = GECKO,
    max_delay: int = MAX_DELAY,
    names: Sequence[str] = (),
) -> Encoding:
    """The edges of ``axes`` + 1 lines that make these steps.

    ``max_delay`` in ns; ``names``: what the axes are called in messages and reports, else their
    numbers. DelayTooLong for steps that come too fast, SimadError for what are none. Memory: 28
    bytes a step, and 10 for each turn of DIR.
    """
    encoder = Encoder(axes, timing, max_delay, names)
    # Two edges a step, and a turn of DIR at most. What is not written to takes no memory.
    times = np.empty(3 * steps.count, dtype=np.int64)
    lines, levels = (np.empty(3 * steps.count, dtype=np.uint8) for _ in range(2))
    falls = np.empty(steps.count, dtype=np.int64)
    edge, step, direction = 0, 0, HIGH
    for edges, fallen in encoder.all_of([steps]):
        if edges.count and not edge:
            direction = edges.direction
        following = edge + edges.count
        times[edge:following] = edges.times
        lines[edge:following] = edges.lines
        levels[edge:following] = edges.levels
        falls[step : step + fallen.size] = fallen
        edge, step = following, step + fallen.size
    every = Edges(times[:edge], lines[:edge], levels[:edge], direction)
    return Encoding(every, falls, encoder.report)


class Encoder:
    """Encodes steps as they come; memory stays that of a piece.

    ::

        encoder = Encoder(2)
        for steps in stream:
            edges, falls = encoder.take(steps)      # as far as they are certain
            ...
        edges, falls = encoder.close()              # the rest
        encoder.report
    """

    def __init__(
        self,
        axes: int,
        timing: Timing = GECKO,
        max_delay: int = MAX_DELAY,
        names: Sequence[str] = (),
    ) -> None:
        """As :func:`encode`; SimadError for what cannot be."""
        if not 1 <= axes <= MOST_AXES:
            raise SimadError(f"expected 1 to {MOST_AXES} axes, got {axes}")
        if max_delay < 0:
            raise SimadError(f"max_delay: expected 0 ns or more, got {max_delay}")
        if names and len(names) != axes:
            raise SimadError(f"expected names of {axes} axes, got {len(names)}")
        self.axes = axes
        self.timing = timing
        self.max_delay = max_delay
        self.names = tuple(names) or tuple(map(str, range(axes)))
        #: Which way DIR is behind all that was taken; None: nothing was.
        self._now: bool | None = None
        self._turns = 0
        self._progress = Progress(axes, timing)
        self._tallies = [Tally() for _ in range(axes)]
        self._sorter = EdgeSorter()
        #: Steps that were given and not taken, all of one instant.
        self._held: list[Steps] = []

    @property
    def report(self) -> Report:
        """The figures of all steps that were taken; those of the last instant are when closed."""
        return report_of(self._tallies, self.names, self._turns, self.timing)

    def take(self, steps: Steps) -> Encoded:
        """More steps, no earlier than those before: the edges that nothing can come before.

        ``falls`` are of the steps that were given longest ago. DelayTooLong for a step that cannot
        fall in time, SimadError for what follows on no step before: the encoder is of no use then.
        """
        return _together([*self.taken(steps)])

    def taken(self, steps: Steps) -> Iterator[Encoded]:
        """The same, in pieces of some ten thousand steps."""
        self._check(steps)
        if not steps.count:
            return
        # The last instant may get company, and what was held belongs to the first or before it.
        last = int(steps.times[-1])
        certain = int(np.searchsorted(steps.times, last))
        held = joined([*self._held, steps.slice(0, certain)])
        if held.count and held.times[0] == last:
            self._held.append(steps)
            return
        self._held = [steps.slice(certain, steps.count)]
        yield from self._pieces(held, last)

    def all_of(self, parts: Iterable[Steps]) -> Iterator[Encoded]:
        """All of some streams that follow one another, to the end."""
        for steps in parts:
            yield from self.taken(steps)
        yield self.close()

    def close(self) -> Encoded:
        """The rest, once no more steps come."""
        rest, self._held = joined(self._held), []
        return _together([*self._pieces(rest, None)])

    def _check(self, steps: Steps) -> None:
        steps.check()
        if not steps.count:
            return
        highest = int(steps.axes.max())
        if highest >= self.axes:
            raise SimadError(f"expected axes 0 to {self.axes - 1}, got {highest}")
        if self._held and steps.times[0] < self._held[0].times[0]:
            raise SimadError(
                f"expected steps from {self._held[0].times[0]} ns on, got {steps.times[0]} ns"
            )

    def _pieces(self, steps: Steps, until: int | None) -> Iterator[Encoded]:
        """Take steps; the edges before ``until``, where the next step may fall, or all."""
        begin = 0
        while begin < steps.count:
            end = min(begin + PIECE, steps.count)
            if end < steps.count:
                # All of an instant together.
                end = int(np.searchsorted(steps.times, steps.times[end - 1], side="right"))
            falls = self._schedule(steps.slice(begin, end))
            following = int(steps.times[end]) if end < steps.count else until
            yield Encoded(self._sorter.until(following), falls)
            begin = end
        if not steps.count:
            yield Encoded(self._sorter.until(until), steps.times)

    def _schedule(self, steps: Steps) -> Times:
        """When some steps fall, all of an instant among them; their edges go to be sorted."""
        times, axes, clockwise = steps.times, steps.axes, steps.directions > 0
        if self._now is None:
            self._now = first_direction(times, axes, clockwise)
            self._sorter.direction = HIGH if self._now else LOW
        place = taking_order(times, axes, clockwise, self._now)
        if place is not None:
            times, axes, clockwise = times[place], axes[place], clockwise[place]
        by_axis = np.argsort(axes, kind="stable")
        numbers = stretches(clockwise, self._now)
        falls, turns = self._progress.take(times, axes, numbers, by_axis)
        self._count(falls - times, times, axes, clockwise, by_axis)
        self._sorter.add_steps(falls, axes, self.timing.low)
        self._sorter.add_turns(turns, now=self._now)
        self._turns += turns.size
        self._now ^= bool(turns.size & 1)
        if place is None:
            return falls
        as_given = np.empty_like(falls)
        as_given[place] = falls
        return as_given

    def _count(
        self, delays: Times, times: Times, axes: Axes, clockwise: Flags, by_axis: Times
    ) -> None:
        """Add the delays of steps to the figures; DelayTooLong if one is."""
        if int(delays.max()) > self.max_delay:
            first = int(np.argmax(delays > self.max_delay))
            raise DelayTooLong(
                self.names[axes[first]], int(times[first]), int(delays[first]), self.max_delay
            )
        begin = 0
        late, way = delays[by_axis], clockwise[by_axis]
        for axis, count in enumerate(np.bincount(axes, minlength=self.axes).tolist()):
            if count:
                end = begin + count
                self._tallies[axis].add(late[begin:end], way[begin:end])
                begin = end


def _together(parts: list[Encoded]) -> Encoded:
    """One of several that follow one another."""
    if len(parts) == 1:
        return parts[0]
    falls = [one.falls for one in parts]
    return Encoded(
        joined_edges([one.edges for one in parts]),
        np.concatenate(falls) if falls else np.empty(0, dtype=np.int64),
    )
