"""What has passed on a line lately, and who wants to be told of it.

Owns the tail that failures are told with, and how a transmission reads in one line. Bounded: what
is older is forgotten.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from sacbus.kernel import SECOND, Ns
from sacbus.node import MASTER, Protocol, Said

__all__ = ["Line", "Passed"]

#: Transmissions that are kept: four exchanges with their answers.
KEPT: Final = 8


@dataclass(slots=True)
class Passed:
    """A transmission that is over: from ``start`` to ``end``, ``data`` as it arrived.

    ``sender``: a node's address or who it was in words. ``collided``: another one overlapped it.
    """

    start: Ns
    end: Ns
    lane: int
    sender: int | str
    data: bytes
    collided: bool = False
    #: The faults that acted on it.
    faults: tuple[str, ...] = ()
    #: A 0 or 1 for each byte, where that is known.
    ninth: bytes | None = None


class Line:
    """The tail of a line, and its watchers: called with each :class:`Passed`."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol
        self.watchers: list[Callable[[Passed], None]] = []
        #: The last that has passed, oldest first.
        self.tail: deque[Passed] = deque(maxlen=KEPT)

    def note(self, passed: Passed) -> None:
        """A transmission is over."""
        self.tail.append(passed)
        for watcher in tuple(self.watchers):
            watcher(passed)

    def words(self, origin: Ns) -> tuple[str, ...]:
        """The tail, oldest first, one line each; times since ``origin``."""
        return tuple(self._words(one, origin) for one in self.tail)

    def _words(self, passed: Passed, origin: Ns) -> str:
        protocol = self.protocol
        events = protocol.decoder(passed.lane).receive(passed.data, passed.ninth)
        said = "; ".join(_said(protocol.tell(event)) for event in events)
        hit = "".join(f", {one}" for one in (*passed.faults, *["collided"][: passed.collided]))
        raw = passed.data[:24].hex(" ") or "nothing"
        when = f"{(passed.start - origin) / SECOND:.6f} s"
        return f"{when}  {passed.sender}: {said or raw}{hit}"


def _said(said: Said) -> str:
    if said.kind == "garbage":
        return f"garbage {said.data[:24].hex(' ')}"
    verdict = "" if said.verdict in ("right", "") else f", CRC {said.verdict}"
    where = "all" if said.general else "master" if said.destination == MASTER else said.destination
    if said.kind == "packet":
        return f"to {where} {said.body!r}, {said.words}{verdict}"
    # An answer may bring something: what was read, or what its sender has seen of the line.
    return f"{said.words} to {where}{verdict}"
