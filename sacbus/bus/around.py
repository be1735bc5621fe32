"""Whom a medium meets: who hears it, who is told of what begins, and who knows the nodes.

Owns the contracts between the medium and these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol as Contract

from sacbus.bus.transmission import Transmission
from sacbus.kernel import Ns
from sacbus.node import Heard

__all__ = ["Listener", "Router", "Tap"]


class Listener(Contract):
    """Whoever hears all bytes of a lane, bytes of overlapped transmissions included."""

    @property
    def hear(self) -> Callable[[Heard, Ns], object]:
        """Some bytes have arrived, now; called in the order of their last bytes."""
        ...


class Tap(Contract):
    """Whoever must know of a transmission when it begins: a line that goes on outside."""

    def begun(self, sent: Transmission) -> None:
        """``sent`` begins now. What will overlap it is not known yet."""
        ...


class Router(Contract):
    """Who must hear what, as the bus knows it."""

    def cuts(self, data: bytes) -> Sequence[int]:
        """Offsets before the end at which a node may have to act."""
        ...

    def deliver(self, heard: Heard, sender: object, now: Ns) -> None:
        """Hand some bytes to the nodes that they concern."""
        ...

    def concerns(self, data: bytes) -> bool:
        """Whether any node would be handed this if it arrived next."""
        ...

    def deliver_to(
        self, heard: Heard, sender: object, now: Ns, wanted: Callable[[int], bool]
    ) -> None:
        """As :meth:`deliver`, to those alone whose address is ``wanted``, which is asked last."""
        ...

    def address_of(self, sender: object) -> int | None:
        """A node's address; None for what is no node."""
        ...

    def node_at(self, address: int) -> object | None:
        """The first node with that address; None without one."""
        ...
