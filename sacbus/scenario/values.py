"""What a scenario is made of, as values: buses, steps, and what each step does.

The same values are read from TOML (``reading.py``) and written in plain Python::

    Scenario(
        "two axes",
        (Configuration(nodes=(10, 11)),),
        (
            Step(Send(("10m400v120s", "11m400v120s"))),
            Step(Send(("0y",))),
            Step(NodeIs((10, 11), position=Bounds.exactly(400), within=5 * SECOND)),
        ),
    )

Times in ns of bus time since the nodes had booted. Nothing here is checked (``rules.py`` does) or
opened.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sacbus.bus import Fault
from sacbus.configuration import Configuration
from sacbus.kernel import Ns
from sacbus.scenario.expectations import Expectation

__all__ = [
    "Deed",
    "Disturb",
    "Lift",
    "Mark",
    "Outcome",
    "Pause",
    "Pin",
    "Poll",
    "Power",
    "Raw",
    "Scenario",
    "Send",
    "Step",
    "Turn",
    "Type",
]

#: What may become of a line that mother sends: ``ack``, ``nak``, ``no answer``, ``unknown``.
Outcome = str


@dataclass(frozen=True, slots=True)
class Send:
    """The bus's master sends lines one after the other, with retries: ``10m400``, ``3 stop``.

    Lines are in that master's words. Over when the last one's outcome is known. ``outcome``: what
    each must come to; ``any`` for no matter what. ``accept_duplicates``: repeat after silence even
    what may then run twice. ``says``: what each answer must say, in the words of that master, if it
    has any: ``at rest``, ``66 (0x42)``, ``ACK``.
    """

    lines: tuple[str, ...]
    outcome: Outcome = "ack"
    accept_duplicates: bool = False
    bus: str = ""
    says: str | None = None


@dataclass(frozen=True, slots=True)
class Poll:
    """The bus's master sends the lines in turn, one each ``every``, for ``lasting``, or to the end.

    A line whose time comes before the one before it is settled follows when that is.
    """

    lines: tuple[str, ...]
    every: Ns
    lasting: Ns | None = None
    outcome: Outcome = "ack"
    bus: str = ""


@dataclass(frozen=True, slots=True)
class Raw:
    """Bytes as they are, by mother's own port, without a transaction. Over when they are out.

    ``ninth``: a 0 or 1 for each, which a line without ninth bits leaves out; None: 0.
    """

    data: bytes
    bus: str = ""
    ninth: bytes | None = None


@dataclass(frozen=True, slots=True)
class Type:
    """Keys at the terminals of nodes, all at one instant; CR ends a line."""

    nodes: tuple[int, ...]
    keys: str
    bus: str = ""


@dataclass(frozen=True, slots=True)
class Pin:
    """Inputs of nodes driven to levels, all at one instant; xclk to a frequency in Hz."""

    nodes: tuple[int, ...]
    levels: Mapping[str, int]
    bus: str = ""


@dataclass(frozen=True, slots=True)
class Turn:
    """The encoders of nodes turned by detents, clockwise positive."""

    nodes: tuple[int, ...]
    detents: int
    bus: str = ""


@dataclass(frozen=True, slots=True)
class Power:
    """Nodes switched off, or on again for a cold boot."""

    nodes: tuple[int, ...]
    on: bool
    bus: str = ""


@dataclass(frozen=True, slots=True)
class Disturb:
    """A fault of the line put on; it stays until it is lifted, or to the end."""

    fault: Fault
    bus: str = ""


@dataclass(frozen=True, slots=True)
class Lift:
    """The faults taken off that steps of the name ``step`` have put on."""

    step: str


@dataclass(frozen=True, slots=True)
class Pause:
    """Nothing: what a step does that only waits."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A remark in the recording."""

    text: str


Deed = Send | Poll | Raw | Type | Pin | Turn | Power | Disturb | Lift | Pause | Mark | Expectation


@dataclass(frozen=True, slots=True)
class Step:
    """Something that is done or expected, and when.

    It begins at ``at``; or when ``after``, which is a step's name or something that is waited for,
    is over; or else when the step above it is over. ``wait`` is how much later. Steps that begin on
    their own do not keep others waiting but those below them. ``place``: where it stands, for
    whoever reads of it.
    """

    does: Deed
    name: str = ""
    at: Ns | None = None
    after: str | Expectation | None = None
    wait: Ns = 0
    place: str = ""


@dataclass(frozen=True, slots=True)
class Scenario:
    """Buses, what is done to them and what is expected.

    ``end``: when it ends, with what is not over by then failed; None: when all steps are over.
    ``case``: the values of the parameters that make several cases of it, by name; ``parameters``:
    of all. ``file``: where it comes from.
    """

    title: str
    buses: tuple[Configuration, ...]
    steps: tuple[Step, ...]
    end: Ns | None = None
    case: Mapping[str, object] = field(default_factory=dict)
    file: str = ""
    parameters: Mapping[str, object] = field(default_factory=dict)
