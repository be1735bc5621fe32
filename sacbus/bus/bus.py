"""A bus: a medium with nodes on it, their appointments and what they report.

Owns which node sits at which address, when each wants to be woken, and the routing of bytes to
nodes by the protocol's rules. Nodes are met only through the contract in ``sacbus.node``.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

from sacbus.bus.hearing import WrongBaud
from sacbus.bus.medium import Medium
from sacbus.kernel import Appointment, Kernel, LineRate, Ns
from sacbus.node import Heard, MistunedNode, Node, Protocol, Report

__all__ = ["Bus", "NoSuchNode"]

#: Reports kept for whoever asks later; older ones are only counted.
REPORTS_KEPT: Final = 1_000

#: Addresses that are told to who asked for a wrong one.
TOLD: Final = 10

#: Appointments of one node that may stand at a time; two are usual.
STANDING: Final = 8


class NoSuchNode(KeyError):
    """There is no node at an address that somebody asked for; the line says which there are."""

    def __init__(self, address: object, bus: str, present: Sequence[int]) -> None:
        super().__init__(address)
        self.address = address
        self.bus = bus
        self.present = tuple(present)

    def __str__(self) -> str:  # KeyError's own is the repr of what was asked for
        shown = ", ".join(map(str, self.present[:TOLD])) or "no nodes"
        more = len(self.present) - TOLD
        tail = f" and {more} more" if more > 0 else ""
        return f"no node {self.address!r} on {self.bus}, expected one of its own: {shown}{tail}"


class _Seat:
    """A node's place on the bus and its appointments with the kernel."""

    __slots__ = ("address", "due", "node", "order", "standing")

    def __init__(self, node: Node, order: int) -> None:
        self.node = node
        self.order = order
        #: Where bytes are looked for that it must hear.
        self.address = node.address
        #: The appointment that counts, and all that stand, by their times.
        self.due: Ns | None = None
        self.standing: dict[Ns, Appointment] = {}


class Bus:
    """A line with nodes. Several buses may share a kernel; they share nothing else.

    ``lanes`` overrides the protocol's own (1 or 2). ``seed`` fixes everything left to chance.
    Add nodes, open ports (``sacbus.bus.port``), then run the kernel.
    """

    def __init__(
        self,
        kernel: Kernel,
        protocol: Protocol,
        *,
        name: str = "bus",
        rate: LineRate | None = None,
        lanes: int | None = None,
        seed: int = 0,
    ) -> None:
        self.kernel = kernel
        self.protocol = protocol
        self.name = name
        self._routes = _Routes(kernel, protocol)
        self.medium = Medium(
            kernel,
            rate or protocol.rate,
            self._routes,
            lanes=protocol.lanes if lanes is None else lanes,
            seed=seed,
        )
        self._routes.transmit = partial(self.medium.transmit, lane=self.medium.node_lane)
        #: Everything reported out of band, newest last, bounded; and counts by kind, unbounded.
        self.reports: deque[Report] = deque(maxlen=REPORTS_KEPT)
        self.report_counts: Counter[str] = Counter()
        #: Called with each report as it is made.
        self.report_watchers: list[Callable[[Report], None]] = []

    @property
    def rate(self) -> LineRate:
        """The rate of the line."""
        return self.medium.rate

    def tell(self, report: Report) -> None:
        """Take a report from a node; this is what a kind's ``create`` is given."""
        self.reports.append(report)
        self.report_counts[report.kind.value] += 1
        for watcher in tuple(self.report_watchers):
            watcher(report)

    def add(self, node: Node) -> None:
        """Put a node on the line. Two of one address both hear and both answer, as on wires."""
        self._routes.add(node)
        if isinstance(node, MistunedNode) and node.uart_baud is not None:
            self.medium.add_fault(WrongBaud(node.address, node.uart_baud))

    @property
    def nodes(self) -> Iterator[Node]:
        """The nodes in the order in which they were added."""
        return (seat.node for seat in self._routes.seats)

    def node(self, address: int) -> Node:
        """The first node with that address; :class:`NoSuchNode` names it."""
        for node in self.nodes:
            if node.address == address:
                return node
        raise NoSuchNode(address, self.name, [node.address for node in self.nodes])

    def touch(self, node: Node) -> None:
        """Ask a node anew when it wants to be woken, after it was driven from outside the bus."""
        self._routes.touch(node)


