"""Two sequences of what should be the same, walked side by side.

Owns which entry of one belongs to which of the other. Where they part, the walk looks some entries
ahead on both sides for where they agree again: what was skipped on one side alone is missing, or
too much, and everything behind it is compared with its like. Memory is bounded by the sequences.

What came in between may make all that follows later. Such a shift is told once, where it begins,
for as long as it stays the same within the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from sacbus.kernel import Ns

__all__ = ["NOTHING", "Entry", "walk"]

#: Entries that are skipped at once on either side at most, as a rule.
FAR: Final = 16

#: Entries in a row that agree where the two are said to agree again, unless both end before. Where
#: one alone ends, fewer do if there is no such place.
ENOUGH: Final = 3

#: By how much nearer in time the like of an entry must be than what stands beside it in the same
#: words: two that change places with the next ones are told as late, not as missing and too much.
CLEARLY: Final = 4

#: What stands where one of the two has nothing.
NOTHING: Final = "nothing"


@dataclass(frozen=True, slots=True)
class Entry:
    """Something in a sequence: when, and what must be equal, in words."""

    when: Ns
    words: str


#: When, and what stands there in each of the two.
_Told = tuple[Ns, str, str]


class _Meeting(NamedTuple):
    """Where the two agree again, the best of several least: tuples are compared.

    ``unsure``: fewer than enough in a row agree. ``late``: it is not in time. ``off``: by how much.
    ``ours`` and ``theirs``: how many are skipped in what is expected, and in what came.
    """

    unsure: bool
    late: bool
    off: Ns
    ours: int
    theirs: int


def walk(expected: Sequence[Entry], got: Sequence[Entry], within: Ns) -> Iterator[_Told]:
    """Where two sequences differ: when, and what stands there in each.

    within: ns by which an instant may differ.
    """
    return _Walk(expected, got, within).run()


class _Walk:
    def __init__(self, expected: Sequence[Entry], got: Sequence[Entry], within: Ns) -> None:
        self._expected = expected
        self._got = got
        self._within = within
        #: By how much all is late, as far as that has been told.
        self._shift: Ns = 0
        #: Times in a row that the two agreed again nowhere near.
        self._lost = 0

    def run(self) -> Iterator[_Told]:
        i = j = 0
        while i < len(self._expected) and j < len(self._got):
            one, other = self._expected[i], self._got[j]
            ours = theirs = 1
            if one.words != other.words or not self._is_timely(other.when - one.when):
                met = self._meeting(i, j)
                self._lost = self._lost + 1 if met is None else 0
                if met is not None and (met.ours or met.theirs):
                    ours, theirs = met.ours, met.theirs
            yield from self._passed(self._expected[i : i + ours], self._got[j : j + theirs])
            i, j = i + ours, j + theirs
        yield from self._passed(self._expected[i:], self._got[j:])

    def _passed(self, expected: Sequence[Entry], got: Sequence[Entry]) -> Iterator[_Told]:
        """One in place of another as long as both have some, then what has no like."""
        both = min(len(expected), len(got))
        for one, other in zip(expected[:both], got[:both], strict=True):
            if one.words != other.words:
                yield one.when, one.words, other.words
                continue
            off = other.when - one.when
            if not self._is_timely(off):
                yield one.when, one.words, f"{other.words} {off:+} ns off"
                self._shift = off
            elif abs(off) <= self._within:
                self._shift = 0
        for one in expected[both:]:
            yield one.when, one.words, NOTHING
        for other in got[both:]:
            yield other.when, NOTHING, other.words

    def _is_timely(self, off: Ns) -> bool:
        """Whether it is where it should be, or as far off as is known already."""
        return abs(off) <= self._within or abs(off - self._shift) <= self._within

    def _meeting(self, i: int, j: int) -> _Meeting | None:
        """Where they agree again, at i and j themselves at the earliest; None: nowhere near.

        Of all places that could be it one that is sure, and of these one that is in time, or else
        the nearest in time. Beside an entry that says the same another one must be clearly nearer.
        """
        one, other = self._expected[i], self._got[j]
        best = min(self._meetings(i, j), default=None)
        if one.words != other.words:
            return best
        beside = abs(other.when - one.when)
        if best is None or best.unsure or (best.late and best.off * CLEARLY > beside):
            return _Meeting(unsure=False, late=True, off=beside, ours=0, theirs=0)
        return best

    def _meetings(self, i: int, j: int) -> Iterator[_Meeting]:
        """All places that could be it: of those with so many more skipped on one side the first."""
        far = self._far()
        places: dict[str, list[int]] = {}
        for theirs, other in enumerate(self._got[j : j + far + 1]):
            places.setdefault(other.words, []).append(theirs)
        known: set[int] = set()
        for ours, one in enumerate(self._expected[i : i + far + 1]):
            for theirs in places.get(one.words, ()):
                if theirs - ours in known:
                    continue
                here = self._expected[i + ours : i + ours + ENOUGH]
                there = self._got[j + theirs : j + theirs + ENOUGH]
                if all(a.words == b.words for a, b in zip(here, there, strict=False)):
                    known.add(theirs - ours)
                    off = there[0].when - one.when
                    late = not self._is_timely(off)
                    yield _Meeting(len(here) != len(there), late, abs(off), ours, theirs)

    def _far(self) -> int:
        """How far is looked ahead: further, but seldom, where what is near was of no use."""
        lost = self._lost
        return FAR if lost < FAR or lost & (lost - 1) else 4 * lost
