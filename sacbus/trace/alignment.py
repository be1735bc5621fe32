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

#: Entries that are skipped at once on either side at most.
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


class _Meeting(NamedTuple):
    """Where the two agree again: how many are skipped on each side, and how far off it is.

    ``sure``: enough in a row agree.
    """

    ours: int
    theirs: int
    off: Ns
    sure: bool


def walk(
    expected: Sequence[Entry], got: Sequence[Entry], within: Ns
) -> Iterator[tuple[Ns, str, str]]:
    """Where two sequences differ: when, and what stands there in each.

    within: ns by which an instant may differ.
    """
    i = j = 0
    shift: Ns = 0
    while i < len(expected) and j < len(got):
        one, other = expected[i], got[j]
        off = other.when - one.when
        if one.words != other.words or not _timely(off, shift, within):
            met = _meeting(expected, got, i, j, shift, within)
            ours, theirs = (1, 1) if met is None else met[:2]
            if ours or theirs:
                yield from _skipped(expected[i : i + ours], got[j : j + theirs])
                i, j = i + ours, j + theirs
                continue
        if abs(off) <= within:
            shift = 0
        elif not _timely(off, shift, within):
            shift = off
            yield one.when, one.words, f"{other.words} {off:+} ns off"
        i, j = i + 1, j + 1
    yield from _skipped(expected[i:], got[j:])


def _timely(off: Ns, shift: Ns, within: Ns) -> bool:
    """Whether it is where it should be, or as far off as is known already."""
    return abs(off) <= within or abs(off - shift) <= within


def _skipped(expected: Sequence[Entry], got: Sequence[Entry]) -> Iterator[tuple[Ns, str, str]]:
    """What has no like: one in place of another as long as both have some, then one-sided."""
    both = min(len(expected), len(got))
    for one, other in zip(expected[:both], got[:both], strict=True):
        yield one.when, one.words, other.words
    for one in expected[both:]:
        yield one.when, one.words, NOTHING
    for other in got[both:]:
        yield other.when, NOTHING, other.words


def _meeting(
    expected: Sequence[Entry], got: Sequence[Entry], i: int, j: int, shift: Ns, within: Ns
) -> _Meeting | None:
    """Where they agree again, i and j themselves at the earliest; None: nowhere near.

    Of all places that could be it one that is sure, and of these one that is in time, or else the
    nearest in time.
    """
    beside: _Meeting | None = None
    found: list[tuple[bool, bool, Ns, int, _Meeting]] = []
    for met in _meetings(expected, got, i, j):
        if met.ours == met.theirs == 0:
            beside = met
        late = not _timely(met.off, shift, within)
        found.append((not met.sure, late, abs(met.off), met.ours + met.theirs, met))
    if not found:
        return None
    _, late, off, _, best = min(found)
    if beside is not None and late and off * CLEARLY > abs(beside.off):
        return beside
    return best


def _meetings(
    expected: Sequence[Entry], got: Sequence[Entry], i: int, j: int
) -> Iterator[_Meeting]:
    """All places that could be it: of those with so many more skipped on one side the first."""
    places: dict[str, list[int]] = {}
    for theirs, other in enumerate(got[j : j + FAR + 1]):
        places.setdefault(other.words, []).append(theirs)
    known: set[int] = set()
    for ours, one in enumerate(expected[i : i + FAR + 1]):
        for theirs in places.get(one.words, ()):
            if theirs - ours in known:
                continue
            here, there = (
                expected[i + ours : i + ours + ENOUGH],
                got[j + theirs : j + theirs + ENOUGH],
            )
            if all(a.words == b.words for a, b in zip(here, there, strict=False)):
                known.add(theirs - ours)
                sure = len(here) == len(there)
                yield _Meeting(ours, theirs, got[j + theirs].when - one.when, sure)
