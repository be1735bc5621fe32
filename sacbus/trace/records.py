"""What a recording consists of: one value for each kind of record.

Owns the types and what of them follows from what was stored. How they look as text is
``recorder.py``'s and ``reading.py``'s; times are ns of bus time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from sacbus.kernel import LineRate, Ns
from sacbus.movement import Segment

__all__ = [
    "FORMAT",
    "BusAt",
    "Changed",
    "Driven",
    "Ended",
    "FaultSet",
    "Mark",
    "Moved",
    "NodeOf",
    "Outcome",
    "Record",
    "Sent",
    "Switched",
    "Told",
    "Turned",
]

#: What this version writes and reads.
FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class NodeOf:
    """A node of a recorded bus, as it was configured; the address is its name in every record."""

    bus: int
    address: int
    kind: str
    settings: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class BusAt:
    """A recorded bus: its line and its nodes."""

    number: int
    name: str
    protocol: str
    rate: LineRate
    lanes: int
    seed: int
    nodes: tuple[NodeOf, ...]


@dataclass(frozen=True, slots=True)
class Sent:
    """A transmission, recorded when it was over.

    ``sender`` is a node's address, else the talker in words: ``mother``, ``link 1`` (in the order
    in which they were first heard), or a fault's name. ``arrived`` differs from ``data`` where it
    was damaged. ``ninth``: a 0 or 1 for each byte where the line has ninth bits, as it was sent.
    ``faults``: the names of those that acted on it; ``missed``: who was kept from hearing it, by
    address (``links``: all that are no nodes); ``heard``: what arrived at those who are set to
    another rate.
    """

    when: Ns
    bus: int
    start: Ns
    end: Ns
    lane: int
    sender: int | str
    data: bytes
    arrived: bytes
    collided: bool = False
    ninth: bytes | None = None
    faults: tuple[str, ...] = ()
    missed: tuple[int | str, ...] = ()
    heard: Mapping[int, bytes] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Told:
    """What a node, or the line (None), reported out of band: ``kind`` is the word for it."""

    when: Ns
    bus: int
    node: int | None
    kind: str
    text: str
    line: str = ""
    column: int = 0


@dataclass(frozen=True, slots=True)
class Moved:
    """How a node moves from now on."""

    when: Ns
    bus: int
    node: int
    segment: Segment


@dataclass(frozen=True, slots=True)
class Changed:
    """A node's state is another one; not stored, but worked out of how it moves."""

    when: Ns
    bus: int
    node: int
    state: str


@dataclass(frozen=True, slots=True)
class Driven:
    """An input of a node was driven to a level from outside."""

    when: Ns
    bus: int
    node: int
    pin: str
    level: int


@dataclass(frozen=True, slots=True)
class Turned:
    """A node's encoder was turned, clockwise positive."""

    when: Ns
    bus: int
    node: int
    detents: int


@dataclass(frozen=True, slots=True)
class Switched:
    """A node was switched off or on."""

    when: Ns
    bus: int
    node: int
    on: bool


@dataclass(frozen=True, slots=True)
class FaultSet:
    """A fault of the line begins or ends."""

    when: Ns
    bus: int
    name: str
    on: bool
    details: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a request of mother's, after so many attempts.

    ``result`` as a scenario has it: ``ack``, ``nak``, ``no answer``, ``unknown``, ``lost``; or
    ``sent``, to all, who do not answer.
    """

    when: Ns
    bus: int
    node: int
    body: bytes
    result: str
    attempts: int


@dataclass(frozen=True, slots=True)
class Mark:
    """A remark of whoever records: a scenario's ``mark``, or an expectation that failed.

    ``details`` of the latter: the name of its ``step``, where it has one.
    """

    when: Ns
    bus: int
    text: str
    details: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Ended:
    """The recording was closed, and nothing of it is missing."""

    when: Ns
    bus: int


Record = Sent | Told | Moved | Driven | Turned | Switched | FaultSet | Outcome | Mark | Ended
