"""The daemon: builds a bus with its nodes and links from one configuration, and takes it down.

Owns the order of starting and stopping. Nothing is opened before everything has been checked, and
what was opened is closed again in every case: a port is released, memory is saved.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random
from typing import Final, assert_never

from sacbus.bus import FULL, LATENCY, PLAIN_BITS, Bus, LivePort, Port
from sacbus.console import Console
from sacbus.host import Host, RealHost, VirtualHost, VirtualLoop
from sacbus.kernel import SECOND, US, Kernel, LineRate, Ns
from sacbus.links import Link, Tuning
from sacbus.links.link import Server
from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt, terminal_path
from sacbus.mother import Mother
from sacbus.node import (
    BOOT,
    Heard,
    Node,
    Protocol,
    Report,
    ReportKind,
    SettingError,
    Snapshot,
    find_kind,
    settings_from,
)
from sacbus.saving import AtOnce, Saving, Thread
from sacbus.state import StateDirectory, StateError

__all__ = ["FASTEST", "SLOWEST", "Configuration", "HostedBus", "NodeAt", "check", "open_bus"]

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

    @property
    def every_node(self) -> tuple[NodeAt, ...]:
        """All nodes in full."""
        return tuple(
            one if isinstance(one, NodeAt) else NodeAt(one, self.kind, self.settings)
            for one in self.nodes
        )


class HostedBus:
    """A bus that runs: its nodes can be looked at, driven by mother, and connected to."""

    def __init__(self, configuration: Configuration, bus: Bus, host: Host) -> None:
        self.configuration = configuration
        self.bus = bus
        self.host = host
        #: Where programs get in, in the order of the configuration.
        self.links: list[Link | Server] = []
        #: Everyone with a port of their own: programs, adapters, mothers.
        self._ports: list[Port | LivePort] = []
        #: Ports of programs that have left, which may have something to send yet.
        self._leaving: list[Port] = []
        self._mothers: list[Mother] = []
        #: Where programs get at the nodes' terminals, by the addresses of the configuration.
        self.terminals: dict[int, Link] = {}
        self._consoles: dict[int, Console] = {}
        #: Nodes in the order of the configuration, whose addresses name their memory.
        self._configured = tuple(zip(configuration.every_node, bus.nodes, strict=True))

    @property
    def talkers(self) -> int:
        """How many ports there are now: programs that a server let in, ptys, adapters, mothers."""
        return len(self._ports)

    def now(self) -> Ns:
        """Bus time, brought up to date with the clock."""
        self.host.arrive(lambda: None)
        return self.host.kernel.now

    def snapshots(self) -> list[Snapshot]:
        """All nodes as they are now."""
        now = self.now()
        return [node.snapshot(now) for node in self.bus.nodes]

    def snapshot(self, address: int) -> Snapshot:
        """One node as it is now; KeyError when there is none."""
        return self.bus.node(address).snapshot(self.now())

    def terminal(self, address: int) -> Console:
        """The terminal of a node, to type at and to read; KeyError when there is none.

        What the node shows is kept for who reads it from the first time on that this is called.
        """
        node = self.bus.node(address)
        console = self._console(node)
        if console is None:
            raise KeyError(f"node {address} has no terminal port")
        console.listen()
        return console

    def _console(self, node: Node) -> Console | None:
        if id(node) not in self._consoles:  # a node lasts as long as its bus
            port = node.terminal
            if port is None:
                return None
            self._consoles[id(node)] = Console(node, port, self.bus, self.host)
        return self._consoles[id(node)]

    def attach_terminal(self, address: int, link: Link) -> None:
        """Open a link to the terminal of the node that is configured at ``address``.

        LinkError when the link cannot be had, KeyError when the node has no terminal, as in
        :meth:`terminal`. It is closed with the bus.
        """
        node = next((node for at, node in self._configured if at.address == address), None)
        console = None if node is None else self._console(node)
        if console is None:
            raise KeyError(f"node {address} has no terminal port")
        console.open(link)
        self.terminals[address] = link

    async def booted(self) -> None:
        """Wait until no node is on its way from power to obedience."""
        while starting := [one for one in self.bus.nodes if one.state(self.now()) == BOOT]:
            over = max(one.wake_at() or 0 for one in starting)
            await asyncio.sleep((over - self.now()) / SECOND / self.configuration.speed)

    def tell(self, text: str) -> None:
        """Report something about the line or a link, now."""
        self.bus.tell(Report(self.now(), None, ReportKind.WARNING, text))

    def attach(self, link: Link, *, echo: bool = False, latency: Ns = LATENCY) -> Port:
        """Open a link, put its bytes on the line, and the line's on the link.

        LinkError when it cannot be had. It is closed with the bus.
        """
        port = self._seat(link, echo=echo, latency=latency)
        self.links.append(link)
        return port

    def attach_live(self, link: Link) -> LivePort:
        """Open a link to a real line that this one is to be one with; else as :meth:`attach`."""

        def deliver(data: bytes) -> None:
            self.host.arrive(port.talk, data)

        def hold(held: bool) -> None:
            link.hold(held=held)

        port = LivePort(self.bus.medium, link.send, name=link.where, hold=hold)
        try:
            link.open(deliver)
        except BaseException:
            port.close()
            raise
        self.links.append(link)
        self._ports.append(port)
        return port

    async def let_in(self, server: Server, *, echo: bool = False, latency: Ns = LATENCY) -> None:
        """Open a server; everyone it lets in gets a port as from :meth:`attach`, while they stay.

        What a program had said before it left is still sent.
        """

        def admit(link: Link) -> Callable[[], None]:
            port = self._seat(link, echo=echo, latency=latency)

            def gone() -> None:
                self._ports.remove(port)
                self._let_go(port)

            return gone

        await server.open(admit)
        self.links.append(server)

    def _let_go(self, port: Port) -> None:
        """Have a port send to its end what its program had said, unless many have left so much."""
        self._leaving = [one for one in self._leaving if one.unsent]
        if sum(one.unsent for one in self._leaving) + port.unsent > FULL:
            port.close()
        else:
            port.leave()
            self._leaving.append(port)

    def _seat(self, link: Link, *, echo: bool, latency: Ns) -> Port:
        rate = self.bus.rate
        noise = Random(self.configuration.seed)
        tuning = Tuning(link, rate.baud, noise, self.tell, bits=rate.bits)

        def hear(heard: Heard, _now: Ns) -> None:
            link.send(tuning.to_client(heard.data))

        arrive = self.host.arrive

        def deliver(data: bytes) -> None:
            arrive(port.talk, tuning.from_client(data))

        def deliver_nine(data: bytes) -> None:
            # Parity and bytes come in this order. Without parity a stop bit stands in its place.
            ninth = tuning.ninth()
            arrive(port.talk, tuning.from_client(data), 1 if ninth is None else ninth)

        def hold(held: bool) -> None:
            link.hold(held=held)

        port = Port(self.bus.medium, hear, latency=latency, echo=echo, hold=hold)
        try:
            # A quick program's bytes may be delivered before this comes back.
            link.open(deliver_nine if rate.bits > PLAIN_BITS else deliver)
        except BaseException:
            port.close()
            raise
        port.name = link.where  # of a pty without a symlink known only now
        self._ports.append(port)
        return port

    def mother(self) -> Mother:
        """Mother on this very bus, at no distance from the line."""

        def hear(heard: Heard, _now: int) -> None:
            mother.hear(heard.data)

        port = Port(self.bus.medium, hear, latency=0, name="mother")
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
            for port in (*self._ports, *self._leaving):
                stack.callback(port.close)
            for link in (*self.links, *self.terminals.values()):
                stack.callback(link.close)

    def keep(self, state: StateDirectory) -> Callable[[], None]:
        """Save a node's memory whenever it changes; a save that fails is reported.

        What is given ends that, once all is written; what has failed is left to :meth:`save`.
        """

        def failed(address: int, text: str) -> None:
            self.bus.tell(Report(self.now(), address, ReportKind.WARNING, text))

        virtual = isinstance(self.host, VirtualHost)
        saving = AtOnce(state, failed) if virtual else Thread(state, failed)
        for wanted, node in self._configured:
            node.memory_changed = partial(_save, saving, wanted, node)

        def end() -> None:
            for _, node in self._configured:
                node.memory_changed = None
            saving.close()

        return end

    def save(self, state: StateDirectory) -> None:
        """Write every node's memory; StateError for the first that could not be written."""
        failed: StateError | None = None
        for wanted, node in self._configured:
            try:
                state.save(wanted.address, wanted.kind, node.persist())
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
    protocol = check(configuration)
    loop = asyncio.get_running_loop()
    kernel = loop.kernel if isinstance(loop, VirtualLoop) else Kernel()
    rate = LineRate(configuration.baud or protocol.rate.baud, protocol.rate.bits)
    bus = Bus(
        kernel,
        protocol,
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
        for wanted in configuration.every_node:
            kind = find_kind(wanted.kind)
            settings = settings_from(kind.settings, wanted.settings)
            node = kind.create(wanted.address, settings, rate, bus.tell)
            if state is not None:
                memory, remark = state.load(wanted.address, kind.name)
                if remark is not None:
                    bus.tell(Report(kernel.now, wanted.address, ReportKind.WARNING, remark))
                if memory is not None:
                    node.restore(memory)
            bus.add(node)
        hosted = HostedBus(configuration, bus, _host(configuration, bus, loop))
        stack.callback(hosted.close)
        for place in configuration.links:
            await _open_link(hosted, place)
        if configuration.terminals:
            _open_terminals(hosted)
        if state is not None:
            # Last, so that a bus that never ran overwrites nobody's memory; and at once, so that
            # what is killed has left as much as what is ended.
            hosted.save(state)
            stack.callback(hosted.save, state)
            stack.callback(hosted.keep(state))
        yield hosted


def _save(saving: Saving, wanted: NodeAt, node: Node) -> None:
    saving.save(wanted.address, wanted.kind, node.persist())


def _host(configuration: Configuration, bus: Bus, loop: asyncio.AbstractEventLoop) -> Host:
    if isinstance(loop, VirtualLoop):
        return VirtualHost(bus.kernel)
    free_at = partial(bus.medium.free_at, bus.medium.master_lane)
    return RealHost(
        bus.kernel,
        loop,
        speed=configuration.speed,
        line_free_at=None if configuration.pace else free_at,
    )


async def _open_link(bus: HostedBus, place: Place) -> None:
    """Open what a place names. Each kind of link is loaded only where one is asked for."""
    # ruff: noqa: PLC0415 (no bus waits for, or fails over, what another one needs)
    baud = bus.bus.rate.baud
    match place:
        case PtyAt(path, echo, latency_us):
            from sacbus.links import PtyLink

            bus.attach(PtyLink(path, baud=baud), echo=echo, latency=latency_us * US)
        case TcpAt(host, port, echo, latency_us):
            from sacbus.links.tcp import TcpServer

            await bus.let_in(TcpServer(host, port), echo=echo, latency=latency_us * US)
        case Rfc2217At(host, port, echo, latency_us):
            from sacbus.links.rfc2217 import Rfc2217Server

            server = Rfc2217Server(host, port, baud=baud)
            await bus.let_in(server, echo=echo, latency=latency_us * US)
        case AdapterAt(path, rts, echo):
            from sacbus.links.adapter import AdapterLink

            bus.attach_live(AdapterLink(path, baud, rts=rts, echo=echo, tell=bus.tell))
        case _:
            assert_never(place)


def _open_terminals(bus: HostedBus) -> None:
    """A pty for the terminal of every node that has one."""
    from sacbus.links import PtyLink
    from sacbus.links.presence import Presence

    # One for all: a user may have 128 of what it takes, and a bus 250 nodes.
    presence = Presence()
    for node in bus.configuration.every_node:
        path = terminal_path(bus.configuration.links, node.address)
        link = PtyLink(path, baud=bus.bus.rate.baud, presence=presence)
        try:
            bus.attach_terminal(node.address, link)
        except KeyError:
            what = f"a node of kind {node.kind} has no terminal port, so none is served"
            bus.bus.tell(Report(bus.now(), node.address, ReportKind.WARNING, what))


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
    protocol = find_kind(configuration.kind).protocol
    seen: set[int] = set()
    nodes = configuration.every_node
    for number, node in enumerate(nodes):
        if not 4 <= node.address <= 255:
            raise SettingError(f"nodes: expected addresses from 4 to 255, got {node.address!r}")
        if node.address in seen:
            raise SettingError(f"nodes: expected every address once, got {node.address} twice")
        seen.add(node.address)
        kind = find_kind(node.kind)
        settings_from(kind.settings, node.settings)
        if number == 0:
            protocol = kind.protocol
        elif kind.protocol.name != protocol.name:
            raise SettingError(
                f"nodes: expected one protocol on a line, got {protocol.name} (node "
                f"{nodes[0].address}) and {kind.protocol.name} (node {node.address})"
            )
    if any(isinstance(place, AdapterAt) for place in configuration.links):
        if configuration.speed != 1:
            raise SettingError(
                f"speed: expected 1 with a real adapter, which keeps real time, got "
                f"{configuration.speed}"
            )
        if not configuration.pace:
            raise SettingError("pace: expected true with a real adapter, which keeps real time")
        if protocol.rate.bits > PLAIN_BITS:
            raise SettingError(
                f"links: an adapter hears no ninth bits, which {protocol.name} has; use a pty, TCP "
                "or RFC 2217"
            )
    return protocol
