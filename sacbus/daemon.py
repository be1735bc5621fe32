"""The daemon: builds a bus with its nodes and links from one configuration, and takes it down.

Owns the order of starting and stopping. Nothing is opened before everything has been checked, and
what was opened is closed again in every case: a port is released, memory is saved.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from random import Random

from sacbus.bus import Bus, Port
from sacbus.host import Host, RealHost, VirtualHost, VirtualLoop
from sacbus.kernel import Kernel, LineRate
from sacbus.links import Link, PtyLink, Tuning
from sacbus.mother import Mother
from sacbus.node import (
    Heard,
    NodeKind,
    Report,
    ReportKind,
    SettingError,
    Snapshot,
    find_kind,
    settings_from,
)
from sacbus.state import StateDirectory, StateError

__all__ = ["Configuration", "HostedBus", "open_bus"]


@dataclass(frozen=True, slots=True)
class Configuration:
    """One bus: its nodes, its line, its links.

    ``pty``: True for a pty, or the path of a symlink to one. ``state``: the directory for the
    nodes' EEPROM, None keeps it in memory. ``speed`` scales bus time; ``pace`` False lets the line
    run ahead of the clock. ``lanes`` overrides the protocol's. ``settings`` are the kind's own.
    """

    nodes: tuple[int, ...] = (10, 11, 12)
    kind: str = "sac"
    settings: Mapping[str, object] = field(default_factory=dict)
    name: str = "bus"
    baud: int = 38_400
    lanes: int | None = None
    seed: int = 0
    pty: bool | Path = False
    echo: bool = False
    state: Path | None = None
    speed: float = 1.0
    pace: bool = True


class HostedBus:
    """A bus that runs: its nodes can be looked at, driven by mother, and connected to."""

    def __init__(self, configuration: Configuration, kind: NodeKind, bus: Bus, host: Host) -> None:
        self.configuration = configuration
        self.kind = kind
        self.bus = bus
        self.host = host
        self.links: list[Link] = []
        self._ports: list[Port] = []
        self._mothers: list[Mother] = []
        #: Nodes by the address they were configured with, which names their memory.
        self._configured = dict(zip(configuration.nodes, bus.nodes, strict=True))

    def snapshots(self) -> list[Snapshot]:
        """All nodes as they are now."""
        self.host.arrive(lambda: None)
        now = self.host.kernel.now
        return [node.snapshot(now) for node in self.bus.nodes]

    def snapshot(self, address: int) -> Snapshot:
        """One node as it is now; KeyError when there is none."""
        self.host.arrive(lambda: None)
        return self.bus.node(address).snapshot(self.host.kernel.now)

    def attach(self, link: Link) -> Port:
        """Open a link, put its bytes on the line, and the line's on the link.

        LinkError when it cannot be had. It is closed with the bus.
        """
        kernel = self.host.kernel

        def tell(text: str) -> None:
            self.bus.tell(Report(kernel.now, None, ReportKind.WARNING, text))

        tuning = Tuning(link, self.bus.rate.baud, Random(self.configuration.seed), tell)

        def hear(heard: Heard, _now: int) -> None:
            link.send(tuning.to_client(heard.data))

        def deliver(data: bytes) -> None:
            self.host.arrive(port.talk, tuning.from_client(data))

        link.open(deliver)
        self.links.append(link)
        port = Port(self.bus.medium, hear, echo=self.configuration.echo)
        self._ports.append(port)
        return port

    def mother(self) -> Mother:
        """Mother on this very bus, at no distance from the line."""

        def hear(heard: Heard, _now: int) -> None:
            mother.hear(heard.data)

        port = Port(self.bus.medium, hear, latency=0)
        self._ports.append(port)
        mother = Mother(
            self.host.kernel,
            port.talk,
            rate=self.bus.rate,
            unsent=lambda: port.unsent,
            arrive=self.host.arrive,
        )
        self._mothers.append(mother)
        return mother

    def close(self) -> None:
        """Let everybody go: links are closed, and mothers are told that the line is gone."""
        with ExitStack() as stack:  # the rest is closed also when a link cannot be
            stack.callback(self.host.close)
            for mother in self._mothers:
                stack.callback(mother.lose, "the bus is closed")
            for port in self._ports:
                stack.callback(port.close)
            for link in self.links:
                stack.callback(link.close)

    def save(self, state: StateDirectory) -> None:
        """Write every node's memory; StateError for the first that could not be written."""
        failed: StateError | None = None
        for address, node in self._configured.items():
            try:
                state.save(address, self.kind.name, node.persist())
            except StateError as fault:  # the others' memories are worth no less
                failed = failed or fault
        if failed is not None:
            raise failed


