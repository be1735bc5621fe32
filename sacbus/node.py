"""The contract between the bus and a kind of node, and the registry of kinds.

Owns the shapes in which the two meet: what a node hears (:class:`Heard`), what it can be asked
(:class:`Node`), its :class:`Terminal`, what it tells out of band (:class:`Report`), what a wire
protocol must answer (:class:`Protocol`), and how kinds are found: through entry points of the group
``sacbus.nodes``, the project's own no differently from a third party's. Time is always an argument,
in ns of bus time. Nothing here knows a particular protocol or kind.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final
from typing import Protocol as Contract

from sacbus.kernel import LineRate, Ns
from sacbus.movement import Movement, Segment

__all__ = [
    "BOOT",
    "EVERYONE",
    "GROUP",
    "Decoder",
    "Heard",
    "KindError",
    "MemoryTable",
    "MemoryValue",
    "MemoryWords",
    "Node",
    "NodeKind",
    "NodeSettings",
    "PinError",
    "Pins",
    "Protocol",
    "Report",
    "ReportKind",
    "Said",
    "Setting",
    "SettingError",
    "Snapshot",
    "Terminal",
    "find_kind",
    "kind_names",
    "kinds",
    "misfits",
    "setting_list",
    "settings_from",
]

GROUP: Final = "sacbus.nodes"

#: What :meth:`Protocol.addressed` gives when all nodes must hear.
EVERYONE: Final = None


#: The state of a node that has power and does not obey yet.
BOOT: Final = "BOOT"


@dataclass(slots=True)
class Heard:
    """Some bytes of one transmission as they arrived, with their times.

    ``data`` is what came over the wire, garbled where transmissions overlapped. Its first byte is
    number ``first`` of a transmission that started at ``start``; all its bytes follow each other
    without a pause. ``ninth`` holds a 0 or 1 for each of them where the line has ninth bits and the
    sender sent some. ``following`` is what its sender goes on with behind ``data``: a device sees
    each of these bytes begin in time, so it may take into account that they come, and when. What
    they turn out to be is heard later, if at all.
    """

    data: bytes
    start: Ns
    first: int
    rate: LineRate
    following: bytes
    ninth: bytes | None = None

    def begins(self, index: int) -> Ns:
        """When byte ``index`` of ``data`` began (its start bit)."""
        return self.start + self.rate.span(self.first + index)

    def ends(self, index: int) -> Ns:
        """When byte ``index`` of ``data`` had arrived (the end of its stop bit)."""
        return self.start + self.rate.span(self.first + index + 1)

    def begun_before(self, moment: Ns) -> int:
        """How many bytes of ``data`` began before ``moment``."""
        begun = self.rate.bytes_begun(moment - self.start) - self.first
        return min(max(begun, 0), len(self.data))


class ReportKind(Enum):
    """What a report is about; the value is the word that users see."""

    REFUSED = "refused"  #: a line, or a part of one, that the node does not understand
    IGNORED = "ignored"  #: understood, but without effect now
    MESSAGE = "message"  #: text for the node's terminal
    OVERRUN = "queue overrun"
    WARNING = "warning"  #: obeyed, but it may not be what was meant
    LOST = "lost"  #: a packet that the device loses by its nature


@dataclass(frozen=True, slots=True)
class Report:
    """Something a node says out of band: never on the wire, never an exception.

    ``address`` is the node's, None when it is about the line itself. ``line`` is the command line
    that it is about, ``column`` the place in it (from 1; 0: the whole).
    """

    when: Ns
    address: int | None
    kind: ReportKind
    text: str
    line: str = ""
    column: int = 0

    def __str__(self) -> str:
        where = f" in {self.line!r}" if self.line else ""
        place = f", column {self.column}" if self.column else ""
        who = "line" if self.address is None else f"node {self.address}"
        return f"{who}: {self.kind.value}{where}{place}: {self.text}"


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A node at one instant, for dashboards and scenarios. Positions are signed, clockwise up."""

    address: int
    kind: str
    state: str
    position_steps: float
    position_pulses: int
    rpm: float
    current: str
    pending: tuple[str, ...]
    counters: Mapping[str, int]
    #: Where the motor stands in full steps, if that can be elsewhere: it may have stalled.
    rotor_steps: float | None = None


