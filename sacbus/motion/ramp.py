"""A ramp as a table of exact times: how long its first n pulses take.

Owns the sums. The law of a ramp (harmonic.py, linear.py) says how long each pulse nominally
lasts; here those periods become real ones and are added up, exactly, in integers. Tables are
immutable to their readers and shared by every profile that rides the same ramp.

Theory of operation. The first HEAD pulses are summed one by one into a compact array: nearly all
ramps end there, and a look-up is an index. Further up a ramp many pulses share one truncated
period, so the rest is held as runs (period, count). A page is PAGE consecutive period values;
only the index and the time where each page begins are kept, the pages themselves live in a small
LRU, as do the blocks of pulse times that somebody asked for. A ramp of millions of pulses thus
costs kilobytes and a few milliseconds.
Source: spec, "Profile" (exact pulse times are the cumulative sum of truncated periods).
"""

from array import array
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import accumulate
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Ticks64 = NDArray[np.int64]

HEAD: Final = 4096
"""Pulses summed one by one; 32 KiB a table at most."""

FIRST_GROWTH: Final = 128
"""Smallest head that is worth building: 10 to 100 RPM at 1.0 takes 90 pulses."""

PAGE: Final = 2048
"""Period values a page; its arrays take 48 KiB."""

PAGES_KEPT: Final = 64

BLOCK: Final = 1 << 14
"""Pulses of a tail whose times are worked out together: 128 KiB."""

BLOCKS_KEPT: Final = 64
"""8 MiB at most, for all ramps."""

FAR: Final = 1 << 50
"""A pulse index beyond every ramp: 32-bit steps at 128 microsteps stay below 2**39."""


class Law(Protocol):
    """How long each pulse of a ramp nominally lasts, in ticks, truncated; monotonous."""

    @property
    def falling(self) -> bool:
        """True when periods shrink along the ramp, as they do when the motor gains speed."""

    def periods(self, count: int) -> Iterable[int]:
        """The first `count` nominal periods; fewer when the law ends before."""

    def onsets(self, periods: Ticks64) -> Ticks64:
        """For each nominal period the first pulse at which the ramp has come as far as that.

        FAR for a period the ramp never comes to. Asked for pulses from HEAD on only.
        """

    def speed(self, index: int, nominal: int) -> int:
        """Speed (see drive.py) of the pulse at `index`, whose nominal period is given."""


class _Page(NamedTuple):
    starts: Ticks64
    """First pulse of each run, and that of the next page."""
    times: Ticks64
    """When each of these pulses is issued."""
    periods: Ticks64
    """Real period of each run."""

    def time(self, index: int) -> int:
        """When a pulse of the page is issued."""
        run = int(self.starts.searchsorted(index, "right")) - 1
        return int(self.times[run]) + (index - int(self.starts[run])) * int(self.periods[run])

    def write(self, first: int, out: Ticks64) -> None:
        """Fill `out` with the times of the page's pulses from `first` on."""
        starts = self.starts
        low = int(starts.searchsorted(first, "right")) - 1
        high = int(starts.searchsorted(first + out.size, "left"))
        ends = np.clip(starts[low : high + 1], first, first + out.size)
        steps = np.repeat(self.periods[low:high], ends[1:] - ends[:-1])
        out[0] = 0
        np.cumsum(steps[:-1], out=out[1:])
        out += self.time(first)


