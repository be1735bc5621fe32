"""Lines that are no commands for the motor: messages, padding, lines for other nodes.

Owns the reading of these: they are looked at by their beginning alone.
Source: manual, "Communications"; spec, "Two ports".
"""

from __future__ import annotations

from sacbus.language.commands import Command, Empty, Forward, Message
from sacbus.language.line import DIGITS, Line, end_of, low_byte, short

__all__ = ["read_forward", "read_message"]


def read_message(line: Line, _at: int) -> Command | None:
    """Text, unless it is nothing but spaces: those are padding."""
    if not line.text.strip(" "):
        return Empty()
    line.stands("body", 0)
    return Message(line.text)


def read_forward(line: Line, _at: int) -> Command | None:
    """A node's address, or a slash, and what is to be sent on."""
    after = end_of(DIGITS, line.text, 0)
    if not after:
        line.stands("rest", 1)
        return Forward(None, line.text[1:])
    digits = line.text[:after].lstrip("0") or "0"
    address = low_byte(digits)
    if digits != str(address):
        line.remark(0, "an address of at most 255", short(line.text[:after]), f"{address} is used")
    line.stands("destination", 0)
    line.stands("rest", after)
    return Forward(address, line.text[after:])