class Terminal(Contract):
    """A node's terminal port: keys in, text out; a dumb terminal, no packets."""

    #: Takes what the port prints, at once; None while nobody is connected: what is printed is lost.
    show: Callable[[bytes], None] | None

    def type(self, keys: bytes, now: Ns) -> None:
        """Keys arrive. The owner asks the bus to touch the node afterwards (``Bus.touch``)."""
        ...


class PinError(ValueError):
    """A pin that a node does not have, or a level that it cannot have; the text is for users."""


class Pins(Contract):
    """A node's pins: inputs to drive, outputs to look at. Levels are 0 and 1."""

    @property
    def inputs(self) -> Sequence[str]:
        """Names of the pins that can be driven."""
        ...

    @property
    def outputs(self) -> Sequence[str]:
        """Names of the pins that the node drives."""
        ...

    @property
    def told(self) -> Sequence[str]:
        """The outputs whose edges a watcher is told of; pulses are too many."""
        ...

    def drive(self, pin: str, level: int, now: Ns) -> None:
        """Drive an input. PinError for what is no input, and a level that it cannot have.

        The owner asks the bus to touch the node afterwards (``Bus.touch``).
        """
        ...

    def level(self, pin: str, now: Ns) -> int:
        """The level of any pin at ``now``; PinError if there is none of that name."""
        ...

    def watch(self, watcher: Callable[[str, int, Ns], object] | None, now: Ns) -> None:
        """Have ``watcher(pin, level, when)`` called at each edge from ``now`` on; None: nobody.

        The owner asks the bus to touch the node afterwards (``Bus.touch``).
        """
        ...


class Node(Contract):
    """A device on the bus: a synchronous state machine that is told the time.

    The bus calls :meth:`hear` with bytes that may concern it, asks :meth:`wake_at` after every call
    and calls :meth:`wake` then. A node never raises for anything it hears.
    """

    @property
    def address(self) -> int:
        """The address it answers to now; another only after a wake or a touch (``Bus.touch``)."""
        ...

    @property
    def receiving(self) -> bool:
        """True while its receiver stands open: bytes that are not for it may still matter to it."""
        ...

    @property
    def terminal(self) -> Terminal | None:
        """Its terminal port, made when it is first asked for; None for kinds without one."""
        ...

    @property
    def pins(self) -> Pins | None:
        """Its pins, made when first asked for; None for a kind without any."""
        ...

    @property
    def movement(self) -> Movement | None:
        """Its motion, for who records it; made when first asked for; None for what never moves."""
        ...

    @property
    def quiet(self) -> bool:
        """True while it will send nothing until it hears something or is touched (``Bus.touch``).

        What it does then when it is woken shows nowhere but in how it looks, and whoever looks
        brings the bus up to date first. So in real time the bus may let it wait for some ms; by
        bus time it is woken as exactly as ever. What it reports then is told as late, with the
        time at which it was. Where in doubt, False: that costs a wake-up of the process each time.
        """
        ...

    def hear(self, heard: Heard, now: Ns) -> None:
        """Bytes have arrived; ``now`` is when the last of them ended."""
        ...

    def wake_at(self) -> Ns | None:
        """When the node has something to do next: an answer, a change of state; never a pulse."""
        ...

    def wake(self, now: Ns) -> bytes | None:
        """Do what is due, and give the bytes that the node begins to send at ``now``, if any.

        It may be called when nothing is due after all; then nothing happens.
        """
        ...

    def state(self, now: Ns) -> str:
        """The state that its snapshot would give at ``now``, at a fraction of the cost.

        A node that does nothing is in STANDBY, whatever its kind; one that starts and does not
        obey yet in BOOT, and wakes when that is over.
        """
        ...

    def snapshot(self, now: Ns) -> Snapshot:
        """What can be seen of it at ``now``; changes nothing."""
        ...

    def power(self, *, on: bool, now: Ns) -> None:
        """Switch it off, or on again for a cold boot; nothing if it is that already.

        Off, it forgets all but its EEPROM. The owner asks the bus to touch the node afterwards.
        """
        ...

    #: Called by the node each time the contents of its EEPROM have changed.
    memory_changed: Callable[[], None] | None

    def persist(self) -> Mapping[str, object]:
        """The contents of its EEPROM, as JSON has them. Cheap: it is asked at each change."""
        ...

    def restore(self, memory: Mapping[str, object]) -> None:
        """Start with this EEPROM, as after a cold boot. Unknown or odd values are reported."""
        ...


