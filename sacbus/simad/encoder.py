"""Steps of N axes to edges of N + 1 lines: in one call, or as they come.

Owns what is kept from one call to the next: the steps of the last instant, which may get company,
and the edges that others may still come before. In what pieces the steps come makes no difference
to the result. Which step comes when is ``order.py``'s and ``schedule.py``'s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from sacbus.simad.edges import HIGH, LOW, Edges, joined_edges
from sacbus.simad.fault import DelayTooLong, SimadError
from sacbus.simad.order import first_direction, stretches
from sacbus.simad.report import Report, Tally
from sacbus.simad.report import report as report_of
from sacbus.simad.schedule import Progress
from sacbus.simad.sorting import EdgeSorter
from sacbus.simad.steps import MOST_AXES, Steps, joined
from sacbus.simad.timing import GECKO, Timing

if TYPE_CHECKING:
    from sacbus.simad.steps import Times

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
    numbers. DelayTooLong for steps that come too fast, SimadError for what are none. Memory: some
    40 bytes a step for the result, and as much again while it is put together.
    """
    encoder = Encoder(axes, timing, max_delay, names)
    parts = [*map(encoder.take, steps.pieces(1 << 20)), encoder.close()]
    return Encoding(
        joined_edges([one.edges for one in parts]),
        np.concatenate([one.falls for one in parts]),
        encoder.report,
    )


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
        steps.check()
        self._check(steps)
        if not steps.count:
            return Encoded(self._sorter.until(0), steps.times)
        last = int(steps.times[-1])
        # The last instant waits for company; before it, what was held joins what it belongs to.
        certain = int(np.searchsorted(steps.times, last))
        if not certain and self._held and self._held[0].times[0] == last:
            self._held.append(steps)
            return Encoded(self._sorter.until(0), steps.times[:0])
        ready = joined([*self._held, steps.slice(0, certain)])
        self._held = [steps.slice(certain, steps.count)]
        return self._taken(ready, last)

    def close(self) -> Encoded:
        """The rest, once no more steps come."""
        ready, self._held = joined(self._held), []
        return self._taken(ready, None)

    def _check(self, steps: Steps) -> None:
        if not steps.count:
            return
        highest = int(steps.axes.max())
        if highest >= self.axes:
            raise SimadError(f"expected axes 0 to {self.axes - 1}, got {highest}")
        if self._held and steps.times[0] < self._held[0].times[0]:
            raise SimadError(
                f"expected steps from {self._held[0].times[0]} ns on, got {steps.times[0]} ns"
            )

    def _taken(self, steps: Steps, until: int | None) -> Encoded:
        """Take steps; the edges before ``until``, where the next step may fall, or all."""
        parts, falls = [], []
        begin = 0
        while begin < steps.count:
            end = min(begin + PIECE, steps.count)
            if end < steps.count:
                # All of an instant together.
                end = int(np.searchsorted(steps.times, steps.times[end - 1], side="right"))
            falls.append(self._schedule(steps.slice(begin, end)))
            following = int(steps.times[end]) if end < steps.count else until
            parts.append(self._sorter.until(following))
            begin = end
        parts.append(self._sorter.until(until))
        every = np.concatenate(falls) if falls else steps.times[:0]
        return Encoded(joined_edges(parts), every)

    def _schedule(self, steps: Steps) -> Times:
        """When some steps fall, all of an instant among them; their edges go to be sorted."""
        times, axes, clockwise = steps.times, steps.axes, steps.directions > 0
        if self._now is None:
            self._now = first_direction(times, axes, clockwise)
            self._sorter.direction = HIGH if self._now else LOW
        by_axis = np.argsort(axes, kind="stable")
        numbers, place = stretches(times, axes, clockwise, by_axis, self._now)
        if place is None:
            falls, turns = self._progress.take(times, axes, numbers, by_axis)
        else:
            which = axes[place]
            taken, turns = self._progress.take(
                times[place], which, numbers[place], np.argsort(which, kind="stable")
            )
            falls = np.empty_like(taken)
            falls[place] = taken
        self._count(steps, falls, by_axis)
        self._sorter.add_steps(falls, axes, self.timing.low)
        self._sorter.add_turns(turns, now=self._now)
        self._turns += turns.size
        self._now ^= bool(turns.size & 1)
        return falls

    def _count(self, steps: Steps, falls: Times, by_axis: Times) -> None:
        delays = falls - steps.times
        if int(delays.max()) > self.max_delay:
            first = int(np.argmax(delays > self.max_delay))
            raise DelayTooLong(
                self.names[int(steps.axes[first])],
                int(steps.times[first]),
                int(delays[first]),
                self.max_delay,
            )
        begin = 0
        late, signs = delays[by_axis], steps.directions[by_axis]
        for axis, count in enumerate(np.bincount(steps.axes, minlength=self.axes).tolist()):
            if count:
                end = begin + count
                self._tallies[axis].add(late[begin:end], signs[begin:end])
                begin = end
