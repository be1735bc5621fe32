"""The robust receiver: the frame as specified, resynchronising at STX, every fault reported.

For mother, the monitor, the dissector and our own tools; a virtual node hears as a device does,
with `device.py`.

Theory of operation. `_first_event` is the whole rule: it looks at the bytes of one frame, or of one
stretch of noise, and says what they are, or that it takes more bytes to know. What is not decided
is held, at most `MAX_FRAME` bytes, and looked at again with the next bytes; so how the stream was
split cannot matter. In front of it `_TOKENS` takes the stream apart in one call: clean frames,
which need no rule but their CRC, and everything else. It does no more than save time: whatever it
finds while something is held, or is not plainly right, goes to `_first_event` too. For whoever
edits this file: `_TOKENS` must lose no byte, and every clean frame must be read by both in the same
way.

Decisions, where a frame can be read in two ways:

- An STX ends a frame wherever it stands, in the address places too (2 is no address), and begins
  the next one. Only an STX in the CRC place that *is* the CRC, with the NUL behind it, is taken for
  the CRC.
- The first ETX ends the body. Address 3 is read as an address.
- `ETX NUL` ends a packet at once, without waiting for a byte that may never come. If the CRC of the
  body is 00 the verdict is RIGHT, and one NUL more belongs to it; else UNCHECKED, and a NUL more is
  noise.
- 06 and 15 in the first body place are an answer, at once; `ETX NUL` or `ETX CRC NUL` with the
  right CRC may follow and belong to it, anything else behind it is noise or the next frame.
- A wrong CRC is reported as such, with NUL or without; a right one without NUL is a fault too,
  since the frame has one.
- Noise is reported when it ends (at an STX) or fills `MAX_FRAME` bytes.
"""

import re
from typing import Final

from sacbus.wire.crc import CRC_TABLE, crc8, table_crc
from sacbus.wire.packets import (
    ACK,
    ETX,
    MAX_FRAME,
    NAK,
    NUL,
    STX,
    Answer,
    Fault,
    Heard,
    LineFault,
    Packet,
    Verdict,
)

_TOKENS: Final = re.compile(
    # a clean frame: its addresses, its body, and its CRC if it has one; 249 is the longest body
    # that fits a frame of MAX_FRAME bytes with its CRC
    rb"\x02([^\x02]{2})(?:((?![\x06\x15])[^\x02\x03]{0,249}+)\x03(.?)\x00"
    # or an answer with another frame right behind it
    rb"|([\x06\x15])(?=\x02))"
    # or all that comes before the next STX
    rb"|(\x02[^\x02]*|[^\x02]+)",
    re.DOTALL,
).findall

_Endings = tuple[bytes, ...]
"""Bytes that belong to the event before them, if they come: any one of these."""

_NO_ENDINGS: Final[_Endings] = ()
_SECOND_NUL: Final[_Endings] = (b"\x00",)
_ANSWER_ENDINGS: Final = {
    mark: (b"\x03\x00", b"\x03%c\x00" % crc8(bytes((mark,)))) for mark in (ACK, NAK)
}

# The members of an Enum are slow to look up, and the loop below is not.
_RIGHT: Final = Verdict.RIGHT
_UNCHECKED: Final = Verdict.UNCHECKED


