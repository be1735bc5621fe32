"""Kinds of node: what one must give, and how they are found.

Owns the contract of a kind and the registry: entry points of the group ``sacbus.nodes``, the
project's own no differently from a third party's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final, runtime_checkable
from typing import Protocol as Contract

from sacbus.kernel import LineRate, Ns
from sacbus.movement import Segment

from .contract import Node, Report
from .protocol import Protocol
from .settings import NodeSettings

__all__ = [
    "GROUP",
    "KindError",
    "MemoryTable",
    "MemoryValue",
    "MemoryWords",
    "NodeKind",
    "PolyglotKind",
    "find_kind",
    "find_protocol",
    "kind_names",
    "kinds",
    "protocols_of",
    "spoken_by",
]

GROUP: Final = "sacbus.nodes"


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
        """The protocol its nodes speak when their settings are the defaults."""
        ...

    @property
    def drawn(self) -> Mapping[str, int]:
        """The inputs that pictures of a node show, each with its level while nobody drives it."""
        ...

    @property
    def states(self) -> Sequence[str]:
        """All states that a node of it can be in (:meth:`Node.state`), the most usual first."""
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
        memory: Mapping[str, object] | None = None,
    ) -> Node:
        """A new node; ``tell`` takes what it reports out of band.

        ``memory`` is what its EEPROM holds, as :meth:`Node.persist` gave it; None: what it left the
        factory with. Unknown or odd values are reported.
        """
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


@runtime_checkable
class PolyglotKind(Contract):
    """What a kind gives besides whose nodes can be set to speak one protocol or another."""

    @property
    def protocols(self) -> Sequence[Protocol]:
        """All of them, the default first."""
        ...

    def speaks(
        self,
        settings: Any,  # noqa: ANN401 (an instance of the kind's own settings)
    ) -> Protocol:
        """The one that a node with these settings speaks."""
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


def protocols_of(kind: NodeKind) -> Sequence[Protocol]:
    """All protocols that nodes of a kind can speak, the default first."""
    return kind.protocols if isinstance(kind, PolyglotKind) else (kind.protocol,)


def spoken_by(kind: NodeKind, settings: NodeSettings) -> Protocol:
    """The protocol that a node of a kind speaks with these settings."""
    return kind.speaks(settings) if isinstance(kind, PolyglotKind) else kind.protocol


def find_protocol(name: str, likely: Iterable[str] = ()) -> Protocol:
    """The protocol of that name, looked for in the ``likely`` kinds first.

    KindError when no kind that is installed speaks it.
    """
    names = dict.fromkeys((*likely, *kind_names()))
    for one in names:
        try:
            kind = find_kind(one)
        except KindError:
            continue  # another one may speak it
        for protocol in protocols_of(kind):
            if protocol.name == name:
                return protocol
    raise KindError(f"no node kind that is installed speaks {name!r}")


def _load(entry: EntryPoint) -> NodeKind:
    try:
        kind: NodeKind = entry.load()
    except Exception as fault:  # a third party's import may fail in any way; we name it and pass on
        raise KindError(
            f"node kind {entry.name!r} ({entry.value}) cannot be loaded: {fault!r}; "
            "mend or uninstall its package"
        ) from fault
    return kind
