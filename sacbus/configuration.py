"""What a bus is made of, as values: its nodes, its line, its links; and what no bus can be.

Owns the configuration and its checks. Opens nothing, and knows no file: those are
``sacbus.config``'s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from sacbus.links.places import AdapterAt, Place
from sacbus.node import (
    NodeKind,
    Protocol,
    SettingError,
    find_kind,
    settings_from,
    spoken_by,
)

__all__ = ["FASTEST", "SLOWEST", "Configuration", "NodeAt", "check"]

#: Bus seconds in a second: beyond these, times in seconds are no numbers any more.
SLOWEST: Final = 1e-6
FASTEST: Final = 1e6


@dataclass(frozen=True, slots=True)
class NodeAt:
    """A node of a configuration: its address, and the settings of its kind that differ."""

    address: int
    kind: str = "sac"
    settings: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Configuration:
    """One bus: its nodes, its line, its links.

    A node that is a mere address is of ``kind``, with ``settings``; a bus without nodes speaks the
    protocol of ``kind``. ``baud`` and ``lanes`` override the protocol's. ``state``: the directory
    for the nodes' EEPROM, None keeps it in memory. ``speed`` scales bus time; ``pace`` False lets
    the line run ahead of the clock. ``terminals``: a pty for each node's terminal port.
    ``watchdog``: nodes that move are stopped when the link of who has talked goes away.
    """

    nodes: tuple[NodeAt | int, ...] = (10, 11, 12)
    kind: str = "sac"
    settings: Mapping[str, object] = field(default_factory=dict)
    name: str = "bus"
    baud: int | None = None
    lanes: int | None = None
    seed: int = 0
    links: tuple[Place, ...] = ()
    state: Path | None = None
    speed: float = 1.0
    pace: bool = True
    terminals: bool = False
    watchdog: bool = False

    @property
    def every_node(self) -> tuple[NodeAt, ...]:
        """All nodes in full."""
        return tuple(
            one if isinstance(one, NodeAt) else NodeAt(one, self.kind, self.settings)
            for one in self.nodes
        )


def check(configuration: Configuration) -> Protocol:
    """Refuse what no node and no line can be, and two nodes that would share a memory.

    SettingError or KindError for the first mistake; otherwise the protocol that all nodes speak.
    """
    if not SLOWEST <= configuration.speed <= FASTEST:
        raise SettingError(
            f"speed: expected a number from {SLOWEST:f} to {FASTEST:.0f}, got {configuration.speed}"
        )
    if configuration.baud is not None and not 300 <= configuration.baud <= 4_000_000:
        raise SettingError(f"baud: expected 300 to 4000000, got {configuration.baud}")
    if configuration.lanes not in (None, 1, 2):
        raise SettingError(f"lanes: expected 1 or 2, got {configuration.lanes}")
    default = find_kind(configuration.kind)
    protocol = spoken_by(default, settings_from(default.settings, configuration.settings))
    seen: set[int] = set()
    nodes = configuration.every_node
    # Found once each: all that is installed is looked through for one.
    kinds: dict[str, NodeKind] = {}
    for number, node in enumerate(nodes):
        if node.address in seen:
            raise SettingError(f"nodes: expected every address once, got {node.address} twice")
        seen.add(node.address)
        kind = kinds.get(node.kind)
        if kind is None:
            kind = kinds[node.kind] = find_kind(node.kind)
        spoken = spoken_by(kind, settings_from(kind.settings, node.settings))
        if node.address not in spoken.addresses:
            low, high = spoken.addresses[0], spoken.addresses[-1]
            raise SettingError(
                f"nodes: expected addresses from {low} to {high}, got {node.address!r}"
            )
        if number == 0:
            protocol = spoken
        elif spoken.name != protocol.name:
            raise SettingError(
                f"nodes: expected one protocol on a line, got {protocol.name} (node "
                f"{nodes[0].address}) and {spoken.name} (node {node.address})"
            )
    if any(isinstance(place, AdapterAt) for place in configuration.links):
        if configuration.speed != 1:
            raise SettingError(
                f"speed: expected 1 with a real adapter, which keeps real time, got "
                f"{configuration.speed}"
            )
        if not configuration.pace:
            raise SettingError("pace: expected true with a real adapter, which keeps real time")
        if protocol.rate.nine:
            raise SettingError(
                f"links: an adapter hears no ninth bits, which {protocol.name} has; use a pty, TCP "
                "or RFC 2217"
            )
    return protocol