class PacketReceiver:
    """Bytes in, packets, answers and faults out.

    Every byte is accounted for, once and in order: it is in one event, or it frames one, or it is
    `pending`.
    """

    __slots__ = ("_endings", "_held")

    def __init__(self) -> None:
        self._held = b""
        self._endings = _NO_ENDINGS

    @property
    def pending(self) -> bytes:
        """The bytes not decided yet, fewer than `MAX_FRAME`: an unfinished frame, or noise."""
        return self._held

    @property
    def unfinished(self) -> bool:
        """Whether what is pending may yet become a packet or an answer; noise never does."""
        return self._held[:1] == b"\x02"

    def receive(self, data: bytes, _ninth: bytes | None = None) -> list[Heard]:
        """What these bytes complete, in the order of the wire.

        Takes any bytes, split anywhere, and raises nothing. SAC has no use for ninth bits.
        """
        if len(data) == 4 and data[0] == STX and not self._held and data[3] in _ANSWER_ENDINGS:
            # A four-byte answer on its own, which is what mother hears for every packet of hers.
            _, dest, src, mark = data
            if dest != STX and src != STX:
                self._endings = _ANSWER_ENDINGS[mark]
                return [Answer(dest, src, mark == ACK)]
        events: list[Heard] = []
        append = events.append
        busy = bool(self._held or self._endings)
        for addresses, body, check, mark, other in _TOKENS(data):
            if not busy:
                if check:
                    if table_crc(body, 0, CRC_TABLE) == check[0]:
                        dest, src = addresses
                        append(Packet(dest, src, body, _RIGHT))
                        continue
                elif mark:
                    dest, src = addresses
                    append(Answer(dest, src, mark[0] == ACK))
                    continue
                elif addresses and table_crc(body, 0, CRC_TABLE):
                    dest, src = addresses
                    append(Packet(dest, src, body, _UNCHECKED))
                    continue
            token = other or b"\x02" + addresses + (mark or b"%b\x03%b\x00" % (body, check))
            busy = self._receive_exactly(token, events)
        return events

    def locate(self, data: bytes, _ninth: bytes | None = None) -> list[tuple[Heard, int, int]]:
        """As `receive`, each event with the places of its first byte and behind its last.

        Places count from the first byte of `data`; those before it are negative. An ending that
        comes with a later call is left out. Four times as slow as `receive`.
        """
        first = -len(self._held)
        events: list[Heard] = []
        places: list[tuple[int, int]] = []
        self._receive_exactly(data, events, places)
        return [
            (event, first + begin, first + end)
            for event, (begin, end) in zip(events, places, strict=True)
        ]

    def _receive_exactly(
        self, data: bytes, events: list[Heard], places: list[tuple[int, int]] | None = None
    ) -> bool:
        """Append what these bytes complete; True if what comes next is to be read with them.

        To `places` go where each event begins and ends, counted from the first byte held.
        """
        held = self._held + data
        at = 0
        while at < len(held):
            if self._endings:
                ending = _ending_at(held, at, self._endings)
                if ending is None:
                    break
                at += len(ending)
                self._endings = _NO_ENDINGS
                if places:
                    places[-1] = places[-1][0], at
            elif first := _first_event(held, at):
                event, end, self._endings = first
                events.append(event)
                if places is not None:
                    places.append((at, end))
                at = end
            else:
                break
        self._held = held[at:]
        return bool(self._held or self._endings)


def _ending_at(held: bytes, at: int, endings: _Endings) -> bytes | None:
    """The ending that stands at this place, empty if none does; None while one may still come."""
    for ending in endings:
        if held.startswith(ending, at):
            return ending
    if any(ending.startswith(held[at:]) for ending in endings):
        return None
    return b""


def _first_event(held: bytes, at: int) -> tuple[Heard, int, _Endings] | None:
    """The event that begins at this place, where it ends, and what may follow and belong to it.

    None when it takes more bytes to know. Between two events every byte but STX begins noise.
    """
    if held[at] != STX:
        return _noise(held, at)
    frame = held[at : at + MAX_FRAME]
    full = len(frame) == MAX_FRAME
    etx = frame.find(ETX, 3)
    stx = frame.find(STX, 1, len(frame) if etx == -1 else etx)

    if frame[3:4] in (b"\x06", b"\x15") and stx not in (1, 2):
        answer = Answer(frame[1], frame[2], frame[3] == ACK)
        return answer, at + 4, _ANSWER_ENDINGS[frame[3]]
    if stx != -1:
        return LineFault(Fault.CUT_SHORT, frame[:stx]), at + stx, _NO_ENDINGS
    too_long = (LineFault(Fault.TOO_LONG, frame), at + MAX_FRAME, _NO_ENDINGS) if full else None
    check, behind = frame[etx + 1 : etx + 2], frame[etx + 2 : etx + 3]
    if etx == -1 or not check:
        return too_long

    body = frame[3:etx]
    crc = crc8(body)
    if check[0] == NUL:
        if crc == NUL:
            return Packet(frame[1], frame[2], body, Verdict.RIGHT), at + etx + 2, _SECOND_NUL
        return Packet(frame[1], frame[2], body, Verdict.UNCHECKED), at + etx + 2, _NO_ENDINGS
    if check[0] == STX and not (crc == STX and (behind == b"\x00" or not (behind or full))):
        return LineFault(Fault.CUT_SHORT, frame[: etx + 1]), at + etx + 1, _NO_ENDINGS
    if not behind:
        return too_long
    end = etx + 3 if behind == b"\x00" else etx + 2
    if check[0] != crc:
        return LineFault(Fault.BAD_CRC, frame[:end]), at + end, _NO_ENDINGS
    if end == etx + 2:
        return LineFault(Fault.NO_NUL, frame[:end]), at + end, _NO_ENDINGS
    return Packet(frame[1], frame[2], body, Verdict.RIGHT), at + end, _NO_ENDINGS


def _noise(held: bytes, at: int) -> tuple[LineFault, int, _Endings] | None:
    """The noise up to the next STX, or as much as one fault carries; None while it may go on."""
    end = held.find(STX, at, at + MAX_FRAME)
    if end == -1:
        if len(held) - at < MAX_FRAME:
            return None
        end = at + MAX_FRAME
    return LineFault(Fault.NOISE, held[at:end]), end, _NO_ENDINGS
