"""The SAC network as the bus must know it: who hears what, and what a packet says.

Owns the routing rules that follow from the device's receiver: it acts on the byte after ETX, and a
receiver that is idle stays idle until STX and its own address come by.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from sacbus.kernel import LineRate, Ns
from sacbus.language import describe, parse
from sacbus.node import EVERYONE, Said
from sacbus.wire import (
    ETX,
    GENERAL_CALL,
    STX,
    Answer,
    Fault,
    LineFault,
    Packet,
    PacketReceiver,
    Verdict,
)
from sacbus.wire.times import ANSWER_BYTES, turnaround

__all__ = ["SAC_PROTOCOL", "SacProtocol"]

#: The trigger: the first byte after ETX that is neither STX nor another ETX; and when the ETX came
#: before the source, the first such byte after the source (spec, wire).
_TRIGGER: Final = re.compile(rb"\x02[^\x02\x03]\x03+[^\x02\x03]\x03*[^\x02\x03]|\x03+[^\x02\x03]")
#: Where data go on with what an earlier transmission began: the next three bytes, of which one may
#: be the trigger (the destination and the source at most are to come before it).
_GOING_ON: Final = re.compile(rb"\x03*([^\x02\x03])?\x03*([^\x02\x03])?\x03*([^\x02\x03])?")
#: STX may be repeated; the byte after the last one is the destination.
_ADDRESSED: Final = re.compile(rb"\x02+([^\x02])")

_GARBAGE: Final = {
    Fault.NOISE: "noise",
    Fault.CUT_SHORT: "cut short",
    Fault.TOO_LONG: "too long",
}
#: A frame that is whole but for its end: devices answer it, so it is told as the packet that it is.
_FLAWED: Final = {Fault.BAD_CRC: "wrong", Fault.NO_NUL: "no NUL"}
_VERDICTS: Final = {
    Verdict.RIGHT: "right",
    Verdict.UNCHECKED: "unchecked",
    Verdict.WRONG: "wrong",
}
#: STX, destination, source, ETX, CRC, NUL.
_FRAMING: Final = 6


class SacProtocol:
    """SAC packets on one pair of wires at 38 400 baud."""

    name = "sac"
    lanes = 1
    rate = LineRate()
    #: 0 is everybody, 1 mother, 2 and 3 are STX and ETX (manual).
    addresses = range(4, 256)
    link_type = 147
    dissector = Path(__file__).with_name("sac.lua")

    def patience(self, _byte: Ns) -> Ns | None:
        """A SAC has no time-outs: 2 s between two bytes were observed to be accepted."""
        return None

    def cuts(self, data: bytes) -> Sequence[int]:
        """The ends of all trigger bytes, and of the bytes behind them, but the end of the data.

        A device acts at its trigger byte; with ``receiver = "robust"`` a node acts at the NUL.
        """
        if data[0] != STX:
            return _cuts_going_on(data)
        first = data.find(b"\x03")
        if first < 0:
            return ()
        size = len(data)
        # Nearly always: one packet, ETX CRC NUL.
        if first == size - 3 and data[first + 1] > 3:
            return (size - 1,)
        ends = [hit.end() for hit in _TRIGGER.finditer(data)]
        return sorted({cut for end in ends for cut in (end, end + 1) if cut < size})

    def addressed(self, data: bytes) -> Sequence[int] | None:
        """Destinations named in the data; everyone for a general call.

        An STX at the very end opens every receiver, since the destination is still to come.
        """
        if data[0] == STX and data.find(b"\x02", 1) < 0 and len(data) > 1:
            return EVERYONE if data[1] == GENERAL_CALL else (data[1],)
        if data.find(b"\x02") < 0:
            return ()
        if data[-1] == STX:
            return EVERYONE
        found = {hit[0] for hit in _ADDRESSED.findall(data)}
        return EVERYONE if GENERAL_CALL in found else sorted(found)

    def decoder(self, _lane: int = 0) -> PacketReceiver:
        """The robust receiver."""
        return PacketReceiver()

    def tell(self, event: object) -> Said:
        """A packet, an answer or a fault; a frame with a wrong CRC is a packet too.

        ``size`` of a packet without CRC is without the NUL that may follow.
        """
        match event:
            case Packet(dest, src, body, verdict):
                framing = _FRAMING if verdict is not Verdict.UNCHECKED else _FRAMING - 1
                return _packet(dest, src, body, _VERDICTS[verdict], len(body) + framing)
            case Answer(dest, src, accepted):
                word = "ACK" if accepted else "NAK"
                return Said(word.lower(), src, dest, b"", word, "", ANSWER_BYTES)
            case LineFault(kind, data) if kind in _FLAWED:
                body = data[3 : data.index(ETX, 3)]
                return _packet(data[1], data[2], body, _FLAWED[kind], len(data))
            case LineFault(kind, data):
                return Said("garbage", None, None, data, _GARBAGE[kind], "", len(data))
            case _:
                raise TypeError(f"not an event of the SAC decoder: {event!r}")


def _packet(dest: int, src: int, body: bytes, verdict: str, size: int) -> Said:
    general = dest == GENERAL_CALL
    answered = None if general else turnaround(len(body), nul_follows=True)
    words = describe(parse(body))
    return Said("packet", src, dest, body, words, verdict, size, answered, general)


def _cuts_going_on(data: bytes) -> list[int]:
    """Cuts of data that may go on with a packet; and one at the byte that may put an answer off."""
    going_on = _GOING_ON.match(data)
    assert going_on is not None  # it matches nothing as well
    ends = {1, *(going_on.end(group) for group in (1, 2, 3))}
    for hit in _TRIGGER.finditer(data):
        ends.update((hit.end(), hit.end() + 1))
    return sorted(end for end in ends if 0 < end < len(data))


SAC_PROTOCOL: Final = SacProtocol()
