"""Faults that damage what is sent: bits, bytes, their times, or the whole of it.

Owns what each does to the bytes of a transmission, for everybody alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sacbus.bus.fault import FaultError, FaultOn, Gaps, Strike, checked_rate
from sacbus.bus.passage import Passage
from sacbus.kernel import Ns

__all__ = ["BitErrors", "Delay", "Drop", "Duplicate", "SwappedReply"]


@dataclass(frozen=True, slots=True)
class BitErrors:
    """Each data bit is inverted with probability ``rate``; counts bits.

    Ninth bits are data bits. Start and stop bits are spared: a receiver that loses its place in a
    byte is what Drop and Duplicate are for.
    """

    rate: float
    name: ClassVar[str] = "bit_errors"

    def __post_init__(self) -> None:
        checked_rate(self.name, self.rate)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        gaps = Gaps(self.rate, on.random)

        def strike(passage: Passage) -> None:
            values, ninth = passage.values, passage.ninth
            width = 8 if ninth is None else 9
            struck = gaps.among(len(values) * width)
            if not struck:
                return
            for place in struck:
                index, bit = divmod(place, width)
                if ninth is not None and bit == width - 1:
                    ninth[index] ^= 1
                else:
                    values[index] ^= 1 << bit
            on.acts(passage, len(struck))

        return strike


@dataclass(frozen=True, slots=True)
class Drop:
    """Each byte is lost with probability ``rate``, and leaves a gap. Counts bytes."""

    rate: float
    name: ClassVar[str] = "drop"

    def __post_init__(self) -> None:
        checked_rate(self.name, self.rate)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        gaps = Gaps(self.rate, on.random)

        def strike(passage: Passage) -> None:
            struck = gaps.among(len(passage.values))
            for index in reversed(struck):
                passage.drop(index)
            if struck:
                on.acts(passage, len(struck))

        return strike


@dataclass(frozen=True, slots=True)
class Duplicate:
    """Each byte comes twice with probability ``rate``, and those behind it later. Counts bytes."""

    rate: float
    name: ClassVar[str] = "duplicate"

    def __post_init__(self) -> None:
        checked_rate(self.name, self.rate)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        gaps = Gaps(self.rate, on.random)

        def strike(passage: Passage) -> None:
            struck = gaps.among(len(passage.values))
            for index in reversed(struck):
                passage.double(index)
            if struck:
                on.acts(passage, len(struck))

        return strike


@dataclass(frozen=True, slots=True)
class Delay:
    """Each byte is up to ``up_to`` ns late with probability ``rate``, and all behind it with it.

    As something between the ends that stores and forwards does it. Counts bytes that held others
    up.
    """

    rate: float
    up_to: Ns
    name: ClassVar[str] = "delay"

    def __post_init__(self) -> None:
        checked_rate(self.name, self.rate)
        if self.up_to <= 0:
            raise FaultError(self.name, "a time over 0 to be late by", self.up_to)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        gaps = Gaps(self.rate, on.random)

        def strike(passage: Passage) -> None:
            struck = gaps.among(len(passage.values))
            for index in struck:
                passage.put_off(index, on.random.randint(1, self.up_to))
            if struck:
                on.acts(passage, len(struck))

        return strike


@dataclass(frozen=True, slots=True)
class SwappedReply:
    """Instead of what a node sends, what a node sent before it comes, with probability ``rate``.

    As from a gateway that gives out an old buffer. Counts replies.
    """

    rate: float
    name: ClassVar[str] = "swapped_reply"

    def __post_init__(self) -> None:
        checked_rate(self.name, self.rate)

    def put_on(self, on: FaultOn) -> Strike:
        """As :meth:`Fault.put_on`."""
        gaps = Gaps(self.rate, on.random)
        before = b""

        def strike(passage: Passage) -> None:
            nonlocal before
            if passage.node is None:
                return
            last, before = before, passage.sent.data
            if last and gaps.among(1):
                passage.replace(last)
                on.acts(passage)

        return strike
