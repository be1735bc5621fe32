"""The device's receiver: acts on every byte exactly as the SAC firmware does.

Owns the firmware's reading of the wire, its traps included: what it takes for a packet is sometimes
none. It knows nothing of time: after an accepted packet a device is deaf for a while, and which
bytes it misses is the node's business.

Theory of operation. An STX starts over from whatever state, so all that a packet does to a device
happens between its STX and the next. These stretches cannot overlap, and one regular expression
tells whether a stretch comes to an event and where: the leftmost match is the first event. With no
match, only the stretch after the last STX matters, and it is held; repeated ETX in it change
nothing and are dropped, which bounds it to 50 bytes. Source: P2P485 1.0 by the manual's author,
recorded byte by byte.
"""

import re
from functools import lru_cache
from typing import Final

from sacbus.wire.crc import CRC_TABLE, table_crc
from sacbus.wire.packets import (
    ACK,
    MAX_BODY,
    NUL,
    STX,
    Answer,
    Fault,
    Heard,
    LineFault,
    Packet,
    Verdict,
)

_ETX_RUN: Final = re.compile(rb"\x03+")
_RIGHT: Final = Verdict.RIGHT
_UNCHECKED: Final = Verdict.UNCHECKED
_WRONG: Final = Verdict.WRONG


@lru_cache(maxsize=256)
def _events_at(address: int) -> re.Pattern[bytes]:
    """One stretch that comes to an event on the device of this address, trigger byte included.

    Which group is the last one tells the kind: 3 a verdict, 4 an ACK or the body byte too many, 7 a
    verdict too, with an ETX before the source (it is "seen", and not taken for the source).
    """
    own = b"" if address == STX else b"\\x%02x" % address  # an STX is never read as an address
    return re.compile(
        rb"\x02(?:"
        rb"([\x00%b][^\x02\x03])([^\x02\x03\x06]{0,%d}+)(?:\x03+([^\x02\x03])|([^\x02\x03]))"
        rb"|([\x00%b])\x03+([^\x02\x03])\x03*([^\x02\x03])"
        rb")" % (own, MAX_BODY, own)
    )


class DeviceReceiver:
    """Bytes in; packets to one's own address or to all, ACKs, and bodies too long, out.

    An ACK is `Answer(dest, src, accepted=True)`, in whatever body place it stood; a NAK is an
    ordinary byte to a device. 47 body bytes or more are undefined there: ours drops the packet, as
    `LineFault(TOO_LONG)`, at the 47th. Everything else is silence. The receiver is idle after every
    event.
    """

    __slots__ = ("_address", "_held", "_search", "open")

    def __init__(self, address: int) -> None:
        self._held = b""
        #: False exactly when a byte other than STX could change nothing: nothing is held.
        self.open = False
        self.address = address

    @property
    def address(self) -> int:
        """One's own address, 0 to 255 (ValueError beyond); compared when a destination arrives.

        A device at address 2 hears the general call only, as real ones would.
        """
        return self._address

    @address.setter
    def address(self, address: int) -> None:
        if not 0 <= address <= 255:
            message = f"an address is one byte, 0 to 255: got {address}"
            raise ValueError(message)
        self._address = address
        self._search = _events_at(address).search

    def receive(self, data: bytes, start: int = 0) -> tuple[Heard, int] | None:
        """The first event that data[start:] completes, and the index after its trigger byte.

        Call again with that index, or a later one, for the rest. None when all is consumed and
        nothing happened.
        """
        if self.open:
            return self._resume(data, start)
        found = self._search(data, start)
        if found is not None:
            return _event(found), found.end()
        last = data.rfind(STX, start)
        if last != -1 and self._is_meant(data, last):
            self._hold(data[last:])
        return None

    def _resume(self, data: bytes, start: int) -> tuple[Heard, int] | None:
        """`receive`, with an unfinished stretch held."""
        held, self._held = self._held, b""
        self.open = False
        stream = held + data[start:]
        # A destination that was accepted stays so, even if the address has changed since.
        accepted = len(held) > 1
        found = _events_at(held[1]).match(stream) if accepted else None
        found = found or self._search(stream)
        if found is not None:
            return _event(found), start + found.end() - len(held)
        last = stream.rfind(STX)
        if (accepted and last == 0) or self._is_meant(stream, last):
            self._hold(stream[last:])
        return None

    def _is_meant(self, data: bytes, stx: int) -> bool:
        """Whether the destination behind this STX is own, the general call, or yet to come."""
        return data[stx + 1 : stx + 2] in (b"", b"\x00", b"%c" % self._address)

    def _hold(self, stretch: bytes) -> None:
        """Keep an unfinished stretch, shortened to what its end can depend on."""
        self._held = stretch[:2] + _ETX_RUN.sub(b"\x03", stretch[2:])
        self.open = True


def _event(found: re.Match[bytes]) -> Heard:
    """What a device makes of a stretch that came to its end."""
    kind = found.lastindex
    if kind == 3:
        dest, src = found[1]
        body = found[2]
        check = found[3][0]
        if NUL in body:  # its text is a C string: CRC and text end there
            body = body[: body.index(NUL)]
    elif kind == 4:
        dest, src = found[1]
        if found[4][0] == ACK:
            return Answer(dest, src, accepted=True)
        return LineFault(Fault.TOO_LONG, found[0])
    else:
        dest, src, check = found[5][0], found[6][0], found[7][0]
        body = b""
    if check == NUL:  # also when 00 is the CRC: a device cannot tell, and does not look
        return Packet(dest, src, body, _UNCHECKED)
    if check == table_crc(body, 0, CRC_TABLE):
        return Packet(dest, src, body, _RIGHT)
    return Packet(dest, src, body, _WRONG)
