"""A bus that runs, in the hands of who hosts it.

Owns who is on it from outside (programs, adapters, mothers, terminals), how they are let go, and
the saving of the nodes' memory. How one is built is the daemon's business.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from functools import partial
from random import Random

from sacbus.bus import FULL, LATENCY, Bus, Fault, FaultOn, LivePort, NoSuchNode, Port
from sacbus.configuration import Configuration, NodeAt
from sacbus.console import Console
from sacbus.host import Host, VirtualHost
from sacbus.kernel import SECOND, Ns
from sacbus.links import Link, TellingLink, Tuning
from sacbus.links.link import Server
from sacbus.mother import BadRequest, Mother
from sacbus.mother.request import SPEAKS
from sacbus.node import BOOT, Heard, Node, Report, ReportKind, Snapshot
from sacbus.panel import Deed, Panel
from sacbus.saving import AtOnce, Saving, Soon
from sacbus.shared_line import SharedLine
from sacbus.state import StateDirectory, StateError
from sacbus.watchdog import Watchdog

__all__ = ["HostedBus", "NoTerminal"]


class NoTerminal(KeyError):
    """A node whose kind has no terminal port was asked for it."""

    def __init__(self, address: int) -> None:
        super().__init__(address)
        self.address = address

    def __str__(self) -> str:  # KeyError's own is the repr of what was asked for
        return f"node {self.address} has no terminal port"


class HostedBus:
    """A bus that runs: its nodes can be looked at, driven by mother, and connected to."""

    def __init__(
        self, configuration: Configuration, bus: Bus, host: Host, *, guest: bool = False
    ) -> None:
        """``guest``: the host is another bus's, and closed with that."""
        self._guest = guest
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
        #: By the identity of the node, which lasts as long as its bus.
        self._panels: dict[int, Panel] = {}
        #: Called with each deed that is done to a node at its panel, once it is done.
        self.deeds: list[Callable[[Node, Deed], object]] = []
        #: Nodes in the order of the configuration, whose addresses name their memory.
        self.configured = tuple(zip(configuration.every_node, bus.nodes, strict=True))
        self._watchdog = Watchdog(bus, host, self.tell) if configuration.watchdog else None

    @property
    def talkers(self) -> int:
        """How many ports there are now: programs that a server let in, ptys, adapters, mothers."""
        return len(self._ports)

    def now(self) -> Ns:
        """Bus time, brought up to date with the clock."""
        return self.host.catch_up()

    def snapshots(self) -> list[Snapshot]:
        """All nodes as they are now."""
        now = self.now()
        return [node.snapshot(now) for node in self.bus.nodes]

    def snapshot(self, address: int) -> Snapshot:
        """One node as it is now; NoSuchNode when there is none."""
        return self.bus.node(address).snapshot(self.now())

    def panel(self, address: int) -> Panel:
        """A node's pins, encoder, switch and terminal; NoSuchNode when there is none."""
        return self._panel(self.bus.node(address))

    def shared_line(self, pin: str, addresses: Iterable[int]) -> SharedLine:
        """A wire to the same pin of these nodes: ``"sync"``, ``"xclk"``, ``"estop"``.

        NoSuchNode for an address at which there is none.
        """
        return SharedLine(pin, [self.panel(address) for address in addresses], self.host)

    def fault(self, fault: Fault) -> FaultOn:
        """Put a fault on the line now; what is given counts it and takes it :meth:`off`.

        FaultError where this bus cannot have it.
        """
        self.now()
        on = self.bus.medium.add_fault(fault, self.host.arrive)
        self.now()  # the host sees to what it wants next
        return on

    def terminal(self, address: int) -> Console:
        """The terminal of a node, to type at and to read.

        NoSuchNode when there is no such node, NoTerminal when it has none.

        What the node shows is kept for who reads it from the first time on that this is called.
        """
        console = self._console(self.bus.node(address))
        console.listen()
        return console

    def attach_terminal(self, address: int, link: Link) -> None:
        """Open a link to the terminal of the node that is configured at ``address``.

        LinkError when the link cannot be had; else as :meth:`terminal`. It is closed with the bus.
        """
        node = next((node for at, node in self.configured if at.address == address), None)
        if node is None:
            raise NoSuchNode(address, self.bus.name, [at.address for at, _ in self.configured])
        self._console(node).open(link)
        self.terminals[address] = link

    def _console(self, node: Node) -> Console:
        console = self._panel(node).console
        if console is None:
            raise NoTerminal(node.address)
        return console

    def _panel(self, node: Node) -> Panel:
        panel = self._panels.get(id(node))
        if panel is None:
            panel = self._panels[id(node)] = Panel(node, self.bus, self.host, self.deeds)
        return panel

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
        self._mind(link, port)
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
        self._mind(link, port)
        self.links.append(link)
        self._ports.append(port)
        return port

    def _mind(self, link: Link, port: Port | LivePort) -> Callable[[], None] | None:
        """Have the watchdog told when who talks over a link leaves; what tells it, if there is one.

        To be told twice of the same is harmless.
        """
        if self._watchdog is None:
            return None
        left = self._watchdog.minds(link, port)
        if isinstance(link, TellingLink):
            link.left = left
        return left

    async def let_in(self, server: Server, *, echo: bool = False, latency: Ns = LATENCY) -> None:
        """Open a server; everyone it lets in gets a port as from :meth:`attach`, while they stay.

        What a program had said before it left is still sent, unless there is a watchdog.
        """

        def admit(link: Link) -> Callable[[], None]:
            port = self._seat(link, echo=echo, latency=latency)
            left = self._mind(link, port)

            def gone() -> None:
                self._ports.remove(port)
                if left is None:
                    self._let_go(port)
                else:
                    port.close()
                    left()

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
        tuning = Tuning(link, rate.baud, noise, self.tell, nine=rate.nine)

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
            link.open(deliver_nine if rate.nine else deliver)
        except BaseException:
            port.close()
            raise
        port.name = link.where  # of a pty without a symlink known only now
        self._ports.append(port)
        return port

    def port(self, hear: Callable[[bytes], None]) -> Port:
        """A place on this very line for a master of one's own, at no distance from it.

        ``hear`` is given what the nodes say; ``Port.talk`` and ``Port.unsent`` are what a master
        needs. It is closed with the bus.
        """

        def heard(one: Heard, _now: Ns) -> None:
            hear(one.data)

        return self._masters_port(heard)

    def _masters_port(self, heard: Callable[[Heard, Ns], None]) -> Port:
        port = Port(self.bus.medium, heard, latency=0, name="mother")
        self._ports.append(port)
        return port

    def check_mother(self) -> None:
        """BadRequest where mother does not speak: another protocol is on this line."""
        spoken = self.bus.protocol.name
        if spoken not in SPEAKS:
            raise BadRequest(
                f"bus {self.bus.name}: mother speaks {' or '.join(SPEAKS)}, expected a bus that "
                f"does, got {spoken}, take a master of that protocol"
            )

    def mother(self) -> Mother:
        """Mother on this very bus, at no distance from the line.

        BadRequest where another protocol than hers is spoken: her bytes mean something else there.
        """
        self.check_mother()

        def heard(one: Heard, _now: Ns) -> None:
            caller.hear(one.data)

        port = self._masters_port(heard)
        mother = Mother(
            self.host.kernel,
            port.talk,
            rate=self.bus.rate,
            unsent=lambda: port.unsent,
            arrive=self.host.arrive,
        )
        caller = mother.caller
        self._mothers.append(mother)
        return mother

    def close(self) -> None:
        """Let everybody go: links are closed, and mothers are told that the line is gone."""
        if self._watchdog is not None:
            self._watchdog.end()
        with ExitStack() as stack:  # the rest is closed also when a link cannot be
            if not self._guest:
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
        saving = AtOnce(state, failed) if virtual else Soon(state, failed)
        for wanted, node in self.configured:
            node.memory_changed = partial(_save, saving, wanted, node)

        def end() -> None:
            for _, node in self.configured:
                node.memory_changed = None
            saving.close()

        return end

    def save(self, state: StateDirectory) -> None:
        """Write every node's memory; StateError for the first that could not be written."""
        failed: StateError | None = None
        for wanted, node in self.configured:
            try:
                state.save(wanted.address, wanted.kind, node.persist())
            except StateError as fault:  # the others' memories are worth no less
                failed = failed or fault
        if failed is not None:
            raise failed


def _save(saving: Saving, wanted: NodeAt, node: Node) -> None:
    saving.save(wanted.address, wanted.kind, node.persist())
