"""A two-wire adapter hears what it says: one's own bytes, taken out of what is heard.

Owns telling own bytes from foreign ones, and counting those that came back changed. Synchronous;
time is an argument, in ns of any clock.

Theory of operation. What has been sent and not come back is expected, as *runs*: bytes that follow
each other on the line without a gap, so that nobody else can be heard between them. Before a run
there may be foreign bytes, that were on their way while we began; so the beginning of a run is
looked for as `ANCHOR` bytes in a row. From there on heard and expected bytes go side by side. Where
they differ, somebody else was talking. Usually the byte was changed and the next fits again; a
receiver may also have lost a byte or made one up, so the nearest way on is looked for that makes
the next `ANCHOR` bytes fit: so many heard bytes for so many expected ones, up to `SLIP` each. Where
there is none the byte was changed, and the next is looked at.

Bytes about which that cannot be told yet are held until more come. They are not held for long: an
echo that is `GRACE` late never comes, and then everything held is settled; so is what a run ended
with. No error outlasts its run. What is foreign comes out in its order, unchanged; two readings
are possible when foreign bytes look like the beginning of a run, and then the earliest counts.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

__all__ = ["BOUND", "GRACE", "Echo"]

#: Nanoseconds after the last bit at which an echo must have been heard: a USB adapter keeps bytes
#: for 16 ms, and a busy machine may be as late again. Less than mother waits for an answer.
GRACE: Final = 50_000_000

#: Bytes expected at the most; what a link takes before it drops, twice.
BOUND: Final = 131_072

#: Bytes in a row that are no coincidence: 1 in 2^32, were they random.
ANCHOR: Final = 4

#: How many bytes at one place a receiver may lose or make up, for its echo to be followed.
SLIP: Final = 4

#: Heard and expected bytes that one step past a difference may take, the likeliest first: a byte
#: was changed, lost, made up; two were changed, and so on.
_WAYS: Final = sorted(
    (
        (heard, expected)
        for heard in range(SLIP + 1)
        for expected in range(SLIP + 1)
        if heard or expected
    ),
    key=lambda way: (max(way), abs(way[0] - way[1]), way),
)


@dataclass(slots=True)
class _Run:
    """Own bytes without a gap between them that have not come back, and until when they may."""

    rest: bytearray
    due: int
    found: bool = False
    """Whether its beginning has been heard."""


class Echo:
    """What is heard without what is said, on a line on which a byte takes ``byte_ns``."""

    def __init__(self, byte_ns: int, *, grace_ns: int = GRACE) -> None:
        self._byte_ns = byte_ns
        self._grace_ns = grace_ns
        self._runs: deque[_Run] = deque()
        self._expected = 0
        self._held = bytearray()
        self._line_free = 0  # when the last byte that was sent has left
        #: Own bytes that came back changed.
        self.collisions = 0
        #: Own bytes that never came back.
        self.missing = 0
        #: Runs one after the other, up to now, of which nothing came back.
        self.unheard = 0

    @property
    def due(self) -> int | None:
        """When :meth:`settle` is to be called, if nothing is heard; None while there is no need."""
        return self._runs[0].due if self._runs else None

    def sent(self, data: bytes, now: int) -> None:
        """These bytes were given to the port, and will come back."""
        if not data:
            return
        if self._expected + len(data) > BOUND:
            # More than could be on its way: what is heard later is foreign, not the echo of this.
            self.missing += self._expected
            self._runs.clear()
            self._expected = 0
            data = data[-BOUND:]
        if not self._runs or now > self._line_free:
            self._runs.append(_Run(bytearray(), 0))
        self._line_free = max(now, self._line_free) + len(data) * self._byte_ns
        run = self._runs[-1]
        run.rest += data
        run.due = self._line_free + self._grace_ns
        self._expected += len(data)

    def heard(self, data: bytes) -> bytes:
        """What of this, and of what was held, is foreign for certain; may be empty."""
        if not self._runs and not self._held:
            return data
        self._held += data
        foreign = self._sift()
        return foreign + self.forget() if len(self._held) > BOUND else foreign

    def settle(self, now: int) -> bytes:
        """Give up the echoes that are due; what is foreign without them."""
        foreign = bytearray()
        while self._runs and self._runs[0].due <= now:
            run = self._runs[0]
            # Either all of a short run came back changed, or what came has nothing to do with it.
            run.found |= len(self._held) == len(run.rest) and len(self._runs) == 1
            if run.found:
                pairs = min(len(self._held), len(run.rest))
                self._step(run, pairs, pairs, foreign)
            self.unheard = 0 if run.found else self.unheard + 1
            self._give_up(run)
            foreign += self._sift()
        return bytes(foreign)

    def forget(self) -> bytes:
        """The line is gone: expect nothing any more; what was held, and came from others."""
        while self._runs:
            self._give_up(self._runs[0])
        return self._sift()

    def _give_up(self, run: _Run) -> None:
        self.missing += len(run.rest)
        self._expected -= len(run.rest)
        self._runs.popleft()

    def _sift(self) -> bytes:
        """Compare what is held with what is expected, as far as that leads now."""
        foreign = bytearray()
        while self._runs and self._held:
            run = self._runs[0]
            if not (self._follow(run, foreign) if run.found else self._find(run, foreign)):
                break
            if not run.rest:
                self._runs.popleft()
                self.unheard = 0
        if not self._runs:
            foreign += self._held
            self._held.clear()
        return bytes(foreign)

    def _find(self, run: _Run, foreign: bytearray) -> bool:
        """Look for the run's beginning; False if more must be heard first."""
        held = self._held
        at = held.find(run.rest[:ANCHOR])
        if at >= 0:
            foreign += held[:at]
            del held[:at]
            run.found = True
            return True
        if any(run.rest.startswith(held[-count:]) for count in range(1, ANCHOR)):
            return False  # it may have begun right now
        # Changed in its very first bytes, with enough behind them to know it by.
        for expected in range(1, SLIP + 1):
            mark = run.rest[expected : expected + ANCHOR]
            at = held.find(mark) if len(mark) > 1 else -1
            # With less than an anchor to go by, only as many bytes as were sent are an echo.
            if at >= (0 if len(mark) == ANCHOR else expected):
                self._step(run, at, expected, foreign)
                run.found = True
                return True
        return False

    def _follow(self, run: _Run, foreign: bytearray) -> bool:
        """Go on side by side; False if more must be heard first."""
        held, rest = self._held, run.rest
        same = _common(held, rest)
        if same:
            self._take(run, same, same)
            return True
        for heard, expected in _WAYS:  # at the latest, one takes all that is expected
            mark = rest[expected : expected + ANCHOR]
            found = held[heard : heard + len(mark)]
            if len(held) < heard or (found != mark and mark.startswith(found)):
                return False
            if found == mark:
                self._step(run, heard, expected, foreign)
                return True
        self._step(run, 1, 1, foreign)
        return True

    def _step(self, run: _Run, heard: int, expected: int, foreign: bytearray) -> None:
        """Take so many heard bytes for so many expected ones; made-up ones are foreign."""
        made_up = max(heard - expected, 0)
        foreign += self._held[:made_up]
        del self._held[:made_up]
        pairs = heard - made_up
        self.collisions += sum(
            one != other for one, other in zip(self._held[:pairs], run.rest[:pairs], strict=True)
        )
        self.missing += expected - pairs
        self._take(run, pairs, expected)

    def _take(self, run: _Run, heard: int, expected: int) -> None:
        del self._held[:heard]
        del run.rest[:expected]
        self._expected -= expected


def _common(one: bytearray, other: bytearray) -> int:
    """How many bytes the two begin with in common."""
    most = min(len(one), len(other))
    if one[:most] == other[:most]:
        return most
    return next(at for at in range(most) if one[at] != other[at])