@dataclass(frozen=True, slots=True)
class Said:
    """What one of a decoder's events says, in a form that is every protocol's.

    ``kind``: ``packet``, ``ack``, ``nak`` (an answer to a packet) or ``garbage``, which has no
    ``source`` and no ``destination`` (0: everybody). ``data`` is a packet's body, or the garbage as
    it came. ``words`` say what it means, without addresses. ``verdict`` is what the check says:
    ``right``, ``unchecked`` (none was sent), ``wrong``, or a word of the protocol's own for what
    else is wrong; empty where nothing is to be checked. ``size``: bytes on the wire.
    ``reply_after``: how long after the end of a packet its answer begins, by the protocol's
    figures, in ns; None when nobody answers it.
    """

    kind: str
    source: int | None
    destination: int | None
    data: bytes
    words: str
    verdict: str
    size: int
    reply_after: Ns | None = None


class Decoder(Contract):
    """Bytes of a line to what they say; events are the protocol's own types. Never raises."""

    @property
    def pending(self) -> bytes:
        """The bytes that are not decided yet: a bounded number."""
        ...

    @property
    def unfinished(self) -> bool:
        """Whether what is pending may yet become a packet; noise never does."""
        ...

    def receive(self, data: bytes) -> Sequence[object]:
        """The events that these bytes complete."""
        ...

    def locate(self, data: bytes) -> Sequence[tuple[object, int, int]]:
        """As :meth:`receive`, each with the places of its first byte and behind its last.

        Places count from the first byte of ``data``; those before it are negative.
        """
        ...


class Protocol(Contract):
    """What the bus must know of a wire protocol; stateless but for its decoders."""

    @property
    def name(self) -> str:
        """As in a configuration: ``sac``."""
        ...

    @property
    def lanes(self) -> int:
        """1: everybody on one pair of wires. 2: the master talks on one, the nodes on the other."""
        ...

    @property
    def rate(self) -> LineRate:
        """The line rate that its devices leave the factory with."""
        ...

    def cuts(self, data: bytes) -> Sequence[int]:
        """Offsets at which a node may have to act before the transmission is over, ascending."""
        ...

    def addressed(self, data: bytes) -> Sequence[int] | None:
        """Addresses that these bytes open a packet for; EVERYONE when all nodes must hear."""
        ...

    def decoder(self) -> Decoder:
        """A new receiver for those who listen to everything."""
        ...

    def tell(self, event: object) -> Said:
        """What one of the decoder's events says; TypeError for anything else."""
        ...


