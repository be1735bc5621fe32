"""What a configuration says, table by table: buses, nodes and links as far as they are right.

Owns the reading of each part by itself; what two parts may have to do with each other is not looked
at here (clashes.py). Where something is wrong, its place in the draft stays empty.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from sacbus.config import lines
from sacbus.config.keys import ANY_LINK, BUS, LINKS, NODE, TOP, Key, setting_keys, shown
from sacbus.config.mistake import Findings
from sacbus.config.notation import (
    HIGHEST_ADDRESS,
    LOOPBACK,
    LOWEST_ADDRESS,
    NotationError,
    endpoint,
    ranges,
    right_addresses,
)
from sacbus.config.source import Source
from sacbus.config.table import Table, nearest, remedy, tables
from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt
from sacbus.node import (
    KindError,
    NodeKind,
    Protocol,
    find_kind,
    kind_names,
    protocols_of,
    settings_from,
    spoken_by,
)
from sacbus.state import default_directory

__all__ = ["BusDraft", "Draft", "LinkDraft", "NodeDraft", "draft"]

_KIND: Final = next(key for key in NODE if key.name == "kind")
_PROTOCOL: Final = next(key for key in BUS if key.name == "protocol")
#: A SettingError that names its setting, as those of node.py do.
_ABOUT: Final = re.compile(r"setting '(\w+)': (.*)")
_DEFAULT_KIND: Final = str(_KIND.default)


@dataclass(slots=True)
class NodeDraft:
    """One [[bus.nodes]]; what is wrong of it is left out: ``kind`` and ``protocol`` are None then.

    ``protocol`` is what it speaks with its settings.
    """

    table: Table
    kind: NodeKind | None
    protocol: Protocol | None
    addresses: tuple[int, ...]
    settings: Mapping[str, object]

    @property
    def addressed(self) -> lines.Path:
        """Where its addresses stand."""
        return self.table.at("addresses" if "addresses" in self.table.values else "address")


@dataclass(slots=True)
class LinkDraft:
    """One [[bus.links]]. ``spot`` is where it says what no other link may have."""

    table: Table
    place: Place | None
    spot: lines.Path


@dataclass(slots=True)
class BusDraft:
    """One [[bus]]. ``name`` is None when it is wrong; ``state`` None keeps nothing.

    ``protocol`` is the one that is asked for, ``kind`` one that speaks it.
    """

    table: Table
    name: str | None
    protocol: str | None
    kind: str
    state: Path | None
    nodes: list[NodeDraft] = field(default_factory=list)
    links: list[LinkDraft] = field(default_factory=list)


@dataclass(slots=True)
class Draft:
    """A configuration as far as it is right."""

    table: Table
    buses: list[BusDraft]


def draft(source: Source, findings: Findings) -> Draft:
    """Read all tables; what is wrong with any of them goes to ``findings``."""
    return _Reader(source, findings).everything()


class _Reader:
    def __init__(self, source: Source, findings: Findings) -> None:
        self._source = source
        self._findings = findings
        self._kinds: dict[str, NodeKind | KindError] = {}

    def everything(self) -> Draft:
        top = Table.read(self._findings, (), self._source.content, TOP)
        state = self._state(top, None)
        if top.lacks("state") and self._wants_default(top):
            state = default_directory()
        found = tables(self._findings, top.at("bus"), top.get("bus"), "bus")
        if not found and top.get("bus") == []:
            self._findings.add(top.at("bus"), "expected one [[bus]] at least, got none", "add one")
        return Draft(top, [self._bus(path, content, state) for path, content in found])

    def _wants_default(self, top: Table) -> bool:
        """Whether any bus has no word of its own on where memory is kept."""
        buses = top.get("bus")
        return not isinstance(buses, list) or any(
            not isinstance(bus, dict) or "state" not in bus for bus in buses
        )

    def _bus(self, path: lines.Path, content: Mapping[str, object], state: Path | None) -> BusDraft:
        table = Table.read(self._findings, path, content, BUS)
        name = "bus" if table.lacks("name") else table.get("name")
        protocol, kind = self._protocol(table)
        bus = BusDraft(table, name, protocol, kind, self._state(table, state))
        for at, node in tables(self._findings, table.at("nodes"), table.get("nodes"), "bus.nodes"):
            bus.nodes.append(self._node(at, node))
        for at, link in tables(self._findings, table.at("links"), table.get("links"), "bus.links"):
            bus.links.append(self._link(at, link))
        return bus

    def _protocol(self, table: Table) -> tuple[str | None, str]:
        """The protocol that is asked for, if it can be had, and a kind that speaks it."""
        name = table.get("protocol")
        if not isinstance(name, str):
            return None, _DEFAULT_KIND
        kinds = {one: self._kind(one) for one in kind_names()}
        speakers = {
            protocol.name: one
            for one, kind in kinds.items()
            if not isinstance(kind, KindError)
            for protocol in protocols_of(kind)
        }
        if name in speakers:
            return name, speakers[name]
        spoken = sorted(speakers)
        what = f"expected {' or '.join(spoken)}, got {shown(name)}"
        self._findings.add(table.at("protocol"), what, _correction(_PROTOCOL, name, spoken))
        return None, _DEFAULT_KIND

    def _state(self, table: Table, default: Path | None) -> Path | None:
        state = table.get("state")
        if isinstance(state, str):
            return self._path(state)
        return None if state is False else default

    def _path(self, text: str) -> Path:
        """A path as it is written in the file: relative to it; ``~`` is home."""
        return self._source.directory / os.path.expanduser(text)  # noqa: PTH111 (never raises)

    # ---- nodes ----------------------------------------------------------------------------------

    def _node(self, path: lines.Path, content: Mapping[str, object]) -> NodeDraft:
        kind = self._kind_of(path, content)
        settings = () if kind is None else setting_keys(kind.settings)
        table = Table.read(
            self._findings, path, content, (*NODE, *settings), whole=kind is not None
        )
        given = {key.name: table.values[key.name] for key in settings if key.name in table.values}
        protocol = None if kind is None else kind.protocol
        if kind is not None and not table.unsure:
            try:
                protocol = spoken_by(kind, settings_from(kind.settings, given))
            except ValueError as fault:  # what a kind has against settings that fit one by one
                text = " ".join(str(fault).split())
                hit = _ABOUT.fullmatch(text)
                if hit and hit[1] in given:
                    self._findings.add((*path, hit[1]), hit[2], "correct it")
                else:
                    self._findings.add(path, text, "correct it")
        return NodeDraft(table, kind, protocol, self._addresses(table, protocol), given)

    def _kind_of(self, path: lines.Path, content: Mapping[str, object]) -> NodeKind | None:
        """The kind of a node, unless it is wrong, or may be hidden behind a misspelled key."""
        name = content.get(_KIND.name, _DEFAULT_KIND)
        misspelled = "kind" not in content and any(nearest(one, ["kind"]) for one in content)
        if not isinstance(name, str) or misspelled:
            return None
        found = self._kind(name)
        if not isinstance(found, KindError):
            return found
        if name in kind_names():
            what, _, cure = str(found).rpartition("; ")
            self._findings.add((*path, "kind"), " ".join(what.split()), cure)
        else:
            what = f"expected {' or '.join(kind_names())}, got {shown(name)}"
            cure = _correction(_KIND, name, kind_names())
            self._findings.add((*path, "kind"), what, cure)
        return None

    def _kind(self, name: str) -> NodeKind | KindError:
        if name not in self._kinds:
            try:
                self._kinds[name] = find_kind(name)
            except KindError as fault:
                self._kinds[name] = fault
        return self._kinds[name]

    def _addresses(self, table: Table, protocol: Protocol | None) -> tuple[int, ...]:
        one, several = table.get("address"), table.get("addresses")
        if one is not None and several is not None:
            what = "expected address or addresses, got both"
            self._findings.add(table.at("addresses"), what, "leave one out")
            return ()
        if table.lacks("address") and table.lacks("addresses"):
            what = "expected address or addresses, got none"
            self._findings.add(table.path, what, "give one, such as address = 10")
        if isinstance(several, str):
            right, faults = right_addresses(several)
            for fault in faults:
                self._findings.add(table.at("addresses"), fault, "correct it")
            return self._possible(right, table.at("addresses"), protocol)
        if one is None:
            return ()
        return self._possible((one,), table.at("address"), protocol)

    def _possible(
        self, given: tuple[int, ...], path: lines.Path, protocol: Protocol | None
    ) -> tuple[int, ...]:
        """Those of some addresses that a node of this protocol may have."""
        allowed = range(LOWEST_ADDRESS, HIGHEST_ADDRESS + 1)
        if protocol is not None:
            allowed = protocol.addresses
        wrong = [one for one in given if one not in allowed]
        if wrong:
            what = f"expected addresses from {allowed[0]} to {allowed[-1]}, got {ranges(wrong)}"
            self._findings.add(path, what, "correct it")
        return tuple(one for one in given if one in allowed)

    # ---- links ----------------------------------------------------------------------------------

    def _link(self, path: lines.Path, content: Mapping[str, object]) -> LinkDraft:
        word = content.get("kind")
        keys = LINKS.get(word, ANY_LINK) if isinstance(word, str) else ANY_LINK
        table = Table.read(self._findings, path, content, keys)
        host, port = self._endpoint(table)
        common = {name: table.values[name] for name in _COMMON if name in table.values}
        spot = table.at("listen")
        place: Place | None = None
        match word:
            case "pty":
                spot = table.at("path")
                symlink = table.get("path")
                place = PtyAt(None if symlink is None else self._path(symlink), **common)
            case "tcp" if host is not None:
                place = TcpAt(host, port, **common)
            case "rfc2217" if host is not None:
                place = Rfc2217At(host, port, **common)
            case "adapter" if "device" in table.values:
                spot = table.at("device")
                place = AdapterAt(self._device(table.get("device")), **common)
        return LinkDraft(table, place, spot)

    def _endpoint(self, table: Table) -> tuple[str | None, int]:
        """Host and port of a server; no host where they are wrong."""
        if "listen" in table.unsure:
            return None, 0
        listen = table.get("listen", f"{LOOPBACK}:0")
        try:
            return endpoint(str(listen))
        except NotationError as wrong:
            self._findings.add(table.at("listen"), str(wrong), "correct it")
        return None, 0

    def _device(self, text: str) -> str:
        """A name without a separator is a port's own, COM5; everything else is a path."""
        if not {"/", os.sep} & {*text}:
            return text
        return str(self._path(text))


#: Keys of links that mean the same to their places.
_COMMON: Final = ("rts", "echo", "latency_us")


def _correction(key: Key, word: str, known: list[str]) -> str:
    meant = nearest(word, known)
    return remedy(key) if meant is None else f"did you mean {meant!r}?"
