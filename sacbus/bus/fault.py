"""A fault of the line: what it is, its being on a medium, and the chance in it.

Owns the contract of faults, their count and their randomness: each that is put on a medium has a
generator of its own, made of the medium's seed and of how many were put on before it, so that one
fault more shifts nothing in the others.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log, log1p
from random import Random
from typing import TYPE_CHECKING, Final
from typing import Protocol as Contract

from sacbus.bus.passage import Passage
from sacbus.kernel import Ns

if TYPE_CHECKING:
    from sacbus.bus.medium import Medium

__all__ = ["Fault", "FaultError", "FaultOn", "Gaps", "Strike", "checked_rate"]

Strike = Callable[[Passage], None]
"""What a fault does to each transmission that begins while it is on."""


class FaultError(ValueError):
    """A fault that cannot be: which, what was expected, what came. The text is for users."""

    def __init__(self, key: str, expected: str, got: object) -> None:
        came = "nothing" if got is None else repr(got)
        super().__init__(f"fault {key!r}: expected {expected}, got {came}")
        self.key = key
        self.expected = expected
        self.got = got


class Fault(Contract):
    """A fault as a value: it may be put on any number of media, any number of times."""

    @property
    def name(self) -> str:
        """The word for it in scenarios and traces."""
        ...

    def put_on(self, on: FaultOn) -> Strike | None:
        """Begin on the medium of ``on``; what is given, if anything, strikes transmissions."""
        ...


class FaultOn:
    """A fault that is on a medium, until it is taken :meth:`off`.

    ``count`` is how often it has acted: bits inverted, bytes dropped, and so on, as each fault
    says. ``since`` is when it was put on (ns of bus time). ``through`` has things done at the right
    bus time, where that is somebody's clock.
    """

    __slots__ = ("_through", "count", "fault", "is_on", "medium", "random", "since", "strike")

    def __init__(
        self,
        fault: Fault,
        medium: Medium,
        number: int,
        through: Callable[[Callable[[], object]], object],
    ) -> None:
        self.fault = fault
        self.medium = medium
        self.count = 0
        self.random = Random(f"{medium.seed} {number}")
        self.since: Ns = medium.kernel.now
        self.is_on = True
        self._through = through
        self.strike = fault.put_on(self)

    @property
    def name(self) -> str:
        """The fault's."""
        return self.fault.name

    def off(self) -> None:
        """Take it off the line now. What has begun under it ends under it. Idempotent."""
        self._through(self._end)

    def acts(self, passage: Passage, times: int = 1) -> None:
        """Count it, and have the transmission show it."""
        self.count += times
        passage.mark(self.fault.name)

    def _end(self) -> None:
        if self.is_on:
            self.is_on = False
            self.medium.drop_fault(self)


#: Beyond what any run reaches: the gap of a rate so small that nothing is ever struck.
_NEVER: Final = 2**62


class Gaps:
    """Which of many things in a row are struck when each is with the same probability ``rate``.

    Drawn as the distances between those that are, so what is not struck costs next to nothing.
    """

    __slots__ = ("_left", "_random", "_rate")

    def __init__(self, rate: float, random: Random) -> None:
        self._rate = rate
        self._random = random
        #: Things that pass before the next that is struck.
        self._left = self._gap()

    def among(self, count: int) -> list[int]:
        """The indices of those that are struck of the next ``count`` things."""
        if self._left >= count:
            self._left -= count
            return []
        found = []
        place = self._left
        while place < count:
            found.append(place)
            place += 1 + self._gap()
        self._left = place - count
        return found

    def _gap(self) -> int:
        if self._rate >= 1:
            return 0
        # random() is less than 1, so the logarithm is of more than 0.
        return int(min(log(1 - self._random.random()) / log1p(-self._rate), _NEVER))


def checked_rate(key: str, rate: float) -> None:
    """FaultError unless it is a probability over 0."""
    if not 0 < rate <= 1:
        raise FaultError(key, "a probability over 0, up to 1", rate)
