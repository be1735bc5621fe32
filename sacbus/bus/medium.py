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

Faults strike a transmission as it begins (:mod:`sacbus.bus.fault`). One that they leave alone goes
the way above; what they touch goes another, as a :class:`~sacbus.bus.passage.Passage`, in pieces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from operator import eq

from sacbus.bus.around import Listener, Router, Tap
from sacbus.bus.fault import Fault, FaultOn
from sacbus.bus.passage import EVERY_LINK, Passage
from sacbus.bus.transmission import Transmission
from sacbus.kernel import Kernel, LineRate, Ns
from sacbus.node import Heard

__all__ = ["LaneCounters", "Medium"]


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
        #: What fixes how overlapped bytes arrive (:meth:`Transmission.arrived`).
        self.seed = seed
        self._sent = 0
        #: Called with each transmission when it is over; for traces and live displays.
        self.watchers: list[Callable[[Transmission], None]] = []
        self._taps: list[tuple[object, Tap]] = []
        #: The faults that are on, in the order in which they were put on; and how many ever were.
        self.faults: list[FaultOn] = []
        self._faults_ever = 0
        #: Called with each fault after it was put on, and after it was taken off.
        self.fault_watchers: list[Callable[[FaultOn], None]] = []

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
        place = self._lanes[lane]
        place.listeners = [*place.listeners, (owner, listener)]

    def unlisten(self, lane: int, listener: Listener) -> None:
        """Forget a listener; nothing happens if it was not there."""
        # A new list: the old one may be being walked through.
        place = self._lanes[lane]
        place.listeners = [entry for entry in place.listeners if entry[1] is not listener]

    def tap(self, tap: Tap, owner: object) -> None:
        """Have ``tap`` told of what begins on any lane, but for what ``owner`` itself sends."""
        self._taps = [*self._taps, (owner, tap)]

    def untap(self, tap: Tap) -> None:
        """Forget a tap; nothing happens if it was not there."""
        self._taps = [entry for entry in self._taps if entry[1] is not tap]

    def add_fault(
        self,
        fault: Fault,
        through: Callable[[Callable[[], object]], object] = lambda act: act(),
    ) -> FaultOn:
        """Put a fault on the line now; :meth:`FaultOn.off` takes it off.

        ``through`` brings bus time up to date before it does what it is given; without it, whoever
        puts faults on and off does so in bus time.
        """
        on = FaultOn(fault, self, self._faults_ever, through)
        self._faults_ever += 1
        self.faults = [*self.faults, on]
        for watcher in tuple(self.fault_watchers):
            watcher(on)
        return on

    def drop_fault(self, on: FaultOn) -> None:
        """What :meth:`FaultOn.off` does; what has begun ends as it began."""
        self.faults = [one for one in self.faults if one is not on]
        for watcher in tuple(self.fault_watchers):
            watcher(on)

    def node_at(self, address: int) -> object | None:
        """The first node with that address; None without one."""
        return self._router.node_at(address)

    def transmit(
        self, sender: object, data: bytes, lane: int, ninth: bytes | None = None
    ) -> Transmission:
        """Begin to send ``data`` (not empty) now. Nobody is kept from talking over another."""
        kernel = self.kernel
        now = kernel.now
        place = self._lanes[lane]
        rate = self.rate
        size = len(data)
        span = rate.span(size)
        cuts = self._router.cuts(data) if lane == 0 else ()
        end = now + span
        self._sent = number = self._sent + 1
        sent = Transmission(number, sender, lane, now, data, rate, end, cuts, ninth)
        if self.faults and self._struck(sent):
            return sent
        counters = place.counters
        counters.transmissions += 1
        counters.bytes += size
        counters.busy += span
        free_at = place.free_at
        if free_at is not None and free_at > now:
            self._collide(place, sent)
            if end < free_at:
                end = free_at
        else:
            place.active.clear()
        place.active.append(sent)
        place.free_at = end
        if cuts:
            kernel.at(now + rate.span(cuts[0]), self._arrive, sent)
        else:
            kernel.at(sent.end, self._arrive_whole, sent)
        if self._taps:
            self._begin(sent)
        return sent

    def relay(self, sender: object, data: bytes, lane: int) -> Transmission:
        """``data`` (not empty) has come over a real line that this one goes on with.

        It has taken its time there, so it has ended by now, or ends as early as what is on the lane
        lets it: half duplex, nobody hears while talking. It collides with nothing here; what may
        have happened to it happened on the real line.
        """
        kernel = self.kernel
        now = kernel.now
        place = self._lanes[lane]
        span = self.rate.span(len(data))
        start = max(now - span, 0)
        if place.free_at is not None and place.free_at > start:
            start = place.free_at
        cuts = self._router.cuts(data) if lane == 0 else ()
        self._sent += 1
        sent = Transmission(self._sent, sender, lane, start, data, self.rate, start + span, cuts)
        if self.faults and self._struck(sent, collides=False):
            return sent
        place.counters.transmissions += 1
        place.counters.bytes += len(data)
        place.counters.busy += span
        place.free_at = sent.end
        if cuts:
            kernel.at(start + self.rate.span(cuts[0]), self._arrive, sent)
        else:
            kernel.at(sent.end, self._arrive_whole, sent)
        if self._taps:
            self._begin(sent)
        return sent

    def _begin(self, sent: Transmission) -> None:
        for owner, tap in self._taps:
            if owner is not sent.sender:
                tap.begun(sent)

    def _collide(self, place: _Lane, sent: Transmission) -> None:
        """``sent`` begins while others are on their way: what overlaps is spoilt in both."""
        place.active = [other for other in place.active if other.end > sent.start]
        for other in place.active:
            end = min(sent.end, other.end)
            for one in (other, sent):
                place.counters.collided += one.hit(sent.start, end)

    def _arrive_whole(self, sent: Transmission) -> None:
        """A transmission without cuts has arrived, as those of nodes are: :meth:`_arrive` in one.

        Half of all are of this kind.
        """
        now = self.kernel.now
        sender = sent.sender
        if sent.hits is None and sent.ninth is None:
            heard = Heard(sent.data, sent.start, 0, sent.rate, b"")
        else:
            heard = self._heard(sent, 0, len(sent.data))
        if sent.lane == 0:
            self._router.deliver(heard, sender, now)
        for owner, listener in self._lanes[sent.lane].listeners:
            if owner is not sender:
                listener.hear(heard, now)
        for watcher in tuple(self.watchers):
            watcher(sent)

    def _arrive(self, sent: Transmission) -> None:
        """Some of a transmission has arrived: up to its next cut, or all of it."""
        now = self.kernel.now
        data = sent.data
        cuts = sent.cuts
        step = sent.step
        size = upto = len(data)
        if step < len(cuts):
            upto = cuts[step]
        lane = sent.lane
        sender = sent.sender
        place = self._lanes[lane]
        heard = None
        if lane == 0:
            first = sent.to_nodes
            hit = sent.hits is not None
            arrived = self._spoilt(sent, first, upto) if hit else data[first:upto]
            heard = Heard(arrived, sent.start, first, self.rate, data[upto:])
            if sent.ninth is not None:
                heard.ninth = sent.ninth_bits(first, upto, self.seed)
            if hit:
                heard.framing = sent.framing_errors(first, upto, self.seed)
            self._router.deliver(heard, sender, now)
        # Listeners hear whole frames: up to a cut that is not followed by another a byte later, and
        # at the end. (What follows the last cut of a packet is its NUL; to hear that apart would
        # only cost them.)
        if place.listeners and (
            upto == size or (step < len(cuts) - 1 and cuts[step + 1] > upto + 1)
        ):
            if heard is None or sent.to_listeners != sent.to_nodes:
                first = sent.to_listeners
                heard = Heard(
                    self._spoilt(sent, first, upto), sent.start, first, self.rate, data[upto:]
                )
                if sent.ninth is not None:
                    heard.ninth = sent.ninth_bits(first, upto, self.seed)
            sent.to_listeners = upto
            for owner, listener in place.listeners:
                if owner is not sender:
                    listener.hear(heard, now)
        if upto == size:
            for watcher in tuple(self.watchers):
                watcher(sent)
            return
        sent.to_nodes = upto
        sent.step = step = step + 1
        if step < len(cuts):
            self.kernel.at(sent.start + self.rate.span(cuts[step]), self._arrive, sent)
        elif self._rest_matters(place, sent, upto):
            self.kernel.at(sent.end, self._arrive, sent)

    # ---- under faults ----

    def _struck(self, sent: Transmission, *, collides: bool = True) -> bool:
        """Let the faults strike what begins; False if none of them did: then nothing has happened.

        Otherwise it is on its way, to arrive in pieces.
        """
        passage = Passage(sent, self._router.address_of)
        for on in self.faults:
            if on.strike is not None:
                on.strike(passage)
        if not passage.concerns:
            return False
        sent.passage = passage
        if passage.end is not None:
            sent.end = passage.end
        if not passage.silent:
            pieces = passage.pieces()
            if pieces:
                # The line is taken until the last byte has arrived, however late it is.
                sent.end = max(sent.end, pieces[-1].end)
            self._occupy(sent, passage, collides=collides)
            for piece in pieces:
                self._send_piece(piece, passage, passage.reaches)
            for address, rate in passage.receivers.items():
                for piece in passage.as_read_at(rate).pieces(rate):
                    self._send_piece(piece, passage, partial(eq, address))
            if self._taps and passage.reaches(EVERY_LINK):
                self._begin(sent)
        if not passage.left:
            self.kernel.at(sent.end, self._end, sent)
        return True

    def _occupy(self, sent: Transmission, passage: Passage, *, collides: bool) -> None:
        """Take the lane for as long as it lasts, from all on the same side of every cut."""
        place = self._lanes[sent.lane]
        counters = place.counters
        counters.transmissions += 1
        counters.bytes += len(sent.data)
        counters.busy += sent.end - sent.start
        if collides:
            place.active = [other for other in place.active if other.end > sent.start]
            for other in place.active:
                if other.passage is None or other.passage.side == passage.side:
                    end = min(sent.end, other.end)
                    for one in (other, sent):
                        counters.collided += one.hit(sent.start, end)
            place.active.append(sent)
        # What is behind a cut keeps nobody before it waiting.
        if not any(passage.side):
            place.free_at = max(sent.end, place.free_at or 0)

    def _send_piece(
        self, piece: Transmission, passage: Passage, reaches: Callable[[int | None], bool]
    ) -> None:
        piece.cuts = self._router.cuts(piece.data) if piece.lane == 0 else ()
        passage.left += 1
        self._appoint_piece(piece, passage, reaches)

    def _appoint_piece(
        self, piece: Transmission, passage: Passage, reaches: Callable[[int | None], bool]
    ) -> None:
        """Have the piece arrive up to its next cut, or to its end."""
        end = piece.end
        if piece.step < len(piece.cuts):
            end = piece.start + piece.rate.span(piece.cuts[piece.step])
        self.kernel.at(end, self._arrive_piece, piece, passage, reaches)

    def _arrive_piece(
        self, piece: Transmission, passage: Passage, reaches: Callable[[int | None], bool]
    ) -> None:
        """As :meth:`_arrive`, for one piece and those whom it reaches."""
        now = self.kernel.now
        sent = passage.sent
        # What overlapped the whole overlapped its pieces.
        piece.hits = sent.hits
        cuts, step, size = piece.cuts, piece.step, len(piece.data)
        upto = cuts[step] if step < len(cuts) else size
        if piece.lane == 0:
            heard = self._heard(piece, piece.to_nodes, upto)
            self._router.deliver_to(heard, piece.sender, now, reaches)
        piece.to_nodes = upto
        whole = upto == size or (step < len(cuts) - 1 and cuts[step + 1] > upto + 1)
        listeners = self._lanes[piece.lane].listeners
        if whole and listeners and reaches(EVERY_LINK):
            heard = self._heard(piece, piece.to_listeners, upto)
            piece.to_listeners = upto
            for owner, listener in listeners:
                if owner is not piece.sender or (passage.echoes and passage.echoes(listener)):
                    late = passage.late(listener) if passage.late else 0
                    if late:
                        self.kernel.at(now + late, self._give, piece.lane, listener, heard)
                    else:
                        listener.hear(heard, now)
        if upto < size:
            piece.step += 1
            self._appoint_piece(piece, passage, reaches)
            return
        passage.left -= 1
        if not passage.left:
            # Later than the last piece when the end of it was lost.
            self.kernel.at(sent.end, self._end, sent)

    def _give(self, lane: int, listener: Listener, heard: Heard) -> None:
        """Hand on what came late, unless the listener has left."""
        if any(one is listener for _, one in self._lanes[lane].listeners):
            listener.hear(heard, self.kernel.now)

    def _heard(self, piece: Transmission, first: int, upto: int) -> Heard:
        return Heard(
            self._spoilt(piece, first, upto),
            piece.start,
            first,
            piece.rate,
            piece.data[upto:],
            piece.ninth_bits(first, upto, self.seed),
            piece.framing_errors(first, upto, self.seed),
        )

    def _end(self, sent: Transmission) -> None:
        """What faults had touched is over."""
        for watcher in tuple(self.watchers):
            watcher(sent)

    def _spoilt(self, sent: Transmission, first: int, last: int) -> bytes:
        return sent.arrived(first, last, self.seed)

    def _rest_matters(self, place: _Lane, sent: Transmission, upto: int) -> bool:
        """Whether anybody will notice what follows the last cut (for one SAC packet: its NUL)."""
        if self.watchers or sent.hits is not None:
            return True
        sender = sent.sender
        for owner, _ in place.listeners:
            if owner is not sender:
                return True
        return self._router.concerns(sent.data[upto:])
