"""The medium: who drives the line when, and what arrives where.

Owns transmissions, lanes, line time, collisions and their counts. Knows bytes and times, and of a
protocol only its :class:`~sacbus.node.Protocol`; what a packet means is nobody's business here.

Theory of operation. A transmission occupies its lane for 10 bits a byte (11 with a ninth bit) from
its start on. There is no event a byte: a transmission is delivered to nodes at the instants at
which one of them may have to act (the protocol's *cuts*: for SAC the byte after ETX) and at its
end, to those nodes that it addresses and to those whose receiver stands open. All other nodes'
receivers are provably idle, so an idle node costs nothing. Listeners (links, mother, monitors) hear
everything, frame by frame. Everyone is handed bytes with their times.

Two transmissions that overlap on a lane collide: every byte that was touched arrives as another
value, in both, and both are counted. What had arrived before the overlap had arrived.

Faults (bit errors, noise, a cut line) will act in :meth:`Medium._arrive`, where a transmission
becomes what is heard.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Protocol as Contract

from sacbus.bus.transmission import Transmission
from sacbus.kernel import Kernel, LineRate, Ns
from sacbus.node import Heard

__all__ = ["LaneCounters", "Listener", "Medium", "Router"]


class Listener(Contract):
    """Whoever hears all bytes of a lane, bytes of overlapped transmissions included."""

    def hear(self, heard: Heard, now: Ns) -> None:
        """Some bytes have arrived; called in the order of their last bytes."""
        ...


class Router(Contract):
    """Who must hear what, as the bus knows it."""

    def cuts(self, data: bytes) -> list[int] | tuple[int, ...]:
        """Offsets before the end at which a node may have to act."""
        ...

    def deliver(self, heard: Heard, sender: object, now: Ns) -> None:
        """Hand some bytes to the nodes that they concern."""
        ...

    def concerns(self, data: bytes) -> bool:
        """Whether any node would be handed this if it arrived next."""
        ...


@dataclass(slots=True)
class LaneCounters:
    """What has happened on a lane so far. Times in ns, the rest in pieces."""

    transmissions: int = 0
    bytes: int = 0
    #: Transmissions that another one overlapped; each counts once.
    collided: int = 0
    #: Sum of the line time of all transmissions; overlapped time counts for each of them.
    busy: Ns = 0


class _Lane:
    __slots__ = ("active", "counters", "free_at", "listeners")

    def __init__(self) -> None:
        self.active: list[Transmission] = []
        #: When the last of all transmissions so far ends, or has ended.
        self.free_at: Ns | None = None
        self.listeners: list[tuple[object, Listener]] = []
        self.counters = LaneCounters()


class Medium:
    """One line of ``lanes`` lanes: 1 (two-wire RS485) or 2 (the master sends on 0, nodes on 1).

    ``seed`` fixes what overlapped bytes turn into.
    """

    def __init__(
        self, kernel: Kernel, rate: LineRate, router: Router, *, lanes: int = 1, seed: int = 0
    ) -> None:
        if lanes not in (1, 2):
            raise ValueError(f"lanes: expected 1 or 2, got {lanes}")
        self.kernel = kernel
        self.rate = rate
        self._router = router
        self._lanes = [_Lane() for _ in range(lanes)]
        self._noise = Random(seed)
        #: Called with each transmission when it is over; for traces and live displays.
        self.watchers: list[Callable[[Transmission], None]] = []

    @property
    def lanes(self) -> int:
        """How many lanes there are."""
        return len(self._lanes)

    @property
    def master_lane(self) -> int:
        """The lane that the master and all links talk on and the nodes hear."""
        return 0

    @property
    def node_lane(self) -> int:
        """The lane that nodes talk on and the master hears."""
        return len(self._lanes) - 1

    def counters(self, lane: int = 0) -> LaneCounters:
        """The counts of a lane, live."""
        return self._lanes[lane].counters

    def free_at(self, lane: int) -> Ns | None:
        """When the lane is, or has been, free of all transmissions begun so far; None: ever."""
        return self._lanes[lane].free_at

    def listen(self, lane: int, listener: Listener, owner: object) -> None:
        """Have ``listener`` hear a lane; what ``owner`` itself sends there is left out."""
        self._lanes[lane].listeners.append((owner, listener))

    def unlisten(self, lane: int, listener: Listener) -> None:
        """Forget a listener; nothing happens if it was not there."""
        entries = self._lanes[lane].listeners
        entries[:] = [entry for entry in entries if entry[1] is not listener]

    def transmit(self, sender: object, data: bytes, lane: int) -> Transmission:
        """Begin to send ``data`` (not empty) now. Nobody is kept from talking over another."""
        kernel = self.kernel
        now = kernel.now
        place = self._lanes[lane]
        span = self.rate.span(len(data))
        sent = Transmission(sender, now, data, self.rate, now + span)
        counters = place.counters
        counters.transmissions += 1
        counters.bytes += len(data)
        counters.busy += span
        if place.free_at is not None and place.free_at > now:
            self._collide(place, sent)
            place.active.append(sent)
            place.free_at = max(place.free_at, sent.end)
        else:
            place.active = [sent]
            place.free_at = sent.end
        cuts = self._router.cuts(data) if lane == 0 else ()
        self._await(place, sent, cuts, 0, 0, 0)
        return sent

    def _collide(self, place: _Lane, sent: Transmission) -> None:
        for other in place.active:
            if other.end <= sent.start:
                continue
            hit = (sent.start, min(sent.end, other.end))
            for one in (other, sent):
                if not one.hits:
                    place.counters.collided += 1
                one.hits.append(hit)
        place.active = [other for other in place.active if other.end > sent.start]

    def _await(
        self,
        place: _Lane,
        sent: Transmission,
        cuts: list[int] | tuple[int, ...],
        step: int,
        heard_by_nodes: int,
        heard_by_listeners: int,
    ) -> None:
        """Make the appointment for the next instant at which somebody hears some of ``sent``."""
        upto = cuts[step] if step < len(cuts) else len(sent.data)
        self.kernel.at(
            sent.start + self.rate.span(upto),
            self._arrive,
            place,
            sent,
            cuts,
            step,
            upto,
            heard_by_nodes,
            heard_by_listeners,
        )

    def _arrive(
        self,
        place: _Lane,
        sent: Transmission,
        cuts: list[int] | tuple[int, ...],
        step: int,
        upto: int,
        heard_by_nodes: int,
        heard_by_listeners: int,
    ) -> None:
        now = self.kernel.now
        size = len(sent.data)
        # Listeners hear whole frames: all cuts but the last, and the end. (What follows the last
        # cut of a single packet is its NUL; to hear that apart would only cost them.)
        for_listeners = bool(place.listeners) and (upto == size or step < len(cuts) - 1)
        heard = None
        if place is self._lanes[0]:
            heard = Heard(
                sent.arrived(heard_by_nodes, upto, self._noise),
                sent.start,
                heard_by_nodes,
                self.rate,
                sent.data[upto:],
            )
            self._router.deliver(heard, sent.sender, now)
        if for_listeners:
            if heard is None or heard_by_listeners != heard_by_nodes:
                heard = Heard(
                    sent.arrived(heard_by_listeners, upto, self._noise),
                    sent.start,
                    heard_by_listeners,
                    self.rate,
                    sent.data[upto:],
                )
            heard_by_listeners = upto
            for owner, listener in tuple(place.listeners):
                if owner is not sent.sender:
                    listener.hear(heard, now)
        if upto < size:
            if self._matters(place, sent, upto) or step + 1 < len(cuts):
                self._await(place, sent, cuts, step + 1, upto, heard_by_listeners)
        else:
            for watcher in self.watchers:
                watcher(sent)

    def _matters(self, place: _Lane, sent: Transmission, upto: int) -> bool:
        """Whether anybody will notice what follows the last cut (for one SAC packet: its NUL)."""
        return (
            bool(self.watchers)
            or self._router.concerns(sent.data[upto:])
            or any(owner is not sent.sender for owner, _ in place.listeners)
        )
