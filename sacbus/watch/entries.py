"""What the monitor has to tell: one value an entry.

Owns their shapes, and which of them tell of a fault or concern a node. Times in ns of the time that
the bytes were given in.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import assert_never

from sacbus.kernel import Ns
from sacbus.node import Report, ReportKind, Said

__all__ = [
    "Collision",
    "Entry",
    "Lost",
    "Part",
    "Reported",
    "Spoken",
    "Unanswered",
    "concerns",
    "is_fault",
]


@dataclass(frozen=True, slots=True)
class Spoken:
    """A packet, an answer, or garbage; ``raw`` are its bytes as they came.

    ``gap``: silence before it on its lane; None when nobody knows what was before. ``sender`` in
    words, where that is known. ``request``: what an answer answers; ``delay``: from the request's
    end to the answer's first bit, None when that is not known. ``late``: it came after its request
    had been told as unanswered.
    """

    start: Ns
    end: Ns
    gap: Ns | None
    lane: int
    sender: str | None
    said: Said
    raw: bytes
    request: Spoken | None = None
    delay: Ns | None = None
    late: bool = False


@dataclass(frozen=True, slots=True)
class Unanswered:
    """At ``time`` the answer to ``request`` is overdue."""

    time: Ns
    request: Spoken


@dataclass(frozen=True, slots=True)
class Part:
    """What one of those who talked at the same time said, as it arrived."""

    start: Ns
    sender: str
    node: int | None
    raw: bytes


@dataclass(frozen=True, slots=True)
class Collision:
    """Two or more talked at the same time, from ``start`` to ``end``; in the order of beginning."""

    start: Ns
    end: Ns
    gap: Ns | None
    lane: int
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Reported:
    """A node, or the line, reported something out of band."""

    report: Report


@dataclass(frozen=True, slots=True)
class Lost:
    """The monitor itself was too slow for the feed: so many of its lines are missing here."""

    lines: int


Entry = Spoken | Unanswered | Collision | Reported | Lost


def is_fault(entry: Entry) -> bool:
    """Whether something went wrong: on the line, in a node, or with the monitor itself."""
    match entry:
        case Spoken(said=said, late=late):
            return (
                late
                or said.kind in ("nak", "garbage")
                or said.verdict not in ("", "right", "unchecked")
            )
        case Reported(report):
            return report.kind is not ReportKind.MESSAGE
        case Unanswered() | Collision() | Lost():
            return True
        case _:
            assert_never(entry)


def concerns(entry: Entry, nodes: Collection[int]) -> bool:
    """Whether it is about one of these nodes: from it, to it, to everybody; or about nobody knows.

    Garbage may have been anybody's. A collision is left out only if all who took part are other
    nodes.
    """
    match entry:
        case Spoken(said=said) | Unanswered(request=Spoken(said=said)):
            return (
                said.source is None
                or said.source in nodes
                or said.destination in nodes
                or said.general
            )
        case Collision(parts=parts):
            return any(part.node is None or part.node in nodes for part in parts)
        case Reported(report):
            return report.address is None or report.address in nodes
        case Lost():
            return True
        case _:
            assert_never(entry)
