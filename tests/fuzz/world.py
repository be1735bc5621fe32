"""The world of the fuzz: nodes of every setting on one line, and what is done to them.

Owns the deeds, and how little bus time is between two of them: loops that are endless and quick
cost a bounded number of events. The line is fast, so that a line of text takes some 100 us of it.
Nodes that got themselves lost (another rate, ports exchanged) are powered off and on with RST low.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from random import Random
from time import perf_counter
from typing import Final

from nodes.sac import KIND, SacNode, SacSettings
from sacbus.bus import Bus, Port
from sacbus.kernel import MS, SECOND, US, Kernel, LineRate, Ns
from sacbus.wire import GENERAL_CALL, STX, encode
from tests.fuzz.lines import Lines

__all__ = ["Deed", "World"]

Deed = tuple[str, int, bytes]
"""What was done, to which node (by its place), and with which bytes."""

RATE: Final = LineRate(2_000_000)

_SETTINGS: Final = (
    SacSettings(),
    SacSettings(turnaround=False, deaf_time=False),
    SacSettings(turnaround=False, deaf_time=False, receiver="robust", ustep=3),
    SacSettings(turnaround=False, deaf_time=False, soft_ops=True, ppm=100),
    SacSettings(turnaround=False, deaf_time=False, auto_micro=True, ustep=4, ack=False),
    SacSettings(
        turnaround=False, deaf_time=False, linear=True, pull_in=200, pull_out="0:900,600:9"
    ),
    SacSettings(turnaround=False, deaf_time=False, clock=False, xclk_hz=1_000_000, ack=False),
    SacSettings(turnaround=False, deaf_time=False, autorun=3, ack=False, crc=False),
)
_FIRST: Final = 10

#: Who has a line to himself.
_ROBUST: Final = 2
#: Whose pins are watched; it costs time.
_WATCHED: Final = 3

#: Events that are run after a deed at most.
_EVENTS: Final = 24
#: Lines between two looks after the nodes, when all that runs is stopped.
_ROUND: Final = 400
#: Deeds that are remembered for who must know what happened last.
_REMEMBERED: Final = 40

_INPUTS: Final = (b"sync", b"enA", b"enB", b"enA", b"enB", b"estop", b"xclk")


class World:
    """Everything that is fuzzed, from one seed."""

    def __init__(self, seed: int) -> None:
        self._rng = Random(seed)
        self._lines = Lines(self._rng)
        self.kernel = Kernel()
        #: Two lines: a robust receiver hears all that is said on its own, and takes its time.
        self.buses = [Bus(self.kernel, KIND.protocol, rate=RATE, seed=seed) for _ in range(2)]
        self._ports = [Port(bus.medium, lambda _heard, _now: None, latency=0) for bus in self.buses]
        self.nodes: list[SacNode] = []
        for place, settings in enumerate(_SETTINGS):
            bus = self._bus(place)
            node = KIND.create(_FIRST + place, settings, RATE, bus.tell)
            bus.add(node)
            node.terminal.show = self._shown
            if place == _WATCHED:
                node.pins.watch(self._edge, 0)
            self.nodes.append(node)
        #: What was done last, oldest first.
        self.deeds: deque[Deed] = deque(maxlen=_REMEMBERED)
        #: Lines sent so far, over the network and at terminals; bytes that terminals showed.
        self.sent = 0
        self.typed = 0
        self.shown = 0
        #: What took longest of all, in seconds: a line that is slow is a defect as well.
        self.slowest: tuple[float, Deed] = (0.0, ("nothing", 0, b""))
        self._until_round = _ROUND
        self._deeds = self._weighed()

    @property
    def lines(self) -> int:
        """Lines of all kinds so far."""
        return self.sent + self.typed

    def _bus(self, place: int) -> Bus:
        return self.buses[place == _ROBUST]

    def _shown(self, text: bytes) -> None:
        self.shown += len(text)

    def _edge(self, pin: str, level: int, when: Ns) -> None:
        pass

    def _weighed(self) -> list[Callable[[int], None]]:
        """The deeds, each as often as it is to be drawn."""
        return [
            *(self._send,) * 30,
            *(self._type,) * 20,
            *(self._send_spoilt,) * 2,
            *(self._drive, self._look, self._look),
            *(self._wait,),
        ]

    def go_on(self, lines: int) -> None:
        """Do things until so many more lines have come; what raises here is a defect."""
        rng, until = self._rng, self.lines + lines
        while self.lines < until:
            deed = self._deeds[int(rng.random() * len(self._deeds))]
            before, begun = self.lines, perf_counter()
            deed(int(rng.random() * len(self.nodes)))
            self._until_round -= self.lines - before
            spent = perf_counter() - begun
            if spent > self.slowest[0]:
                self.slowest = (spent, self.deeds[-1])
            if self._until_round <= 0:
                self._until_round = _ROUND
                self._look_after_nodes()

    # ---- the line ----

    def _send(self, place: int) -> None:
        """A line in a good packet; some without CRC, some to everybody.

        To a node that answers nothing several in a row, since no answer comes between.
        """
        node = self.nodes[place]
        count = 1 if node.board.network.ack else 1 + int(self._rng.random() * 8)
        self._talk("packets", place, b"".join([self._packet(node) for _ in range(count)]), count)

    def _packet(self, node: SacNode) -> bytes:
        chance = int(self._rng.random() * 64)
        to = GENERAL_CALL if chance == 0 else node.address
        return encode(to, 1 + chance, self._lines.next(), crc=chance != 1)

    def _send_spoilt(self, place: int) -> None:
        """A packet with a byte changed, or cut short; or noise that begins like one."""
        rng, node = self._rng, self.nodes[place]
        data = bytearray(encode(node.address, 1, self._lines.next()))
        if rng.random() < 0.2:
            data[:] = bytes((STX, node.address)) + rng.randbytes(int(rng.random() * 60))
        elif rng.random() < 0.3:
            del data[int(rng.random() * len(data)) + 1 :]
        else:
            data[int(rng.random() * len(data))] ^= 1 << int(rng.random() * 8)
        self._talk("spoilt", place, bytes(data))

    def _talk(self, deed: str, place: int, data: bytes, lines: int = 1) -> None:
        self.deeds.append((deed, place, data))
        self.sent += lines
        medium = self._bus(place).medium
        end = medium.transmit(self._ports[place == _ROBUST], data, medium.master_lane).end
        # Only one of them has the times of the device; it gets the time for them.
        self._run_until(end + (2 * MS if place == 0 else 30 * US))
        if self.kernel.now < end:
            self._stop_all()
            self.kernel.run_until(end)

    # ---- the terminals ----

    def _type(self, place: int) -> None:
        """Some lines at once, as pasted."""
        keys = bytearray()
        count = 1 + int(self._rng.random() * 8)
        for _ in range(count):
            keys += self._lines.next() + b"\r"
        self.deeds.append(("type", place, bytes(keys)))
        self.typed += count
        node = self.nodes[place]
        node.terminal.type(bytes(keys), self.kernel.now)
        self._bus(place).touch(node)
        self._run_until(self.kernel.now + 100 * US)

    # ---- the rest ----

    def _drive(self, place: int) -> None:
        rng, node = self._rng, self.nodes[place]
        pin = _INPUTS[int(rng.random() * len(_INPUTS))]
        level = int(rng.random() * 2)
        self.deeds.append(("drive", place, b"%b=%d" % (pin, level)))
        scale = 1_000_000 if pin == b"xclk" else 1
        node.pins.drive(pin.decode(), level * scale, self.kernel.now)
        self._bus(place).touch(node)

    def _look(self, place: int) -> None:
        self.deeds.append(("look", place, b""))
        self.nodes[place].snapshot(self.kernel.now)

    def _wait(self, place: int) -> None:
        self.deeds.append(("wait", place, b""))
        self._run_until(self.kernel.now + int(self._rng.random() ** 4 * 5 * SECOND))

    def _run_until(self, until: Ns) -> None:
        """Run what is due until then, if that is not too much: then no further than that."""
        kernel = self.kernel
        for _ in range(_EVENTS):
            due = kernel.next_at()
            if due is None or due > until:
                kernel.run_until(until)
                return
            kernel.run_until(due)

    def _stop_all(self) -> None:
        """E-stop on all nodes: it works whatever a node has got itself into."""
        for place, node in enumerate(self.nodes):
            self.deeds.append(("drive", place, b"estop=0, then 1"))
            for level in (0, 1):
                node.pins.drive("estop", level, self.kernel.now)
            self._bus(place).touch(node)

    def _look_after_nodes(self) -> None:
        """Power one node off and on, and bring back those that have got themselves lost."""
        self._stop_all()
        rng = self._rng
        chosen = int(rng.random() * len(self.nodes))
        for place, node in enumerate(self.nodes):
            memory = node.board.obeyed
            lost = memory.network or memory.sw != RATE.baud or node.address != _FIRST + place
            if not lost and place != chosen:
                continue
            # RST that is low restores the factory's memory, also where no key is heard.
            self.deeds.append(("power", place, b"rst=%d" % (not lost)))
            node.pins.drive("rst", int(not lost), self.kernel.now)
            for on in (False, True):
                node.power(on=on, now=self.kernel.now)
            self._bus(place).touch(node)
        self._run_until(self.kernel.now + SECOND)