@dataclass(frozen=True)
class NodeSettings:
    """Base of a kind's settings: a frozen dataclass, each field with ``help`` in its metadata.

    Whole numbers carry ``low`` and ``high`` there, words their ``choices``, text its ``form`` in
    words and the ``pattern`` that it matches; flags need no more.
    ``given`` names those that somebody asked for, as opposed to defaults: they win over memory.
    """

    given: frozenset[str] = field(default=frozenset(), init=False, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class MemoryValue:
    """One value of a memory, for people. ``key``: what sets it. ``factory``: None if it is that."""

    key: str
    name: str
    value: str
    meaning: str
    factory: str | None


@dataclass(frozen=True, slots=True)
class MemoryTable:
    """A part of a memory that has rows, each with a cell for every column."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class MemoryWords:
    """A node's memory in words; ``remarks`` are sentences about values that no node would take."""

    values: tuple[MemoryValue, ...]
    tables: tuple[MemoryTable, ...] = ()
    remarks: tuple[str, ...] = ()


class NodeKind(Contract):
    """A kind of node, as an entry point of the group ``sacbus.nodes`` gives it."""

    @property
    def name(self) -> str:
        """The word after ``--kind``."""
        ...

    @property
    def summary(self) -> str:
        """One line for people."""
        ...

    @property
    def protocol(self) -> Protocol:
        """The protocol its nodes speak."""
        ...

    @property
    def settings(self) -> type[NodeSettings]:
        """The settings that a configuration may give."""
        ...

    def create(
        self,
        address: int,
        settings: Any,  # noqa: ANN401 (an instance of the kind's own settings)
        rate: LineRate,
        tell: Callable[[Report], None],
    ) -> Node:
        """A new node with factory memory; ``tell`` takes what it reports out of band."""
        ...

    def shape(self, stored: Mapping[str, Any]) -> object:
        """What segments of motion have in common, as nodes of this kind told it; read once for all.

        LookupError, TypeError or ValueError for what none of them tells.
        """
        ...

    def segment(
        self,
        since: Ns,
        shape: Any,  # noqa: ANN401 (what the kind's own ``shape`` gave)
        values: Mapping[str, Any],
    ) -> Segment:
        """What a node of this kind told of its motion at ``since``; errors as in :meth:`shape`."""
        ...

    def memory_words(self, memory: Mapping[str, object], address: int | None) -> MemoryWords:
        """What :meth:`Node.persist` gave, in words. ``address``: the configured one, if known."""
        ...


class KindError(LookupError):
    """A node kind that is not installed, or that could not be loaded. The text is for users."""


def kinds() -> dict[str, NodeKind]:
    """All installed kinds by name, sorted. A broken one raises :class:`KindError` naming it."""
    entries = sorted(entry_points(group=GROUP), key=lambda entry: entry.name)
    return {entry.name: _load(entry) for entry in entries}


def kind_names() -> list[str]:
    """The names of all installed kinds, sorted; none of them is loaded."""
    return sorted({entry.name for entry in entry_points(group=GROUP)})


def find_kind(name: str) -> NodeKind:
    """The kind of that name; :class:`KindError` says which there are."""
    found = entry_points(group=GROUP)
    for entry in found:
        if entry.name == name:
            return _load(entry)
    have = ", ".join(kind_names()) or "none: is sacbus installed?"
    raise KindError(f"node kind {name!r} is not installed; installed kinds: {have}")


def _load(entry: EntryPoint) -> NodeKind:
    try:
        kind: NodeKind = entry.load()
    except Exception as fault:  # a third party's import may fail in any way; we name it and pass on
        raise KindError(
            f"node kind {entry.name!r} ({entry.value}) cannot be loaded: {fault!r}; "
            "mend or uninstall its package"
        ) from fault
    return kind


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of a kind, for help texts: its name, default, what is allowed, what it means."""

    name: str
    default: object
    allowed: str
    help: str


class SettingError(ValueError):
    """A setting that a kind does not take: which, what was expected, what came."""


def setting_list(model: type[NodeSettings]) -> list[Setting]:
    """The settings of a kind in the order of their declaration."""
    return [
        Setting(one.name, one.default, _allowed(one.metadata, one.default), one.metadata["help"])
        for one in _fields(model)
    ]


def settings_from(model: type[NodeSettings], given: Mapping[str, object]) -> NodeSettings:
    """Settings checked against their model; SettingError for the first that does not fit."""
    for name, expected in misfits(model, given).items():
        known = any(name == one.name for one in _fields(model))
        got = f", got {given[name]!r}" if known else ""
        raise SettingError(f"setting {name!r}: expected {expected}{got}")
    settings = model(**given)
    object.__setattr__(settings, "given", frozenset(given))
    return settings


def misfits(model: type[NodeSettings], given: Mapping[str, object]) -> dict[str, str]:
    """Every given setting that its model does not take, in order, with what was expected."""
    fields = {one.name: one for one in _fields(model)}
    found: dict[str, str] = {}
    for name, value in given.items():
        known = fields.get(name)
        if known is None:
            found[name] = f"one of {', '.join(fields)}"
        elif not _fits(known.metadata, known.default, value):
            found[name] = _allowed(known.metadata, known.default)
    return found


def _fields(model: type[NodeSettings]) -> list[dataclasses.Field[Any]]:
    """The fields that are settings; ``Any``: of whatever type each is."""
    return [one for one in dataclasses.fields(model) if one.name != "given"]


def _fits(metadata: Mapping[str, Any], default: object, value: object) -> bool:
    if "choices" in metadata:
        return value in metadata["choices"]
    if "pattern" in metadata:
        return isinstance(value, str) and re.fullmatch(metadata["pattern"], value) is not None
    if isinstance(default, bool) or isinstance(value, bool):
        return isinstance(default, bool) and isinstance(value, bool)
    return isinstance(value, int) and metadata["low"] <= value <= metadata["high"]


def _allowed(metadata: Mapping[str, Any], default: object) -> str:
    if "choices" in metadata:
        return " or ".join(metadata["choices"])
    if "form" in metadata:
        return str(metadata["form"])
    if isinstance(default, bool):
        return "true or false"
    return f"a whole number from {metadata['low']} to {metadata['high']}"
