"""A forgiving receiver for a SAC: frames as specified instead of the firmware's reading.

Owns the choice of the setting ``receiver = "robust"``: which of the robust receiver's events
concern a node of a given address.
"""

from __future__ import annotations

from sacbus.wire import (
    GENERAL_CALL,
    MAX_BODY,
    Fault,
    Heard,
    LineFault,
    Packet,
    PacketReceiver,
    Verdict,
)

__all__ = ["RobustReceiver"]


class RobustReceiver:
    """Used as a ``DeviceReceiver`` is; acts at the frame's last byte instead of the one after ETX.

    Bytes are fed one by one, so that an event's place, and so its time, is known. That costs some
    microseconds a packet, which an option for difficult lines may.
    """

    __slots__ = ("_receiver", "address", "open")

    def __init__(self, address: int) -> None:
        self._receiver = PacketReceiver()
        self.address = address
        #: Always: a frame may go on at any time. (The bus then lets this node hear everything.)
        self.open = True

    def receive(self, data: bytes, start: int = 0) -> tuple[Heard, int] | None:
        """The first event for this node that ``data[start:]`` completes, and the index after it."""
        for index in range(start, len(data)):
            for event in self._receiver.receive(data[index : index + 1]):
                mine = self._mine(event)
                if mine is not None:
                    return mine, index + 1
        return None

    def _mine(self, event: Heard) -> Packet | LineFault | None:
        packet: Packet | None = None
        if isinstance(event, Packet):
            packet = event
        elif isinstance(event, LineFault) and event.kind is Fault.BAD_CRC:
            # STX dest src body ETX CRC NUL; the body holds no ETX.
            frame = event.data
            packet = Packet(frame[1], frame[2], frame[3 : frame.index(3, 3)], Verdict.WRONG)
        if packet is None or packet.dest not in (self.address, GENERAL_CALL):
            return None
        if len(packet.body) > MAX_BODY:
            return LineFault(Fault.TOO_LONG, packet.body)
        return packet
