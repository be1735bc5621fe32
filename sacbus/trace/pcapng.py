"""The blocks of a pcapng file: what Wireshark, tshark and the like read.

Owns the format, as far as a serial line needs it: a section, an interface for each lane, and a
block for each packet with comments and a time exact to the nanosecond. Gives bytes, writes nothing
and reads nothing back. Source: draft-ietf-opsawg-pcapng; the numbers of link types are those of
tcpdump.org's registry.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Final

from sacbus.kernel import Ns

__all__ = ["LINKTYPE_USER0", "LINKTYPE_USER1", "interface", "packet", "section"]

#: The first two of the sixteen link types that are left to their users.
LINKTYPE_USER0: Final = 147
LINKTYPE_USER1: Final = 148

_SECTION: Final = 0x0A0D0D0A
_INTERFACE: Final = 1
_ENHANCED_PACKET: Final = 6

#: By which a reader knows the order of bytes: ours is little-endian, whatever the machine's is.
_MAGIC: Final = 0x1A2B3C4D

# Options: the same number means something else in each kind of block.
_COMMENT: Final = 1
_USER_APPLICATION: Final = 4
_IF_NAME: Final = 2
_IF_DESCRIPTION: Final = 3
_IF_SPEED: Final = 8
_IF_TSRESOL: Final = 9
_EPB_DROPCOUNT: Final = 4

#: Times count powers of ten of a second: ns.
_NANOSECONDS: Final = 9

#: The longest option: its length has 16 bits.
_LONGEST: Final = 0xFFFF

_U32: Final = struct.Struct("<I")
_U64: Final = struct.Struct("<Q")
_HEAD: Final = struct.Struct("<II")
_OPTION: Final = struct.Struct("<HH")
_SECTION_HEAD: Final = struct.Struct("<IHHq")
_INTERFACE_HEAD: Final = struct.Struct("<HHI")
_PACKET_HEAD: Final = struct.Struct("<IIIII")
_END_OF_OPTIONS: Final = bytes(4)


def section(application: str) -> bytes:
    """What a file begins with. ``application`` is what made it, with its version."""
    # -1: nobody knows yet how long it will be.
    head = _SECTION_HEAD.pack(_MAGIC, 1, 0, -1)
    return _block(_SECTION, head + _text(_USER_APPLICATION, application) + _END_OF_OPTIONS)


def interface(name: str, description: str, *, link_type: int, bits_per_second: int) -> bytes:
    """An interface of the section; they are numbered from 0, in the order in which they come."""
    return _block(
        _INTERFACE,
        _INTERFACE_HEAD.pack(link_type, 0, 0)  # no limit to what is captured of a packet
        + _text(_IF_NAME, name)
        + _text(_IF_DESCRIPTION, description)
        + _option(_IF_SPEED, _U64.pack(bits_per_second))
        + _option(_IF_TSRESOL, bytes((_NANOSECONDS,)))
        + _END_OF_OPTIONS,
    )


def packet(
    interface: int, time: Ns, data: bytes, comments: Sequence[str] = (), *, dropped: int = 0
) -> bytes:
    """What was said on an interface. ``time`` in ns since 1970, not negative.

    ``dropped``: so many are missing before it.
    """
    options = b"".join([_text(_COMMENT, comment) for comment in comments])
    if dropped:
        options += _option(_EPB_DROPCOUNT, _U64.pack(dropped))
    if options:
        options += _END_OF_OPTIONS
    size = len(data)
    head = _PACKET_HEAD.pack(interface, time >> 32, time & 0xFFFF_FFFF, size, size)
    return _block(_ENHANCED_PACKET, b"%b%b%b" % (head, _padded(data), options))


def _block(kind: int, body: bytes) -> bytes:
    """Its length stands at both ends, so that a file can be read backwards too."""
    size = len(body) + 12
    return b"%b%b%b" % (_HEAD.pack(kind, size), body, _U32.pack(size))


def _text(code: int, text: str) -> bytes:
    """An option in UTF-8; what is too long for one loses its end."""
    data = text.encode("utf-8", "backslashreplace")
    if len(data) > _LONGEST:
        data = data[:_LONGEST].decode("utf-8", "ignore").encode()
    return _option(code, data)


def _option(code: int, data: bytes) -> bytes:
    return _OPTION.pack(code, len(data)) + _padded(data)


def _padded(data: bytes) -> bytes:
    """Everything begins at a multiple of four bytes."""
    return data + bytes(-len(data) % 4)