@asynccontextmanager
async def open_bus(configuration: Configuration | None = None) -> AsyncIterator[HostedBus]:
    """Host a bus in the running loop, for an ``async with`` block.

    In a :class:`~sacbus.host.VirtualLoop` bus time is that loop's time; in any other it follows the
    loop's clock, as precisely as that loop wakes. Raises KindError, SettingError, StateError or
    LinkError, each a line that a user can act on, with nothing left open.
    """
    configuration = configuration or Configuration()
    _check(configuration)
    kind = find_kind(configuration.kind)
    settings = settings_from(kind.settings, configuration.settings)
    loop = asyncio.get_running_loop()
    virtual = isinstance(loop, VirtualLoop)
    kernel = loop.kernel if isinstance(loop, VirtualLoop) else Kernel()
    rate = LineRate(configuration.baud, kind.protocol.rate.bits)
    bus = Bus(
        kernel,
        kind.protocol,
        name=configuration.name,
        rate=rate,
        lanes=configuration.lanes,
        seed=configuration.seed,
    )
    with ExitStack() as stack:
        state = None
        if configuration.state is not None:
            state = StateDirectory(configuration.state, configuration.name)
            state.claim()
            stack.callback(state.release)
        for address in configuration.nodes:
            node = kind.create(address, settings, rate, bus.tell)
            if state is not None:
                memory, remark = state.load(address, kind.name)
                if remark is not None:
                    bus.tell(Report(kernel.now, address, ReportKind.WARNING, remark))
                if memory is not None:
                    node.restore(memory)
            bus.add(node)
        host: Host
        if virtual:
            host = VirtualHost(kernel)
        else:
            lane = bus.medium.master_lane
            host = RealHost(
                kernel,
                loop,
                speed=configuration.speed,
                line_free_at=None if configuration.pace else lambda: bus.medium.free_at(lane),
            )
        hosted = HostedBus(configuration, kind, bus, host)
        stack.callback(hosted.close)
        if configuration.pty:
            path = configuration.pty if isinstance(configuration.pty, Path) else None
            hosted.attach(PtyLink(path, baud=configuration.baud))
        if state is not None:
            # Last, so that a bus that never ran overwrites nobody's memory; and at once, so that
            # what is killed has left as much as what is ended.
            hosted.save(state)
            stack.callback(hosted.save, state)
        yield hosted


def _check(configuration: Configuration) -> None:
    """Refuse what no SAC and no line can be, and two nodes that would share a memory."""
    if not 0 < configuration.speed < inf:
        raise SettingError(f"speed: expected a number above 0, got {configuration.speed}")
    if not 300 <= configuration.baud <= 4_000_000:
        raise SettingError(f"baud: expected 300 to 4000000, got {configuration.baud}")
    if configuration.lanes not in (None, 1, 2):
        raise SettingError(f"lanes: expected 1 or 2, got {configuration.lanes}")
    nodes = configuration.nodes
    for number, address in enumerate(nodes):
        if not 4 <= address <= 255:
            raise SettingError(f"nodes: expected addresses from 4 to 255, got {address!r}")
        if address in nodes[:number]:
            raise SettingError(f"nodes: expected every address once, got {address} twice")
