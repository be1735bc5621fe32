"""The network port of a SAC: what it hears in packets, when it answers, when it is deaf.

Owns the receiver, the turnaround, the deaf time and the packets that wait to be sent. What a body
means is the message processor's business. Figures: ``sacbus.wire.times``.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from nodes.sac.robust import RobustReceiver
from nodes.sac.settings import SacSettings
from sacbus.kernel import LineRate, Ns
from sacbus.node import Heard, ReportKind
from sacbus.wire import (
    ANSWER_BYTES,
    GENERAL_CALL,
    DeviceReceiver,
    LineFault,
    Packet,
    Verdict,
    ack,
    deaf_time,
    encode,
    nak,
    turnaround,
)

__all__ = ["NetworkPort"]

#: For a message of its own the driver is enabled this long before the first bit (measured 5-11 us).
ENABLE_LEAD: Final[Ns] = 8_000


class NetworkPort:
    """Packets in, packets out.

    ``accept(body, source, destination, now)`` is given each packet that the device accepts, at the
    end of its trigger byte (robust receiver: of its last byte).
    """

    __slots__ = (
        "_accept",
        "_answer",
        "_answer_at",
        "_deaf",
        "_deaf_until",
        "_outbox",
        "_rate",
        "_receiver",
        "_robust",
        "_sent_until",
        "_tell",
        "_turnaround",
        "_unseen_nul",
        "ack",
        "acks",
        "address",
        "crc",
        "naks",
        "packets",
    )

    def __init__(
        self,
        address: int,
        settings: SacSettings,
        rate: LineRate,
        accept: Callable[[bytes, int, int, Ns], None],
        tell: Callable[[ReportKind, str], None],
    ) -> None:
        self.address = address
        self._turnaround = settings.turnaround
        self._deaf = settings.deaf_time
        self._rate = rate
        self._accept = accept
        self._tell = tell
        self._robust = settings.receiver == "robust"
        self._receiver: DeviceReceiver | RobustReceiver = (
            RobustReceiver(address) if self._robust else DeviceReceiver(address)
        )
        #: The ACK or NAK that waits, and when its first bit goes out.
        self._answer: bytes | None = None
        self._answer_at: Ns = 0
        #: Body length + 1 while the answer may yet be put off by the NUL after its trigger byte.
        self._unseen_nul = 0
        #: Packets of its own, each with the earliest time for it.
        self._outbox: deque[tuple[Ns, bytes]] = deque()
        self._sent_until: Ns = 0
        self._deaf_until: Ns = 0
        self.ack = True
        self.crc = True
        self.acks = 0
        self.naks = 0
        self.packets = 0

    @property
    def receiving(self) -> bool:
        """True while bytes that are not for this node may still matter to it."""
        return self._receiver.open or self._unseen_nul > 0

    def hear(self, heard: Heard) -> None:
        """Bytes have arrived."""
        data = heard.data
        if self._unseen_nul:
            self._put_off(heard)
        start = heard.begun_before(self._deaf_until) if self._deaf_until > heard.start else 0
        receive = self._receiver.receive
        while (found := receive(data, start)) is not None:
            event, start = found
            if type(event) is Packet:
                self._packet(event, heard, start)
                if self._deaf_until > heard.start:
                    start = max(start, heard.begun_before(self._deaf_until))
            elif type(event) is LineFault:
                self._tell(ReportKind.LOST, f"packet of {len(event.data)} bytes: body over 46 bytes")
            # An ACK is of no consequence to a SAC: it sends nothing that it would repeat.

    def send(self, dest: int, body: bytes, not_before: Ns) -> Ns:
        """Queue a packet of the node's own; when it will have been sent, if nothing comes between."""
        data = encode(dest, self.address, body, crc=self.crc)
        begins = max(not_before, self._busy_until())
        self._outbox.append((not_before, data))
        for _, waiting in self._outbox:
            begins += self._rate.span(len(waiting))
        return begins

    def wake_at(self) -> Ns | None:
        """When something is to be sent next."""
        if self._answer is not None:
            return self._answer_at
        if self._outbox:
            return max(self._outbox[0][0], self._sent_until)
        return None

    def wake(self, now: Ns) -> bytes | None:
        """The bytes whose turn it is."""
        data: bytes
        if self._answer is not None:
            if self._answer_at > now:
                return None
            data = self._answer
            self._answer = None
            self._unseen_nul = 0
        elif self._outbox and max(self._outbox[0][0], self._sent_until) <= now:
            data = self._outbox.popleft()[1]
        else:
            return None
        self._sent_until = now + self._rate.span(len(data)) + ENABLE_LEAD
        return data

    def _busy_until(self) -> Ns:
        """When the answer that waits, or is on its way, is out, and a packet may follow."""
        if self._answer is not None:
            return self._answer_at + self._rate.span(ANSWER_BYTES) + ENABLE_LEAD
        return self._sent_until

    def _packet(self, packet: Packet, heard: Heard, index: int) -> None:
        """A verdict has fallen at byte ``index - 1`` of what was heard."""
        dest = packet.dest
        size = len(packet.body)
        wrong = packet.verdict is Verdict.WRONG
        triggered = heard.ends(index - 1)
        self.packets += 1
        answered = dest != GENERAL_CALL and self.ack
        if answered:
            nul_follows = index < len(heard.data) or heard.followed
            if wrong:
                self.naks += 1
                self._answer = nak(packet.src, self.address)
            else:
                self.acks += 1
                self._answer = ack(packet.src, self.address)
            self._answer_at = self._answer_time(triggered, size, nul_follows)
            self._unseen_nul = 0 if nul_follows or self._robust else size + 1
        if wrong:
            if dest == GENERAL_CALL:
                self._tell(ReportKind.LOST, "broadcast with a wrong CRC")
            return
        if self._deaf:
            if answered:
                handled = self._answer_at + self._rate.span(ANSWER_BYTES)
            else:
                handled = heard.ends(index) if heard.followed else triggered
            self._deaf_until = handled + deaf_time(size, answered=answered)
        self._accept(packet.body, packet.src, dest, triggered)

    def _answer_time(self, triggered: Ns, size: int, nul_follows: bool) -> Ns:
        """When the answer to a packet that was complete at ``triggered`` begins."""
        if self._robust:
            nul_follows = True  # the NUL itself completed the packet
        elif nul_follows:
            triggered += self._rate.span(1)
        if not self._turnaround:
            return triggered
        return triggered + turnaround(size, nul_follows=nul_follows)

    def _put_off(self, heard: Heard) -> None:
        """The NUL comes after a pause: if it is through before the answer, that counts from it."""
        size = self._unseen_nul - 1
        self._unseen_nul = 0
        if self._answer is not None and heard.ends(0) <= self._answer_at and self._turnaround:
            was = self._answer_at
            self._answer_at = heard.ends(0) + turnaround(size, nul_follows=True)
            if self._deaf_until:
                self._deaf_until += self._answer_at - was
