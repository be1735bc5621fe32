"""Bytes to packets and back: the SAC network's protocol, fed with bytes and asked for events.

Owns framing, CRC verdicts, resynchronisation, in two readings: `PacketReceiver` (the frame as
specified) and `DeviceReceiver` (what a SAC makes of it). Imports nothing of the project; no
asyncio, no clock, no logging. Garbage on the wire is an event, never an exception.
"""

from sacbus.wire.crc import CRC_IS_FAST, crc8
from sacbus.wire.device import DeviceReceiver
from sacbus.wire.packets import (
    ACK,
    DC1,
    DC2,
    ETX,
    GENERAL_CALL,
    MAX_BODY,
    MAX_FRAME,
    MOTHER,
    NAK,
    NUL,
    STX,
    Answer,
    Fault,
    Heard,
    LineFault,
    Packet,
    Verdict,
    ack,
    encode,
    nak,
)
from sacbus.wire.robust import PacketReceiver

__all__ = [
    "ACK",
    "CRC_IS_FAST",
    "DC1",
    "DC2",
    "ETX",
    "GENERAL_CALL",
    "MAX_BODY",
    "MAX_FRAME",
    "MOTHER",
    "NAK",
    "NUL",
    "STX",
    "Answer",
    "DeviceReceiver",
    "Fault",
    "Heard",
    "LineFault",
    "Packet",
    "PacketReceiver",
    "Verdict",
    "ack",
    "crc8",
    "encode",
    "nak",
]
