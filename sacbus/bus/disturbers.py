"""Faults that talk: noise on the wires, and somebody who will not be quiet.

Owns when they talk and what they say; they talk over others as anybody would.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import ClassVar, Final

from sacbus.bus.fault import FaultError, FaultOn
from sacbus.kernel import SECOND, Ns

__all__ = ["Babble", "NoiseBursts"]

#: Bursts per second: one in twelve days, and more than a line has bytes for.
RAREST: Final = 1e-6
DENSEST: Final = 1_000_000

#: Bytes of a burst.
LARGEST: Final = 65_536


@dataclass(frozen=True, slots=True)
class NoiseBursts:
    """``bytes`` bytes of noise, ``per_second`` times a second on average, at any instant.

    They are on all lanes, and spoil what they meet. Counts bursts.
    """

    per_second: float
    bytes: int = 3
    name: ClassVar[str] = "noise_bursts"

    def __post_init__(self) -> None:
        if not self.per_second > 0:
            raise FaultError(self.name, "more than 0 bursts per second", self.per_second)
        if not RAREST <= self.per_second <= DENSEST:
            wanted = f"{RAREST:g} to {DENSEST} bursts per second"
            raise FaultError(self.name, wanted, self.per_second)
        if self.bytes < 1:
            raise FaultError(self.name, "1 or more bytes a burst", self.bytes)
        if self.bytes > LARGEST:
            raise FaultError(self.name, f"{LARGEST} bytes a burst at most", self.bytes)

    def put_on(self, on: FaultOn) -> None:
        """As :meth:`Fault.put_on`."""
        kernel, medium, random = on.medium.kernel, on.medium, on.random

        def later() -> None:
            pause = -log(1 - random.random()) * SECOND / self.per_second
            kernel.at(kernel.now + max(1, int(pause)), burst)

        def burst() -> None:
            if on.is_on:
                on.count += 1
                for lane in range(medium.lanes):
                    medium.transmit(on, random.randbytes(self.bytes), lane)
                later()

        later()


@dataclass(frozen=True, slots=True)
class Babble:
    """``pattern`` is sent ``every`` ns, or without a pause if it takes longer, whoever else talks.

    By the node at the address ``node``, or None: by a stranger. Counts how often it was sent.
    """

    pattern: bytes
    every: Ns
    node: int | None = None
    name: ClassVar[str] = "babble"

    def __post_init__(self) -> None:
        if not self.pattern:
            raise FaultError(self.name, "a pattern of 1 or more bytes", self.pattern)
        if self.every < 0:
            raise FaultError(self.name, "a time from one to the next", self.every)

    def put_on(self, on: FaultOn) -> None:
        """As :meth:`Fault.put_on`; FaultError when there is no such node."""
        kernel, medium = on.medium.kernel, on.medium
        sender: object = on if self.node is None else medium.node_at(self.node)
        if sender is None:
            raise FaultError(self.name, "the address of a node on this bus", self.node)

        def babble() -> None:
            if on.is_on:
                on.count += 1
                sent = medium.transmit(sender, self.pattern, medium.node_lane)
                kernel.at(max(kernel.now + self.every, sent.end), babble)

        kernel.at(kernel.now, babble)
