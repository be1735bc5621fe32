"""Faults that differ from one who hears to the next: dead, cut off, mistuned, late, echoing.

Owns whom each keeps from hearing or makes hear otherwise, and what becomes of what those say.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import ClassVar, Final

from sacbus.bus.fault import FaultError, FaultOn, Strike
from sacbus.bus.passage import Passage
from sacbus.bus.port import Port
from sacbus.kernel import LineRate, Ns

__all__ = ["Cut", "Dead", "Echo", "LateDirection", "Latency", "WrongBaud"]

#: Rates that anything with a UART can be set to.
_BAUD: Final = range(50, 4_000_001)


def _bar(on: FaultOn, passage: Passage, keeps: Callable[[int | None], bool]) -> None:
    """Keep those for whom ``keeps`` is true from hearing; one act, however many they are."""
    acted = False

    def barrier(listener: int | None) -> bool:
        nonlocal acted
        if not keeps(listener):
            return False
        if not acted:
            acted = True
            on.acts(passage)
        return True

    passage.barriers.append(barrier)


def _is_link(listener: object, link: str | None) -> bool:
    return isinstance(listener, Port) and link in (None, listener.name)


@dataclass(frozen=True, slots=True)
class Dead:
    """The node at the address ``node`` has a dead transceiver: it neither hears nor is heard.

    What it does, it goes on doing. Counts what it would have heard or said.
    """

    node: int
    name: ClassVar[str] = "dead"

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""

        def strike(passage: Passage) -> None:
            if passage.node == self.node:
                passage.silent = True
                on.acts(passage)
            else:
                _bar(on, passage, lambda listener: listener == self.node)

        return strike


@dataclass(frozen=True, slots=True)
class Cut:
    """The line is cut; the nodes at the addresses ``beyond`` are behind it, all links before it.

    Each side hears and disturbs its own alone. Counts what somebody missed.
    """

    beyond: Collection[int]
    name: ClassVar[str] = "cut"

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        beyond = self.beyond

        def strike(passage: Passage) -> None:
            side = passage.node in beyond
            passage.side = (*passage.side, side)
            _bar(on, passage, lambda listener: (listener in beyond) is not side)

        return strike


@dataclass(frozen=True, slots=True)
class WrongBaud:
    """The node at the address ``node`` is set to ``baud``, bit by bit, in both directions.

    Counts what it should have heard and what it said.
    """

    node: int
    baud: int
    name: ClassVar[str] = "wrong_baud"

    def __post_init__(self) -> None:
        if self.baud not in _BAUD:
            raise FaultError(self.name, f"{_BAUD[0]} to {_BAUD[-1]} baud", self.baud)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        rate = LineRate(self.baud, on.medium.rate.bits)

        def strike(passage: Passage) -> None:
            if passage.node == self.node:
                passage.mistune(self.baud)
                on.acts(passage)
            else:
                passage.receivers[self.node] = rate
                _bar(on, passage, lambda listener: listener == self.node)

        return strike


@dataclass(frozen=True, slots=True)
class Latency:
    """What arrives is given to the ``link`` of that name, or None: to all, only ``by`` ns later.

    A USB adapter's is 16 ms. Counts what came late.
    """

    by: Ns
    link: str | None = None
    name: ClassVar[str] = "latency"

    def __post_init__(self) -> None:
        if self.by <= 0:
            raise FaultError(self.name, "a time over 0 to be late by", self.by)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""

        def strike(passage: Passage) -> None:
            before = passage.late

            def late(listener: object) -> Ns:
                by = 0 if before is None else before(listener)
                if _is_link(listener, self.link):
                    on.acts(passage)
                    by += self.by
                return by

            passage.late = late

        return strike


@dataclass(frozen=True, slots=True)
class LateDirection:
    """A driver stays enabled for ``by`` ns after its last bit: whoever begins then is spoilt.

    That of the node at the address ``node``, or else of the ``link`` of that name, None: of every
    link. Bytes that begin in that time arrive as others. Counts whom it spoilt.
    """

    by: Ns
    node: int | None = None
    link: str | None = None
    name: ClassVar[str] = "late_direction"

    def __post_init__(self) -> None:
        if self.by <= 0:
            raise FaultError(self.name, "a time over 0 to be late by", self.by)
        if self.node is not None and self.link is not None:
            raise FaultError(self.name, "a node or a link, not both", self.link)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        #: From when to when a driver is on without need, by lane.
        held: dict[int, tuple[Ns, Ns]] = {}

        def strike(passage: Passage) -> None:
            sent = passage.sent
            if self._drives(passage):
                end = sent.end if passage.end is None else passage.end
                held[sent.lane] = (end, end + self.by)
                return
            begin, end = held.get(sent.lane, (0, 0))
            if not begin <= sent.start < end:
                return
            struck = sum(start < end for start in passage.begins)
            for index in range(struck):
                passage.values[index] ^= on.random.randint(1, 255)
            if struck:
                on.acts(passage)

        return strike

    def _drives(self, passage: Passage) -> bool:
        if self.node is not None:
            return passage.node == self.node
        return _is_link(passage.sent.sender, self.link)


@dataclass(frozen=True, slots=True)
class Echo:
    """The ``link`` of that name, or None: every link, hears its own bytes; counts what it hears.

    As a two-wire adapter whose receiver is not switched off. On a line of two lanes there is none.
    """

    link: str | None = None
    name: ClassVar[str] = "echo"

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""

        def strike(passage: Passage) -> None:
            before = passage.echoes

            def echoes(listener: object) -> bool:
                if _is_link(listener, self.link):
                    on.acts(passage)
                    return True
                return before is not None and before(listener)

            passage.echoes = echoes

        return strike
