"""A node's panel, in the hands of who hosts its bus: what can be seen of it and done to it.

Owns the way from outside the bus to a node's pins, encoder, switch and terminal: bus time is
brought up to date first, and the bus asks the node anew what it wants to do next. What a pin does
is the node's affair.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final, NamedTuple

from sacbus.bus import Bus
from sacbus.console import Console
from sacbus.host import Host
from sacbus.kernel import Ns
from sacbus.node import Node, PinError, Pins, Snapshot

__all__ = ["ENCODER", "Deed", "Drive", "Panel", "Power", "Turn"]

#: The encoder's inputs, by the names that a node with an encoder gives them.
ENCODER: Final = ("enA", "enB")

#: What becomes of them in the four quarters of a clockwise detent, from rest, both high.
_QUARTERS: Final = ((0, 0), (1, 0), (0, 1), (1, 1))


class Drive(NamedTuple):
    """An input is driven to a level."""

    pin: str
    level: int


class Turn(NamedTuple):
    """The encoder is turned by so many detents, clockwise positive."""

    detents: int


class Power(NamedTuple):
    """The node is switched on or off."""

    on: bool


#: What is done to a node at its panel, for who records it.
Deed = Drive | Turn | Power


class Panel:
    """One node as it stands on the bench, in virtual time as in real time.

    ::

        panel = bus.panel(10)
        panel.level("op_sa")               # 1 while a command runs
        panel.drive("sync", 0)             # the held command starts
        panel.turn(-3)                     # three detents of the encoder, counterclockwise
        panel.watch(print)                 # op_sa 1 2000040000 ...
        panel.power(on=False)

    Deeds are done at once, at the bus time that is now. Names of pins, and levels, that the node
    does not have are refused with PinError, a line that a user can act on.
    """

    def __init__(
        self,
        node: Node,
        bus: Bus,
        host: Host,
        deeds: Sequence[Callable[[Node, Deed], object]] = (),
    ) -> None:
        """``deeds``: who is told of each deed once it is done, at the same instant."""
        self.node = node
        self._deeds = deeds
        self._bus = bus
        self._host = host
        self._console: Console | None = None
        #: By what stands for each call of :meth:`watch`.
        self._watchers: dict[object, Callable[[str, int, Ns], object]] = {}

    @property
    def console(self) -> Console | None:
        """Its terminal; None if its kind has none."""
        if self._console is None and (port := self.node.terminal) is not None:
            self._console = Console(self.node, port, self._bus, self._host)
        return self._console

    def snapshot(self) -> Snapshot:
        """The node as it is now."""
        return self.node.snapshot(self._host.catch_up())

    def level(self, pin: str) -> int:
        """The level of a pin now, whether it is driven or drives; xclk: Hz."""
        return self._pins().level(pin, self._host.catch_up())

    def check(self, pin: str, level: int) -> None:
        """PinError unless ``drive`` would take these."""
        self._pins().check(pin, level)

    def drive(self, pin: str, level: int) -> None:
        """Drive an input to a level now; xclk: to a frequency in Hz."""
        pins = self._pins()
        pins.check(pin, level)

        def drive(now: Ns) -> None:
            pins.drive(pin, level, now)
            self._done(Drive(pin, level))

        self._do(drive)

    def turn(self, detents: int) -> None:
        """Turn the encoder by so many detents, clockwise positive, all of them now."""
        pins = self._pins()

        def quarters(now: Ns) -> None:
            for _ in range(abs(detents)):
                for which, level in _QUARTERS:
                    # Counterclockwise the second one goes before the first.
                    pins.drive(ENCODER[which if detents > 0 else 1 - which], level, now)
            self._done(Turn(detents))

        self._do(quarters)

    def power(self, *, on: bool) -> None:
        """Switch the node off, or on again for a cold boot; nothing if it is that already."""

        def switch(now: Ns) -> None:
            self.node.power(on=on, now=now)
            self._done(Power(on))

        self._do(switch)

    def watch(self, watcher: Callable[[str, int, Ns], object]) -> Callable[[], None]:
        """Have ``watcher(pin, level, when)`` called at each edge of an output from now on.

        Which outputs are told of, the node says (``sacbus.node.Pins.told``). What is given ends it.
        """
        pins = self._pins()
        watch = object()

        def begin(now: Ns) -> None:
            if not self._watchers:
                pins.watch(self._tell, now)
            self._watchers[watch] = watcher

        def stop(now: Ns) -> None:
            if self._watchers.pop(watch, None) is not None and not self._watchers:
                pins.watch(None, now)

        self._do(begin)
        return partial(self._do, stop)

    def _done(self, deed: Deed) -> None:
        for watcher in tuple(self._deeds):
            watcher(self.node, deed)

    def _tell(self, pin: str, level: int, when: Ns) -> None:
        for watcher in tuple(self._watchers.values()):
            watcher(pin, level, when)

    def _pins(self) -> Pins:
        pins = self.node.pins
        if pins is None:
            raise PinError(f"node {self.node.address} has no pins")
        return pins

    def _do(self, deed: Callable[[Ns], object]) -> None:
        kernel = self._host.kernel

        def done() -> None:
            deed(kernel.now)
            self._bus.touch(self.node)

        if kernel.running:
            # From within an event, which is finished first: whoever watches sees one thing at a
            # time, in virtual time as in real time.
            kernel.at(kernel.now, done)
        else:
            self._host.arrive(done)
