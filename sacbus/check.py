"""``sacbus check``: what a configuration would host, in words and as JSON.

Owns these two forms of output. A leaf beside the command line; what is right and what is wrong is
decided by ``sacbus.config``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any, Final

from sacbus.config.keys import shown
from sacbus.config.notation import endpoint_text, ranges
from sacbus.config.reading import Examined
from sacbus.daemon import Configuration, check
from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt, terminal_path

__all__ = ["as_json", "as_text"]

_KINDS: Final = {PtyAt: "pty", TcpAt: "tcp", Rfc2217At: "rfc2217", AdapterAt: "adapter"}


def as_text(examined: Examined) -> Iterator[str]:
    """What a file would host, in lines; nothing if it has mistakes."""
    setup = examined.setup
    if setup is None:
        return
    counts = (
        _count(len(setup.buses), "bus", "buses"),
        _count(sum(len(bus.nodes) for bus in setup.buses), "node", "nodes"),
        _count(sum(len(bus.links) for bus in setup.buses), "link", "links"),
    )
    yield f"{examined.file}: {', '.join(counts)}"
    for bus in setup.buses:
        protocol = check(bus)
        lanes = _count(bus.lanes or protocol.lanes, "lane", "lanes")
        yield f"bus {bus.name}: {protocol.name} at {bus.baud or protocol.rate.baud} baud, {lanes}"
        for (kind, settings), alike in groupby(
            bus.every_node, key=lambda node: (node.kind, node.settings)
        ):
            given = "".join(f", {name} = {shown(value)}" for name, value in settings.items())
            addresses = [node.address for node in alike]
            word = "node" if len(addresses) == 1 else "nodes"
            yield f"  {word} {ranges(addresses)}: {kind}{given}"
        for place in bus.links:
            yield f"  {_KINDS[type(place)]} {_where(place)}".rstrip()
        if bus.terminals:
            path = terminal_path(bus.links, "ADDRESS")
            yield "  terminals" if path is None else f"  terminals {path}"
        if bus.watchdog:
            yield "  watchdog"
        yield f"  state {'kept in memory only' if bus.state is None else bus.state / bus.name}"


def as_json(examined: Sequence[Examined]) -> dict[str, Any]:
    """What was found in all files. ``Any``: the shapes of JSON."""
    return {
        "configurations": [
            {
                "file": one.file,
                "mistakes": [dataclasses.asdict(mistake) for mistake in one.mistakes],
                "warnings": [dataclasses.asdict(warning) for warning in one.warnings],
                "precise": None if one.setup is None else one.setup.precise,
                "buses": [] if one.setup is None else [_bus(bus) for bus in one.setup.buses],
            }
            for one in examined
        ]
    }


def _bus(bus: Configuration) -> dict[str, Any]:
    protocol = check(bus)
    return {
        "name": bus.name,
        "protocol": protocol.name,
        "baud": bus.baud or protocol.rate.baud,
        "lanes": bus.lanes or protocol.lanes,
        "seed": bus.seed,
        "pace": bus.pace,
        "terminals": bus.terminals,
        "watchdog": bus.watchdog,
        "speed": bus.speed,
        "state": None if bus.state is None else str(bus.state / bus.name),
        "nodes": [dataclasses.asdict(node) for node in bus.every_node],
        "links": [_link(place) for place in bus.links],
    }


def _link(place: Place) -> dict[str, Any]:
    link = {"kind": _KINDS[type(place)], **dataclasses.asdict(place)}
    if isinstance(place, PtyAt) and place.path is not None:
        link["path"] = str(place.path)
    return link


def _where(place: Place) -> str:
    match place:
        case TcpAt(host, port) | Rfc2217At(host, port):
            return endpoint_text(host, port)
        case PtyAt(path) | AdapterAt(path):
            return "" if path is None else str(path)


def _count(number: int, one: str, more: str) -> str:
    return f"{number} {one if number == 1 else more}"
