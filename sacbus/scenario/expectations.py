"""What can be expected of a bus: values with their bounds, and how each reads in a sentence.

Owns the meaning of an expectation, not the looking: ``judges.py`` does that. Positions in full
steps, clockwise up; velocities in RPM; times in ns of bus time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from sacbus.bus.duration import time_text
from sacbus.config.notation import ranges
from sacbus.kernel import Ns
from sacbus.scenario.quantity import Bounds

__all__ = [
    "COUNTS",
    "Counted",
    "Expectation",
    "NodeIs",
    "PacketSeen",
    "Shown",
    "Silent",
    "Straight",
    "Together",
    "count_words",
]

#: What is counted from the beginning of a scenario on, and where.
COUNTS: Final = ("retries", "naks", "acks", "timeouts", "collisions", "warnings")

#: A velocity that is given as one number is met by what differs by less than this: cycles are
#: whole microseconds, so 130 RPM are 130.04.
VELOCITY_SLACK: Final = 0.5


@dataclass(frozen=True, slots=True)
class NodeIs:
    """All ``nodes`` are like this at one instant: now, or within ``within`` from now.

    With ``lasting`` they are so from now on for that long. What is None is not looked at. ``pins``:
    levels by the names of the pins.
    """

    nodes: tuple[int, ...]
    position: Bounds | None = None
    velocity: Bounds | None = None
    state: str | None = None
    pins: Mapping[str, int] = field(default_factory=dict)
    within: Ns = 0
    lasting: Ns = 0
    bus: str = ""

    def __str__(self) -> str:
        wanted = []
        if self.position is not None:
            wanted.append(f"position {self.position}")
        if self.velocity is not None:
            wanted.append(f"velocity {self.velocity}")
        if self.state is not None:
            wanted.append(f"state {self.state}")
        wanted += [f"{pin} {level}" for pin, level in self.pins.items()]
        return f"{_nodes(self.nodes)}: {', '.join(wanted)}{_when(self.within, self.lasting)}"


@dataclass(frozen=True, slots=True)
class PacketSeen:
    """``count`` packets or answers within ``within``, each of which all that is given here fits.

    ``kind``: ``packet``, ``ack``, ``nak`` or ``garbage``. ``body``: the whole body; ``pattern``: a
    regular expression that the body as text (latin-1) must match as a whole.
    """

    kind: str = "packet"
    body: bytes | None = None
    pattern: str | None = None
    source: int | None = None
    destination: int | None = None
    count: int = 1
    within: Ns = 0
    bus: str = ""

    def __str__(self) -> str:
        one = self.kind if self.count == 1 else f"{self.count} of {self.kind}"
        if self.body is not None:
            one += f" {self.body.decode('latin-1')!r}"
        if self.pattern is not None:
            one += f" like {self.pattern!r}"
        if self.source is not None:
            one += f" from {self.source}"
        if self.destination is not None:
            one += f" to {self.destination}"
        return one + _when(self.within)


@dataclass(frozen=True, slots=True)
class Silent:
    """Nothing on the line for ``lasting`` from now on; with ``source``: nothing of that node."""

    lasting: Ns
    source: int | None = None
    bus: str = ""

    def __str__(self) -> str:
        who = "" if self.source is None else f" of node {self.source}"
        return f"silence{who} for {time_text(self.lasting)}"


@dataclass(frozen=True, slots=True)
class Counted:
    """Counts since the beginning of the scenario, of one node's or of all, within these bounds.

    ``counts``: bounds by the names of :data:`COUNTS`. Retries, NAKs, ACKs and time-outs are
    mother's, collisions the line's. Warnings are what nodes and line report of lines refused, of
    queues overrun, and of what may not be as it was meant.
    """

    counts: Mapping[str, Bounds]
    nodes: tuple[int, ...] | None = None
    within: Ns = 0
    lasting: Ns = 0
    bus: str = ""

    def __str__(self) -> str:
        who = "" if self.nodes is None else f"{_nodes(self.nodes)}: "
        wanted = ", ".join(f"{name} {wanted}" for name, wanted in self.counts.items())
        return f"{who}{wanted}{_when(self.within, self.lasting)}"


@dataclass(frozen=True, slots=True)
class Shown:
    """A node's terminal shows ``text``, within ``within`` from now.

    What it has shown since the last such expectation of the node, or the beginning, counts.
    """

    node: int
    text: str
    within: Ns = 0
    bus: str = ""

    def __str__(self) -> str:
        return f"terminal of node {self.node} shows {self.text!r}{_when(self.within)}"


@dataclass(frozen=True, slots=True)
class Together:
    """The last motions of ``nodes`` started within ``most`` ns of each other, by first pulses."""

    nodes: tuple[int, ...]
    most: Ns
    bus: str = ""

    def __str__(self) -> str:
        return f"{_nodes(self.nodes)}: start skew at most {time_text(self.most)}"


@dataclass(frozen=True, slots=True)
class Straight:
    """In their last motion ``nodes``, as axes, kept within ``most`` full steps of a straight line.

    The line is that from where they stood before its first pulse to where they stand now.
    """

    nodes: tuple[int, ...]
    most: float
    bus: str = ""

    def __str__(self) -> str:
        return f"{_nodes(self.nodes)}: deviation at most {self.most:g} steps"


Expectation = NodeIs | PacketSeen | Silent | Counted | Shown | Together | Straight


def count_words(counts: Mapping[str, int]) -> str:
    """``retries 2, naks 0``."""
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def _nodes(nodes: tuple[int, ...]) -> str:
    return f"node {nodes[0]}" if len(nodes) == 1 else f"nodes {ranges(nodes)}"


def _when(within: Ns, lasting: Ns = 0) -> str:
    if lasting:
        return f" for {time_text(lasting)}"
    return f" within {time_text(within)}" if within else ""
