"""When a node that runs its queue is where: commands one after the other, by what was planned.

Owns the walk through them, and the two bounds between which a planned instant lies by mother's
clock: a node starts somewhen between the sending of a line and its ACK, and its oscillator drifts.
How a command begins after another is ``sacbus.motion``'s.
Source: spec, mother ("G-code": node clocks drift and the depth of a queue cannot be asked).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from sacbus.kernel import MS, US, Ns
from sacbus.language import Motion
from sacbus.mother.errors import BadRequest
from sacbus.motion import REST, TICKS_PER_US, Drive, Left, begin, plan

__all__ = [
    "DRIFT_PPM",
    "MARGIN",
    "Departure",
    "NotStreamable",
    "Timeline",
    "Times",
    "check_streamed",
]

#: By how much a node's oscillator may be off, in parts in a million, and what a planned time has
#: besides: loading, and how late a line may bring what mother sent.
DRIFT_PPM: Final = 500
MARGIN: Final[Ns] = 5 * MS

_PPM: Final = 1_000_000


class NotStreamable(BadRequest):
    """A command that cannot stand among those whose times are planned. what; remedy: words."""

    def __init__(self, what: str, remedy: str) -> None:
        self.what, self.remedy = what, remedy
        super().__init__(f"{what}, {remedy}")


class Times(NamedTuple):
    """Of one command, ns of the node's own time from the first one's loading.

    loaded: from when on its place in the queue may be written over. start: its first pulse. end:
    when its last period has run out.
    """

    loaded: Ns
    start: Ns
    end: Ns


class Timeline:
    """Commands that a node runs one after the other, beginning at rest.

    ``gap``: whether a kept velocity is lost when the next command comes too late (G toggles it).
    """

    def __init__(self, drive: Drive, *, gap: bool = True) -> None:
        self._drive = drive
        self._gap = gap
        self._left: Left = REST
        self._end = 0

    @property
    def end(self) -> Ns:
        """When the last command ends."""
        return self._end * US // TICKS_PER_US

    def add(self, motion: Motion) -> Times:
        """The next command; :class:`NotStreamable` as of :func:`check_streamed`."""
        check_streamed(motion)
        beginning = begin(motion, self._left, self._end, gap=self._gap)
        profile = plan(motion, self._drive, beginning.start_rpm)
        assert profile.duration is not None, "a command with steps ends"
        self._left = Left.by(profile)
        self._end = beginning.start + profile.duration
        return Times(
            beginning.loaded * US // TICKS_PER_US, beginning.start * US // TICKS_PER_US, self.end
        )

    def halt(self) -> None:
        """The node has been stopped after all of them: time begins anew, at rest."""
        self._left = Left(ramps=self._left.ramps)
        self._end = 0


def check_streamed(motion: Motion) -> None:
    """:class:`NotStreamable` for a command after which nobody knows when the next one begins."""
    if motion.steps is None:
        raise NotStreamable(
            "a continuous command cannot be streamed: it never ends", "give it steps"
        )
    if motion.sync:
        raise NotStreamable(
            "a command that is held for sync cannot be streamed: nobody knows when it is released",
            "take its sync out",
        )


@dataclass(frozen=True, slots=True)
class Departure:
    """When a node began, by mother's clock: between ``earliest`` and ``latest``."""

    earliest: Ns
    latest: Ns
    drift_ppm: int = DRIFT_PPM

    def not_before(self, time: Ns) -> Ns:
        """The first moment by mother's clock at which the node may be so far."""
        return self.earliest + time - time * self.drift_ppm // _PPM

    def surely_by(self, time: Ns) -> Ns:
        """The moment by mother's clock from which on the node is so far for certain."""
        return self.latest + time + time * self.drift_ppm // _PPM + MARGIN
