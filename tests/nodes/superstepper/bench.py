"""A Super Stepper Bus in kernel time, with a master who says what she is told, byte for byte."""

from __future__ import annotations

from typing import NamedTuple

from nodes.superstepper import KIND, SuperStepperNode
from sacbus.bus import Bus, Port
from sacbus.kernel import Kernel, LineRate, Ns
from sacbus.node import Heard, settings_from
from sacbus.wire.superstepper import Answer, Message, decode_answer, encode


class Said(NamedTuple):
    """What the modules' lane brought, and when its first bit began."""

    at: Ns
    data: bytes


class Bench:
    """Modules at addresses, of one mode; ``settings`` are theirs."""

    def __init__(
        self, *addresses: int, nine: bool = False, baud: int = 9_600, **settings: object
    ) -> None:
        if nine:
            settings["jmp2"] = "closed"
        model = settings_from(KIND.settings, settings)
        assert isinstance(model, KIND.settings)
        protocol = KIND.speaks(model)
        self.nine = nine
        self.kernel = Kernel()
        rate = LineRate(baud, protocol.rate.bits)
        self.bus = Bus(self.kernel, protocol, rate=rate, seed=1)
        self.nodes: list[SuperStepperNode] = []
        for address in addresses:
            node = KIND.create(address, model, rate, self.bus.tell)
            self.bus.add(node)
            self.nodes.append(node)
        self.heard: list[Said] = []
        self.port = Port(self.bus.medium, self._hear, latency=0)

    def _hear(self, heard: Heard, _now: Ns) -> None:
        self.heard.append(Said(heard.begins(0), heard.data))

    @property
    def now(self) -> Ns:
        return self.kernel.now

    @property
    def node(self) -> SuperStepperNode:
        return self.nodes[0]

    def span(self, count: int) -> Ns:
        return self.bus.rate.span(count)

    def talk(self, data: bytes, ninth: bytes | None = None) -> None:
        """Bytes from now on; in 9-bit mode the first is marked unless said otherwise."""
        marks = bytes((1,)) + bytes(len(data) - 1) if ninth is None else ninth
        self.port.talk(data, marks if self.nine else 0)

    def run(self, time: Ns) -> None:
        self.kernel.run_until(self.now + time)

    def exchange(self, data: str) -> str:
        """Bytes in hexadecimal, and what is answered in the time of 20 bytes and 10 ms."""
        self.heard.clear()
        sent = bytes.fromhex(data)
        self.talk(sent)
        self.run(self.span(len(sent) + 20) + 10_000_000)
        return b"".join(one.data for one in self.heard).hex(" ")

    def ask(self, address: int, message: Message) -> Answer:
        """A message, and its answer; bus time stands at its end then."""
        self.heard.clear()
        self.talk(encode(address, message))
        while not self.heard and self.kernel.run_next():
            pass
        answer = decode_answer(self.heard[0].data)
        assert answer is not None, self.heard
        return answer

    def execute(self, message: Message) -> Ns:
        """Have the first module execute a message now, past its line; when that was."""
        node = self.node
        node.now = self.now
        node.message(message, self.now)
        node.look(self.now)
        self.bus.touch(node)
        return self.now