class _Routes:
    """Who hears what among the nodes, and when each of them wants to be woken."""

    def __init__(self, kernel: Kernel, protocol: Protocol) -> None:
        self._kernel = kernel
        self._addressed = protocol.addressed
        self.cuts = protocol.cuts
        self.seats: list[_Seat] = []
        self._by_address: dict[int, list[_Seat]] = {}
        #: Seats whose receiver stands open. A dict for its order: the same in every run.
        self._open: dict[_Seat, None] = {}
        self.transmit: Callable[[Node, bytes], object]

    def concerns(self, data: bytes) -> bool:
        if self._open:
            return True
        addresses = self._addressed(data)
        return addresses is None or bool(addresses)

    def add(self, node: Node) -> None:
        seat = _Seat(node, len(self.seats))
        self.seats.append(seat)
        self._by_address.setdefault(seat.address, []).append(seat)
        self._mind(seat)

    def touch(self, node: Node) -> None:
        for seat in self.seats:
            if seat.node is node:
                self._follow(seat)
                self._mind(seat)

    def address_of(self, sender: object) -> int | None:
        for seat in self.seats:
            if seat.node is sender:
                return seat.node.address
        return None

    def node_at(self, address: int) -> object | None:
        seats = self._by_address.get(address)
        return seats[0].node if seats else None

    def deliver_to(
        self, heard: Heard, sender: object, now: Ns, wanted: Callable[[int], bool]
    ) -> None:
        addresses = self._addressed(heard.data)
        chosen = self.seats if addresses is None else self._several(addresses, self._open)
        for seat in chosen:
            if seat.node is not sender and wanted(seat.address):
                seat.node.hear(heard, now)
                self._mind(seat)

    def deliver(self, heard: Heard, sender: object, now: Ns) -> None:
        addresses = self._addressed(heard.data)
        chosen: Sequence[_Seat]
        if addresses is None:
            chosen = self.seats
        elif self._open or len(addresses) > 1:
            chosen = self._several(addresses, self._open)
        elif addresses:
            chosen = self._by_address.get(addresses[0], ())
        else:
            return
        for seat in chosen:
            node = seat.node
            if node is not sender:
                node.hear(heard, now)
                self._mind(seat)

    def _several(self, addresses: Sequence[int], others: dict[_Seat, None]) -> list[_Seat]:
        chosen = dict(others)
        for address in addresses:
            for seat in self._by_address.get(address, ()):
                chosen[seat] = None
        return sorted(chosen, key=lambda seat: seat.order)

    def _mind(self, seat: _Seat) -> None:
        """See what a node wants after something was done to it: to hear all, and to be woken.

        Its next appointment is made, unless one as early stands already. One that stands for later
        is kept: usually the node will want it again (the end of its motion, after the answer that
        comes first). When it comes and does not count, nothing happens; when too many stand, those
        that do not count are cancelled. A node that is not quiet gets one that is punctual.
        """
        node = seat.node
        if node.receiving:
            self._open[seat] = None
        elif self._open:
            self._open.pop(seat, None)
        when = node.wake_at()
        if when is None:
            return
        kernel, standing = self._kernel, seat.standing
        if seat.due is None or when < seat.due:
            if when < kernel.now:
                when = kernel.now
            seat.due = when
            if when not in standing:
                if len(standing) >= STANDING:
                    for appointment in standing.values():
                        kernel.cancel(appointment)
                    standing.clear()
                make = kernel.at_leisure if node.quiet else kernel.at
                standing[when] = make(when, self._wake, seat, when)
                return
        if not node.quiet:
            # One that was made before may be quiet; what the node wants for later comes of it.
            kernel.hasten(standing[seat.due])

    def _wake(self, seat: _Seat, when: Ns) -> None:
        del seat.standing[when]
        if seat.due != when:
            return
        seat.due = None
        node = seat.node
        data = node.wake(when)
        if data:
            self.transmit(node, data)
        if node.address != seat.address:
            self._follow(seat)
        self._mind(seat)

    def _follow(self, seat: _Seat) -> None:
        """See to it that a node is found at the address that it has now."""
        self._by_address[seat.address].remove(seat)
        seat.address = seat.node.address
        seats = self._by_address.setdefault(seat.address, [])
        seats.append(seat)
        seats.sort(key=lambda one: one.order)
