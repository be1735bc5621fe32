"""Two sequences of what should be the same, walked side by side.

Owns which entry of one belongs to which of the other. Where they part, the next entries of both are
aligned at the least cost (Needleman and Wunsch, 1970; the costs are ours), and the first half of
that is taken: what has no like is missing, or too much, and the rest is compared with its like.
Where nothing near is alike, the walk leaps to where three in a row are. Memory is bounded by the
sequences.

What came in between may make all that follows later. Such a shift is told once, where it begins,
for as long as it stays the same within the tolerance.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from sacbus.kernel import Ns

__all__ = ["NOTHING", "Entry", "walk"]

#: Entries of either that are aligned at once. Up to some 20 in a row without a like are bridged.
WINDOW: Final = 32

#: Entries of either after which an alignment is made anew: behind them it sees too little.
TAKEN: Final = WINDOW // 2

#: Entries in a row that agree where a leap may end.
ENOUGH: Final = 3

# What it costs to say of two entries, or of one, what is told of them. One in place of another is
# less than one missing and one too much, and the same at another time is less than that.
LATE: Final = 2
#: Late by more than entries are apart: rather are some missing, until they are in time again.
FAR_OFF: Final = 4
INSTEAD: Final = 5
ALONE: Final = 3
#: What is left in the window where the other's end is reached: its like may stand behind that.
LEFT: Final = 2

#: A unit of cost. Below it count the ns that pairs are apart, which decide between equal costs.
COST: Final = 1 << 64

#: What stands where one of the two has nothing.
NOTHING: Final = "nothing"


@dataclass(frozen=True, slots=True)
class Entry:
    """Something in a sequence: when, and what must be equal, in words."""

    when: Ns
    words: str


#: When, and what stands there in each of the two.
_Told = tuple[Ns, str, str]

#: How many entries a step takes of what is expected, and of what came: one, or none, of each.
_Step = tuple[int, int]

_PAIR: Final = (1, 1)
_MISSING: Final = (1, 0)
_EXTRA: Final = (0, 1)


class _Place(NamedTuple):
    """A place in both: before what entry of what is expected, and before what entry that came."""

    ours: int
    theirs: int


def walk(expected: Sequence[Entry], got: Sequence[Entry], within: Ns) -> Iterator[_Told]:
    """Where two sequences differ: when, and what stands there in each.

    within: ns by which an instant may differ.
    """
    ends = _Place(len(expected), len(got))
    return _Walk(expected, got, within).between(_Place(0, 0), ends)


class _Walk:
    def __init__(self, expected: Sequence[Entry], got: Sequence[Entry], within: Ns) -> None:
        self._expected = expected
        self._got = got
        self._within = within
        #: By how much all is late, as far as that has been told.
        self._shift: Ns = 0
        #: Alignments in a row that found nothing alike.
        self._lost = 0

    def between(self, since: _Place, until: _Place) -> Iterator[_Told]:
        """What is told of the entries from one place up to another."""
        i, j = since
        while i < until.ours and j < until.theirs:
            one, other = self._expected[i], self._got[j]
            if one.words == other.words and (
                self._is_timely(other.when - one.when) or self._is_nearest(i, j, until)
            ):
                yield from self._paired(one, other)
                i, j = i + 1, j + 1
                continue
            met = self._meeting(_Place(i, j), until)
            if met is not None:
                self._lost = 0
                yield from self.between(_Place(i, j), met)
                i, j = met
                continue
            alike = False
            for ours, theirs in self._steps(_Place(i, j), until):
                if ours and theirs:
                    one, other = self._expected[i], self._got[j]
                    alike = alike or one.words == other.words
                    yield from self._paired(one, other)
                elif ours:
                    yield self._expected[i].when, self._expected[i].words, NOTHING
                else:
                    yield self._got[j].when, NOTHING, self._got[j].words
                i, j = i + ours, j + theirs
            self._lost = 0 if alike else self._lost + 1
        for one in self._expected[i : until.ours]:
            yield one.when, one.words, NOTHING
        for other in self._got[j : until.theirs]:
            yield other.when, NOTHING, other.words

    def _paired(self, one: Entry, other: Entry) -> Iterator[_Told]:
        if one.words != other.words:
            yield one.when, one.words, other.words
            return
        off = other.when - one.when
        if not self._is_timely(off):
            yield one.when, one.words, f"{other.words} {off:+} ns off"
            self._shift = off
        elif abs(off) <= self._within:
            self._shift = 0

    def _is_timely(self, off: Ns) -> bool:
        """Whether it is where it should be, or as far off as is known already."""
        return self._untimely(off) <= self._within

    def _untimely(self, off: Ns) -> Ns:
        return min(abs(off), abs(off - self._shift))

    def _is_nearest(self, i: int, j: int, until: _Place) -> bool:
        """Whether of two that say the same neither has another one nearer in time.

        It spares the alignment where all is a little off, as in recordings of real time.
        """
        one, other = self._expected[i].when, self._got[j].when
        off = self._untimely(other - one)
        return not (
            (i + 1 < until.ours and self._untimely(other - self._expected[i + 1].when) < off)
            or (j + 1 < until.theirs and self._untimely(self._got[j + 1].when - one) < off)
        )

    def _steps(self, since: _Place, until: _Place) -> Iterator[_Step]:
        """How to go on from a place: all the way if its window ends there, or else the half."""
        expected = self._expected[since.ours : min(since.ours + WINDOW, until.ours)]
        got = self._got[since.theirs : min(since.theirs + WINDOW, until.theirs)]
        whole = until == (since.ours + len(expected), since.theirs + len(got))
        if not whole and {one.words for one in expected}.isdisjoint(one.words for one in got):
            yield from [_PAIR] * min(len(expected), len(got), TAKEN)
            return
        ways = self._ways(expected, got, (ALONE if whole else LEFT) * COST)
        i = j = 0
        while (i < len(expected) or j < len(got)) if whole else (i < TAKEN and j < TAKEN):
            ours, theirs = ways[i][j]
            yield ours, theirs
            i, j = i + ours, j + theirs

    def _ways(
        self, expected: Sequence[Entry], got: Sequence[Entry], rest: int
    ) -> list[list[_Step]]:
        """The step to take from each place, that what is told of all behind it costs least.

        rest: the cost of an entry of one behind the last of the other.
        """
        apart = max(each[-1].when - each[0].when for each in (expected, got)) // WINDOW
        shifts = [0, self._shift, *self._new_shifts(expected, got, apart)]
        alone = ALONE * COST
        below = [rest * left for left in range(len(got), -1, -1)]
        ways: list[list[_Step]] = [[_EXTRA] * len(got)]
        for left, one in enumerate(reversed(expected), start=1):
            right = rest * left
            costs, row = [right], [_MISSING]
            for theirs in range(len(got) - 1, -1, -1):
                other = got[theirs]
                off = other.when - one.when
                cost = below[theirs + 1] + abs(off)
                if one.words != other.words:
                    cost += INSTEAD * COST
                elif not self._is_timely(off):
                    near = any(abs(off - shift) <= apart for shift in shifts)
                    cost += (LATE if near else FAR_OFF) * COST
                step = _PAIR
                if below[theirs] + alone < cost:
                    cost, step = below[theirs] + alone, _MISSING
                if right + alone < cost:
                    cost, step = right + alone, _EXTRA
                right = cost
                costs.append(cost)
                row.append(step)
            below = costs[::-1]
            ways.append(row[::-1])
        return ways[::-1]

    def _new_shifts(
        self, expected: Sequence[Entry], got: Sequence[Entry], apart: Ns
    ) -> Iterator[Ns]:
        """By how much that is late which is said but once, alone or in a row: of nearly alike one.

        apart: ns that two must be apart so as not to be nearly alike.
        """
        offs = set[Ns]()
        for count in (1, ENOUGH):
            ours, theirs = _said_once(expected, count), _said_once(got, count)
            offs.update(theirs[words] - ours[words] for words in ours.keys() & theirs.keys())
        last: Ns | None = None
        for off in sorted(offs):
            if not self._is_timely(off) and (last is None or off - last > apart):
                last = off
                yield off

    def _meeting(self, since: _Place, until: _Place) -> _Place | None:
        """Where enough in a row say the same again: in time, or else the nearest in time.

        It is looked for only if nothing near was alike, and ever further, but more seldom.
        """
        lost = self._lost
        if not lost or lost & (lost - 1):
            return None
        far = 4 * TAKEN * lost
        places: dict[tuple[str, ...], list[int]] = {}
        for theirs in range(since.theirs, min(since.theirs + far, until.theirs - ENOUGH + 1)):
            places.setdefault(_row(self._got, theirs, ENOUGH), []).append(theirs)
        best: tuple[bool, Ns, _Place] | None = None
        for ours in range(since.ours, min(since.ours + far, until.ours - ENOUGH + 1)):
            when = self._expected[ours].when
            likes = places.get(_row(self._expected, ours, ENOUGH), ())
            for due in (when, when + self._shift):
                nearest = bisect_left(likes, due, key=lambda theirs: self._got[theirs].when)
                for theirs in likes[max(nearest - 1, 0) : nearest + 1]:
                    off = self._got[theirs].when - when
                    found = (not self._is_timely(off), abs(off), _Place(ours, theirs))
                    best = found if best is None else min(best, found)
        return None if best is None else best[2]


def _said_once(entries: Sequence[Entry], count: int) -> dict[tuple[str, ...], Ns]:
    """When each row of so many entries began that says what no other one says."""
    rows = [_row(entries, place, count) for place in range(len(entries) - count + 1)]
    times = Counter(rows)
    return {row: one.when for row, one in zip(rows, entries, strict=False) if times[row] == 1}


def _row(entries: Sequence[Entry], place: int, count: int) -> tuple[str, ...]:
    return tuple([one.words for one in entries[place : place + count]])
