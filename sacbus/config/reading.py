"""A configuration file to what the daemon hosts, or to all that is wrong with it.

Owns the order of the reading: text, tables, clashes, and only then values. Nothing is opened.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sacbus.config.clashes import clashes
from sacbus.config.draft import BusDraft, Draft, draft
from sacbus.config.mistake import ConfigError, Findings, Mistake
from sacbus.config.oddities import oddities
from sacbus.config.source import Source, load
from sacbus.daemon import Configuration, NodeAt

__all__ = ["Examined", "Setup", "examine", "read", "read_source"]


@dataclass(frozen=True, slots=True)
class Setup:
    """All that one process is to host. ``precise``: wake more precisely, for processor time."""

    buses: tuple[Configuration, ...]
    precise: bool = False


@dataclass(frozen=True, slots=True)
class Examined:
    """What was found in a file: its mistakes, or its setup; and what is odd about it.

    ``warnings`` are about what is not wrong but will hardly be meant, on this machine and now.
    """

    file: str
    setup: Setup | None
    mistakes: tuple[Mistake, ...] = ()
    warnings: tuple[Mistake, ...] = ()


def read(file: str | Path) -> Setup:
    """The setup in a file, or on standard input for ``-``; ConfigError with all its mistakes.

    Relative paths in it are relative to the file, or to the working directory.
    """
    return read_source(load(file))


def read_source(source: Source) -> Setup:
    """The setup in a text that has been read; ConfigError with all its mistakes."""
    _, found, findings = _read(source)
    if found is None:
        raise ConfigError(findings.mistakes())
    return found


def examine(file: str | Path) -> Examined:
    """Everything that can be said of a file; never raises for what is in it."""
    name = "standard input" if str(file) == "-" else str(file)
    try:
        source = load(file)
    except ConfigError as wrong:
        return Examined(name, None, wrong.mistakes)
    drafted, setup, findings = _read(source)
    odd = Findings(source.name, source.lines)
    odd.names |= findings.names
    oddities(drafted, odd)
    return Examined(name, setup, findings.mistakes(), odd.mistakes())


def _read(source: Source) -> tuple[Draft, Setup | None, Findings]:
    findings = Findings(source.name, source.lines)
    drafted = draft(source, findings)
    clashes(drafted, findings)
    setup = None if findings else _setup(drafted)
    return drafted, setup, findings


def _setup(drafted: Draft) -> Setup:
    """The values of a draft that is right in all its parts."""
    speed = float(drafted.table.get("speed", 1.0))
    return Setup(
        tuple(_configuration(bus, speed) for bus in drafted.buses),
        precise=drafted.table.get("precise", False),
    )


def _configuration(bus: BusDraft, speed: float) -> Configuration:
    given = {name: bus.table.values[name] for name in _AS_IT_IS if name in bus.table.values}
    nodes = tuple(
        NodeAt(address, node.kind.name, node.settings)
        for node in bus.nodes
        if node.kind is not None
        for address in node.addresses
    )
    return Configuration(
        name=str(bus.name),
        nodes=nodes,
        kind=nodes[0].kind if nodes else bus.kind,
        links=tuple(link.place for link in bus.links if link.place is not None),
        state=bus.state,
        speed=speed,
        **given,
    )


#: Keys of a bus that are values of its configuration under the same names.
_AS_IT_IS = ("baud", "lanes", "seed", "pace", "terminals", "watchdog")
