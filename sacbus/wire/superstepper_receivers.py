"""Who listens to a Super Stepper Bus without being a module: bytes of a lane in, events out.

Owns the taking apart of the two lanes: the master's messages, and the modules' answers. Where ninth
bits are known a message begins at each byte that has one; else a message follows the one before it,
and only a silence puts a listener right who has missed a byte (whoever knows the time then takes a
new receiver). Answers are told from noise by their checksum.
Source: spec, superstepper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from sacbus.wire.superstepper import (
    ANSWER_SIZE,
    SIZES,
    Answer,
    Message,
    decode,
    decode_answer,
    opcode_of,
)

__all__ = ["Acknowledged", "AnswerReceiver", "MessageReceiver", "Noise", "Told"]


@dataclass(frozen=True, slots=True)
class Told:
    """A message that came whole."""

    address: int
    message: Message
    data: bytes


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """An answer whose checksum is right."""

    answer: Answer


@dataclass(frozen=True, slots=True)
class Noise:
    """Bytes that are no message and no answer; ``cut``: the beginning of a message."""

    data: bytes
    cut: bool = False


Event = Told | Acknowledged | Noise
_Located = list[tuple[Event, int, int]]


class MessageReceiver:
    """The lane of the master. Every byte is in one event, or pending."""

    def __init__(self) -> None:
        self._begun = bytearray()

    @property
    def pending(self) -> bytes:
        """The beginning of a message."""
        return bytes(self._begun)

    @property
    def unfinished(self) -> bool:
        """Whether a message has begun."""
        return bool(self._begun)

    def receive(self, data: bytes, ninth: bytes | None = None) -> list[Event]:
        """The events that these bytes complete."""
        return [event for event, _, _ in self.locate(data, ninth)]

    def locate(self, data: bytes, ninth: bytes | None = None) -> _Located:
        """As :meth:`receive`, with the places of the first byte and behind the last."""
        found: _Located = []
        begun = self._begun
        #: Where operands without a header began.
        stray: int | None = None
        for place, byte in enumerate(data):
            if ninth is not None and ninth[place]:
                if stray is not None:
                    found.append((Noise(data[stray:place]), stray, place))
                    stray = None
                if begun:
                    found.append((Noise(bytes(begun), cut=True), place - len(begun), place))
                    begun.clear()
            elif ninth is not None and not begun:
                stray = place if stray is None else stray
                continue
            begun.append(byte)
            if len(begun) == SIZES[opcode_of(begun[0])]:
                whole = bytes(begun)
                found.append((Told(*decode(whole), whole), place + 1 - len(whole), place + 1))
                begun.clear()
        if stray is not None:
            found.append((Noise(data[stray:]), stray, len(data)))
        return found


#: What the second byte of an answer is.
_RESERVED: Final = 0


class AnswerReceiver:
    """The lane of the modules. Every byte is in one event, or pending."""

    def __init__(self) -> None:
        self._held = bytearray()

    @property
    def pending(self) -> bytes:
        """What may yet become an answer, four bytes at most."""
        return bytes(self._held)

    @property
    def unfinished(self) -> bool:
        """Whether anything may."""
        return bool(self._held)

    def receive(self, data: bytes, ninth: bytes | None = None) -> list[Event]:
        """The events that these bytes complete; ninth bits mean nothing here."""
        return [event for event, _, _ in self.locate(data, ninth)]

    def locate(self, data: bytes, _ninth: bytes | None = None) -> _Located:
        """As :meth:`receive`, with the places of the first byte and behind the last."""
        begins = -len(self._held)
        held = bytes(self._held) + data
        found: _Located = []
        place = wrong = 0
        while len(held) - place >= ANSWER_SIZE:
            answer = None
            if held[place + 1] == _RESERVED:
                answer = decode_answer(held[place : place + ANSWER_SIZE])
            if answer is None:
                place += 1
                continue
            if wrong < place:
                found.append((Noise(held[wrong:place]), begins + wrong, begins + place))
            wrong = place + ANSWER_SIZE
            found.append((Acknowledged(answer), begins + place, begins + wrong))
            place = wrong
        if wrong < place:
            found.append((Noise(held[wrong:place]), begins + wrong, begins + place))
        self._held = bytearray(held[place:])
        return found
