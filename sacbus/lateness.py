"""How late things happened, in a few numbers: count, worst, and quantiles from a histogram.

Owns the histogram. Knows numbers only; what is late, and against what, is the caller's business.

Theory of operation. Its classes widen with the values, 32 to each doubling, so a quantile is right
to 3 per cent whether things are late by a microsecond or by a minute. An event costs a few
operations on integers and never any memory, however long the process runs. (The alternative, to
keep the last so many values, forgets the one bad second of a day and has to sort.)
"""

from __future__ import annotations

from typing import Final

from sacbus.kernel import Ns

__all__ = ["Lateness"]

#: Values below 2**6 ns have a class each; above, 2**5 classes share each doubling.
_FINE: Final = 5

#: Doublings above 2**6 ns; what is later than all of them, by over 2 minutes, has one class more.
_DOUBLINGS: Final = 31


class Lateness:
    """How late events were, in ns. What is early counts as on time."""

    __slots__ = ("_classes", "count", "worst")

    def __init__(self) -> None:
        self._classes = [0] * (((_DOUBLINGS + 2) << _FINE) + 1)
        #: Events so far.
        self.count = 0
        #: The latest of them, ns; exact.
        self.worst: Ns = 0

    @property
    def p50(self) -> Ns:
        """Half of the events were no later than this, ns; 0 before the first."""
        return self._quantile(50)

    @property
    def p99(self) -> Ns:
        """All but one in a hundred were no later than this, ns; 0 before the first."""
        return self._quantile(99)

    def note(self, late: Ns) -> None:
        """An event was so late."""
        self.count += 1
        if late > self.worst:
            self.worst = late
        elif late < 0:
            late = 0
        excess = late.bit_length() - _FINE - 1
        if excess <= 0:
            self._classes[late] += 1
        elif excess <= _DOUBLINGS:
            # Of the value, its highest bits; which of them leads says what doubling it is.
            self._classes[(excess << _FINE) + (late >> excess)] += 1
        else:
            self._classes[-1] += 1

    def _quantile(self, percent: int) -> Ns:
        """The upper end of the class that holds the event at this rank, or the worst of all."""
        rank = -(-self.count * percent // 100)
        for index, count in enumerate(self._classes[:-1]):
            rank -= count
            if rank <= 0:
                return min(_last(index), self.worst)
        return self.worst


def _last(index: int) -> Ns:
    """The greatest value of a class."""
    excess = max((index >> _FINE) - 1, 0)
    return ((index - (excess << _FINE) + 1) << excess) - 1
