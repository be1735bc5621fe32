"""The Super Stepper Bus as the bus must know it: who hears what, and what is said.

Owns the routing rules that follow from the modules' receivers, in either mode. The master talks on
one lane, the modules on the other (J3: Rx and Tx).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from sacbus.kernel import US, LineRate, Ns
from sacbus.node import EVERYONE, MASTER, Decoder, Said
from sacbus.wire.superstepper import ADDRESSES, ANSWER_SIZE, Answer, describe, patience
from sacbus.wire.superstepper_receivers import (
    Acknowledged,
    AnswerReceiver,
    MessageReceiver,
    Noise,
    Told,
)

__all__ = ["EIGHT_BITS", "NINE_BITS", "SuperStepperProtocol"]

#: From a message to its answer as modules have it without a setting of their own [D].
TURNAROUND: Final[Ns] = 100 * US

#: 8-bit: start, eight, stop; 9-bit: one more.
_BITS: Final = {8: 10, 9: 11}


class SuperStepperProtocol:
    """Messages of the master on one lane, answers on the other, at 9600 baud."""

    lanes = 2
    addresses = ADDRESSES
    link_type = 149
    dissector = Path(__file__).with_name("superstepper.lua")

    def __init__(self, name: str, mode: int) -> None:
        """``mode``: 8 or 9, the bits of a byte."""
        self.name = name
        self.rate = LineRate(9_600, _BITS[mode])
        self._nine = mode == 9

    def patience(self, byte: Ns) -> Ns:
        """The time-out of the modules."""
        return patience(byte)

    def cuts(self, data: bytes) -> Sequence[int]:
        """Behind every byte: which one completes a message depends on those before the data."""
        return range(1, len(data))

    def addressed(self, _data: bytes) -> Sequence[int] | None:
        """All modules: each counts the others' messages too, to know where its own begin."""
        return EVERYONE

    def decoder(self, lane: int = 0) -> Decoder:
        """Of the master's messages on lane 0, of the modules' answers on lane 1."""
        return AnswerReceiver() if lane else MessageReceiver()

    def tell(self, event: object) -> Said:
        """A message, an answer or noise."""
        match event:
            case Told(address, message, data):
                words = describe(message)
                reply = TURNAROUND
                return Said(
                    "packet", MASTER, address, data[1:], words, "", len(data), reply, binary=True
                )
            case Acknowledged(answer):
                kind = "ack" if answer.positive else "nak"
                return Said(kind, answer.address, MASTER, b"", _words(answer), "right", ANSWER_SIZE)
            case Noise(data, cut):
                words = "cut short" if cut else "noise"
                return Said("garbage", None, None, data, words, "", len(data))
            case _:
                raise TypeError(f"not an event of the Super Stepper decoders: {event!r}")


def _words(answer: Answer) -> str:
    words = "ACK" if answer.positive else "NAK"
    if answer.value:
        words += f" {answer.value}"
    return f"{words} ({', '.join(answer.flags)})" if answer.flags else words


EIGHT_BITS: Final = SuperStepperProtocol("superstepper", 8)
NINE_BITS: Final = SuperStepperProtocol("superstepper-9", 9)