class Ramp:
    """The exact times of one ramp, from its pulse 0 upwards; shared, so never change one.

    `sums[i]` is the ticks of the first i periods, for as many as were needed yet; everybody but
    the planner, which must be quick, asks `time`.
    """

    __slots__ = ("_mark_index", "_mark_time", "_tail_nominal", "law", "offset", "sums")

    def __init__(self, law: Law, offset: int) -> None:
        """`offset` ticks are added to every nominal period; a real one is at least 1."""
        self.law: Final = law
        self.offset: Final = offset
        self.sums = array("q", (0,))
        self._mark_index: list[int] = []
        self._mark_time: list[int] = []
        self._tail_nominal = 0

    def time(self, index: int) -> int:
        """Ticks of the first `index` periods."""
        sums = self.sums
        if index < len(sums):
            return sums[index]
        if index <= HEAD:
            self._grow(index)
            return self.sums[index]
        return _page(self, self._page_with_index(index)).time(index)

    def period(self, index: int) -> int:
        """Real ticks of the pulse at `index`."""
        return self.time(index + 1) - self.time(index)

    def speed(self, index: int) -> int:
        """Speed (see drive.py) of the pulse at `index`."""
        return self.law.speed(index, max(1, self.period(index) - self.offset))

    def index(self, ticks: int, limit: int) -> int:
        """The pulse whose period runs at `ticks`: the last whose time is not later.

        `limit` is a pulse known to come after that instant: how far the search must go.
        """
        head = min(limit, HEAD)
        if self.time(head) > ticks:
            return bisect_right(self.sums, ticks, 0, head + 1) - 1
        page = _page(self, self._page_with_time(ticks))
        run = int(page.times.searchsorted(ticks, "right")) - 1
        return int(page.starts[run]) + (ticks - int(page.times[run])) // int(page.periods[run])

    def pieces(self, first: int, last: int) -> Iterator[Ticks64]:
        """`time(i)` for i in [first, last), in arrays that follow each other: views of the tables.

        Nobody may write to them.
        """
        if first < min(last, HEAD):
            upto = min(last, HEAD)
            self.time(upto - 1)
            yield np.frombuffer(self.sums, dtype=np.int64)[first:upto]
            first = upto
        while first < last:
            number, begin = divmod(first - HEAD, BLOCK)
            upto = min(BLOCK, begin + last - first)
            # A ramp that slows down comes to an end, so no further than is asked for.
            yield _block(self, number, BLOCK if self.law.falling else upto)[begin:upto]
            first += upto - begin

    def _grow(self, index: int) -> None:
        """Make the head reach `index`; doubling, so that the work stays in proportion."""
        count = FIRST_GROWTH
        while count < index:
            count *= 2
        offset = self.offset
        real = (max(1, p + offset) for p in self.law.periods(min(count, HEAD)))
        # A new array instead of an append: readers may hold numpy views of the old one.
        self.sums = array("q", accumulate(real, initial=0))

    def _page_with_index(self, index: int) -> int:
        self._open_tail()
        while self._mark_index[-1] <= index:
            _page(self, len(self._mark_index) - 1)
        return bisect_right(self._mark_index, index) - 1

    def _page_with_time(self, ticks: int) -> int:
        self._open_tail()
        while self._mark_time[-1] <= ticks:
            _page(self, len(self._mark_time) - 1)
        return bisect_right(self._mark_time, ticks) - 1

    def _open_tail(self) -> None:
        if not self._mark_index:
            *_, self._tail_nominal = self.law.periods(HEAD)
            self._mark_time.append(self.time(HEAD))
            self._mark_index.append(HEAD)

    def _build_page(self, number: int) -> _Page:
        """Runs of the PAGE period values that follow the pages before; notes where it ends."""
        law = self.law
        slope = -1 if law.falling else 1
        # The last period of the head may go on in the tail: the tail begins with it.
        begin = self._tail_nominal + slope * number * PAGE
        nominal = begin + slope * np.arange(PAGE + 1, dtype=np.int64)
        starts = np.maximum(law.onsets(nominal), self._mark_index[number])
        periods = np.maximum(nominal[:-1] + self.offset, 1)
        times = np.empty(PAGE + 1, dtype=np.int64)
        times[0] = self._mark_time[number]
        np.cumsum(np.diff(starts) * periods, out=times[1:])
        times[1:] += times[0]
        if len(self._mark_index) == number + 1:
            self._mark_index.append(int(starts[-1]))
            self._mark_time.append(int(times[-1]))
        return _Page(starts, times, periods)

    def _build_block(self, number: int, count: int) -> Ticks64:
        """The times of the first pulses of a block, from all the pages that they lie on."""
        out = np.empty(count, dtype=np.int64)
        first = HEAD + number * BLOCK
        done = 0
        while done < count:
            page = _page(self, self._page_with_index(first + done))
            upto = min(count, int(page.starts[-1]) - first)
            page.write(first + done, out[done:upto])
            done = upto
        return out


@lru_cache(maxsize=PAGES_KEPT)
def _page(ramp: Ramp, number: int) -> _Page:
    return ramp._build_page(number)  # noqa: SLF001  the other half of the class, cached


@lru_cache(maxsize=BLOCKS_KEPT)
def _block(ramp: Ramp, number: int, count: int) -> Ticks64:
    return ramp._build_block(number, count)  # noqa: SLF001  as above
