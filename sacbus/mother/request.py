"""What mother sends: a body made safe for the firmware's receiver.

Owns the rules by which a body reaches a SAC checked: no bytes that end or break a packet, no CRC
byte that the device takes for something else, no addresses that it cannot have.
Source: spec, wire ("Bodies that a device loses or accepts unchecked, and the cure").
"""

from __future__ import annotations

import re
from typing import Final

from sacbus.language.line import quoted
from sacbus.mother.errors import BadRequest
from sacbus.wire import ACK, ETX, MAX_BODY, MOTHER, NUL, STX, encode

__all__ = ["SPEAKS", "checked_address", "safe_body", "safe_packet"]

#: The protocols of what mother sends, as buses call them.
SPEAKS: Final = ("sac",)

#: CRC bytes that the device takes for "no CRC", a new packet, a second ETX.
_UNSAFE_CRCS: Final = frozenset((NUL, STX, ETX))

_UNSAFE_BYTES: Final = {NUL: "NUL", STX: "STX", ETX: "ETX", ACK: "ACK"}
_UNSAFE: Final = re.compile(b"[%b]" % bytes(_UNSAFE_BYTES)).search

#: Where in a packet its CRC stands, before the NUL.
_CRC: Final = -2


def safe_body(body: bytes) -> bytes:
    """``body``, with a trailing space if it needs one for a CRC that every device checks.

    A space ends a command, and what follows it is ignored, so nothing else changes. The empty body
    is left alone (its CRC is 00, and a space would make it a message). :class:`BadRequest` for
    bytes 00, 02, 03 and 06, and for what is longer than 46 with its spaces.
    """
    return safe_packet(MOTHER, body)[0]


def safe_packet(node: int, body: bytes) -> tuple[bytes, bytes]:
    """``body`` as :func:`safe_body` makes it, and the packet that takes it to ``node``, or all."""
    if (unsafe := _UNSAFE(body)) is not None:
        value = unsafe[0][0]
        raise BadRequest(
            f"line {quoted(body.decode('latin-1'))}: byte {value:02x} ({_UNSAFE_BYTES[value]}) "
            "would end or break the packet; leave it out"
        )
    sent = body
    packet = encode(node, MOTHER, body)
    if packet[_CRC] in _UNSAFE_CRCS and body:
        # One always cures: a space after a body turns its CRC from 00, 02, 03 into 23, 9F, C1.
        sent += b" "
        packet = encode(node, MOTHER, sent)
    if len(sent) > MAX_BODY:
        needs = " and a trailing space for its CRC" if len(sent) > len(body) else ""
        raise BadRequest(
            f"line {quoted(body.decode('latin-1'))}: expected at most {MAX_BODY} characters, got "
            f"{len(body)}{needs}; split it"
        )
    return sent, packet


def checked_address(node: object) -> int:
    """``node`` if a SAC can have it: 4 to 255 (0 is everybody, 1 mother, 2 and 3 STX and ETX)."""
    if not isinstance(node, int):
        raise BadRequest(
            f"node {node!r}: expected a whole number from 4 to 255, got {type(node).__name__}"
        )
    if not 4 <= node <= 255:
        raise BadRequest(
            f"node {node}: expected an address from 4 to 255"
            + (", or a broadcast for all nodes" if node == 0 else "")
        )
    return node
