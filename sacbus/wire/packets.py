"""Packets of the SAC network: their bytes, and what a receiver may hear.

Owns the words of the wire (control characters, addresses, bounds), encoding, and the events that
both receivers give: `robust.py` reads the frame as specified, `device.py` as the firmware does.
Imports nothing of the project but the CRC. Source: manual, "Communications"; where it is silent,
the firmware's author's P2P485 1.0.
"""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from sacbus.wire.crc import CRC_TABLE, table_crc

NUL: Final = 0x00
STX: Final = 0x02
ETX: Final = 0x03
ACK: Final = 0x06
DC1: Final = 0x11
"""The body of a soft op that reports the start of a motion."""
DC2: Final = 0x12
"""The body of a soft op that reports its end."""
NAK: Final = 0x15

GENERAL_CALL: Final = 0
"""The address that all obey and nobody answers."""
MOTHER: Final = 1

MAX_BODY: Final = 46
"""The longest body, in bytes, that a device holds: 47 and more overwrite its memory.

Found in the firmware; the manual gives no figure.
"""
MAX_FRAME: Final = 255
"""The longest frame, STX to NUL, that the robust receiver waits for, and all that it ever holds.

Our choice: a body of 249 bytes with its CRC, five times what a device can take.
"""


class Verdict(Enum):
    """What the CRC says of a packet."""

    RIGHT = auto()
    """The CRC was sent and is right."""
    UNCHECKED = auto()
    """No CRC was sent (a NUL stood in its place): nobody knows."""
    WRONG = auto()
    """The CRC was sent and is wrong; `DeviceReceiver` gives it, since a device answers it."""


class Fault(Enum):
    """What was wrong with the bytes of a `LineFault`."""

    NOISE = auto()
    """Bytes outside any frame."""
    CUT_SHORT = auto()
    """A frame that an STX ended; the STX begins the next one."""
    BAD_CRC = auto()
    """A frame whose CRC is wrong, with its NUL if it had one."""
    NO_NUL = auto()
    """A frame whose CRC is right, but another byte than the NUL followed."""
    TOO_LONG = auto()
    """A frame that did not end within `MAX_FRAME` bytes; on a device, a body over `MAX_BODY`."""


# Plain, not frozen: a frozen dataclass takes four times as long to make, and there may be a million
# of these a second. Treat them as values all the same.


@dataclass(slots=True)
class Packet:
    """A packet as heard; addresses 0 to 255."""

    dest: int
    src: int
    body: bytes
    verdict: Verdict


@dataclass(slots=True)
class Answer:
    """An ACK (accepted) or a NAK, from src to dest."""

    dest: int
    src: int
    accepted: bool


@dataclass(slots=True)
class LineFault:
    """Bytes that made no packet, as they came; at most `MAX_FRAME` of them."""

    kind: Fault
    data: bytes


Heard = Packet | Answer | LineFault
"""Whatever a receiver can report."""


def encode(dest: int, src: int, body: bytes, *, crc: bool = True) -> bytes:
    """The bytes of one packet, `STX dest src body ETX CRC NUL`, without the CRC on request.

    ValueError for addresses outside 0 to 255. The body goes out as it is, of any length: nothing on
    this wire is escaped, and which bodies, bytes and addresses a device would lose is the sender's
    matter.
    """
    if not (0 <= dest <= 255 and 0 <= src <= 255):
        raise _no_addresses(dest, src)
    if crc:
        return b"\x02%c%c%b\x03%c\x00" % (dest, src, body, table_crc(body, 0, CRC_TABLE))
    return b"\x02%c%c%b\x03\x00" % (dest, src, body)


def ack(dest: int, src: int) -> bytes:
    """The four bytes by which src accepts a packet of dest; ValueError as for `encode`."""
    if not (0 <= dest <= 255 and 0 <= src <= 255):
        raise _no_addresses(dest, src)
    return b"\x02%c%c\x06" % (dest, src)


def nak(dest: int, src: int) -> bytes:
    """The four bytes by which src refuses a packet of dest; ValueError as for `encode`."""
    if not (0 <= dest <= 255 and 0 <= src <= 255):
        raise _no_addresses(dest, src)
    return b"\x02%c%c\x15" % (dest, src)


def _no_addresses(dest: int, src: int) -> ValueError:
    return ValueError(f"addresses are one byte, 0 to 255: got dest {dest}, src {src}")
