"""The network port of a SAC: what it hears in packets, when it answers, when it is deaf.

Owns the receiver, the turnaround, the deaf time and the packets that wait to be sent. What a body
means is the message processor's business. A port that is set to another rate than the line's hears
nothing, and nobody understands what it sends. Figures: ``sacbus.wire.times``.
"""

from __future__ import annotations

from typing import Final, Protocol

from nodes.sac.memory import Memory
from nodes.sac.robust import RobustReceiver
from nodes.sac.settings import SacSettings
from sacbus.kernel import LineRate, Ns
from sacbus.node import Heard, ReportKind
from sacbus.wire import (
    ACK,
    GENERAL_CALL,
    MAX_BODY,
    STX,
    DeviceReceiver,
    LineFault,
    Packet,
    Verdict,
    ack,
    encode,
    nak,
)
from sacbus.wire.times import (
    ANSWER_BYTES,
    ENABLE_LEAD_UNCHECKED,
    deaf_time,
    enable_lead,
    turnaround,
)

__all__ = ["NetworkPort", "PortOwner"]

#: For a message of its own the driver is enabled this long before the first bit (measured 5-11 us).
ENABLE_LEAD: Final[Ns] = 8_000


#: Deaf until this is deaf for good.
_FOR_EVER: Final[Ns] = 2**63

#: What arrives of bytes at a wrong rate: always others, and never one that begins or ends a packet.
_GARBLED: Final = bytes((byte ^ 0x55) | 0x80 for byte in range(256))

# The members of an Enum are slow to look up.
_UNCHECKED: Final = Verdict.UNCHECKED
_WRONG: Final = Verdict.WRONG

#: The device's times by body length: every packet asks for two of them.
_SIZES: Final = range(MAX_BODY + 1)
_AFTER_NUL: Final = [turnaround(size, nul_follows=True) for size in _SIZES]
_AFTER_TRIGGER: Final = [turnaround(size, nul_follows=False) for size in _SIZES]
_ENABLED_BEFORE: Final = [enable_lead(size) for size in _SIZES]
_DEAF_AFTER_ANSWER: Final = [deaf_time(size, answered=True) for size in _SIZES]
_DEAF_AFTER_BROADCAST: Final = [deaf_time(size, answered=False) for size in _SIZES]


class PortOwner(Protocol):
    """The node behind the port."""

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        """The body of a packet that the device accepts, at the end of its trigger byte.

        With the robust receiver: of its last byte.
        """
        ...

    def tell(self, kind: ReportKind, text: str, *, when: Ns | None = None) -> None:
        """Something worth a report, of now or of ``when``."""
        ...


class NetworkPort:
    """Packets in, packets out."""

    __slots__ = (
        "_answer",
        "_answer_at",
        "_answer_span",
        "_deaf",
        "_deaf_until",
        "_enable_lead",
        "_enabled_until",
        "_garbles",
        "_outbox",
        "_owner",
        "_rate",
        "_receiver",
        "_robust",
        "_sent_until",
        "_turnaround",
        "_waits_for",
        "ack",
        "acks",
        "address",
        "crc",
        "due",
        "naks",
        "packets",
        "receiving",
    )

    def __init__(self, settings: SacSettings, rate: LineRate, owner: PortOwner) -> None:
        """``rate`` is the line's. It is at address 0 until it is :meth:`set_up`."""
        self.address = GENERAL_CALL
        self._turnaround = settings.turnaround
        self._deaf = settings.deaf_time
        self._rate = rate
        self._answer_span = rate.span(ANSWER_BYTES)
        self._owner = owner
        self._robust = settings.receiver == "robust"
        self._receiver: DeviceReceiver | RobustReceiver = (
            RobustReceiver(GENERAL_CALL) if self._robust else DeviceReceiver(GENERAL_CALL)
        )
        #: The ACK or NAK that waits, and when its first bit goes out, or would if there were one.
        self._answer: bytes | None = None
        self._answer_at: Ns = 0
        #: While bytes may yet put the answer off: how many (-1: any number), and the body's length.
        self._waits_for: tuple[int, int] | None = None
        #: Packets of its own, each with the earliest time for it.
        self._outbox: list[tuple[Ns, bytes]] = []
        self._sent_until: Ns = 0
        #: How long before its answer the driver is enabled, and until when it is after a message.
        self._enable_lead: Ns = 0
        self._enabled_until: Ns = 0
        self._deaf_until: Ns = 0
        #: Whether it is set to another rate than the line's.
        self._garbles = False
        self.ack = True
        self.crc = True
        self.acks = 0
        self.naks = 0
        self.packets = 0
        #: True while bytes that are not for this node may still matter to it.
        self.receiving = self._receiver.open
        #: When something is to be sent next; None when nothing is.
        self.due: Ns | None = None

    def set_up(self, memory: Memory, rate: LineRate, *, garbles: bool = False) -> None:
        """Take address and switches from memory, as at a boot; ``rate`` is that of its line.

        ``garbles``: it is set to another rate than its line's. An answer that waits still goes out
        as it is: that of ``$R`` itself.
        """
        self.ack = bool(memory.ack)
        self.crc = bool(memory.crc)
        self.address = self._receiver.address = memory.d_id
        self._rate = rate
        self._answer_span = rate.span(ANSWER_BYTES)
        self._garbles = garbles
        if garbles:
            self._deaf_until = _FOR_EVER
        elif self._deaf_until == _FOR_EVER:
            self._deaf_until = 0

    def listen_from(self, moment: Ns | None) -> None:
        """Hear nothing before ``moment``, None: for good; what was to be sent is forgotten."""
        self._answer = None
        self._waits_for = None
        self._outbox.clear()
        self.receiving = self._receiver.open
        self.due = None
        if not self._garbles:
            self._deaf_until = _FOR_EVER if moment is None else moment

    def hear(self, heard: Heard) -> None:
        """Bytes have arrived."""
        data = heard.data
        if self._waits_for is not None:
            self._put_off(heard, *self._waits_for)
        start = heard.begun_before(self._deaf_until) if self._deaf_until > heard.start else 0
        receiver = self._receiver
        size = len(data)
        while start < size and (found := receiver.receive(data, start)) is not None:
            event, start = found
            if type(event) is Packet:
                self._packet(event, heard, start)
                if start < size and self._deaf_until > heard.start:
                    start = max(start, heard.begun_before(self._deaf_until))
            elif type(event) is LineFault:
                self._owner.tell(
                    ReportKind.LOST,
                    f"a packet whose body is over {MAX_BODY} bytes",
                    when=heard.ends(start - 1),
                )
            # An ACK is of no consequence to a SAC: it sends nothing that it would repeat.
        self.receiving = receiver.open or self._waits_for is not None
        self._see_what_is_due()

    def send(self, dest: int, body: bytes, not_before: Ns) -> Ns:
        """Queue a packet of the node's own; when it will be out, if nothing comes between."""
        data = encode(dest, self.address, body, crc=self.crc)
        if self._garbles:
            data = data.translate(_GARBLED)
        begins = max(not_before, self._busy_until())
        self._outbox.append((not_before, data))
        self._see_what_is_due()
        for _, waiting in self._outbox:
            begins += self._rate.span(len(waiting)) + ENABLE_LEAD
        return begins - ENABLE_LEAD

    def _see_what_is_due(self) -> None:
        if self._answer is not None:
            self.due = self._answer_at
        elif self._outbox:
            self.due = max(self._outbox[0][0], self._sent_until)
        else:
            self.due = None

    def wake(self, now: Ns) -> bytes | None:
        """The bytes whose turn it is."""
        if self.due is None or self.due > now:
            return None
        data = self._answer
        if data is not None:
            self._answer = None
            self._waits_for = None
            self.receiving = self._receiver.open
            if data[-1] == ACK:
                self.acks += 1
            else:
                self.naks += 1
            span = self._answer_span
        else:
            data = self._outbox.pop(0)[1]
            span = self._rate.span(len(data))
        self._sent_until = self._enabled_until = now + span + ENABLE_LEAD
        self._see_what_is_due()
        return data

    def sends(self, now: Ns) -> int:
        """The level of the tx_en pin: 1 while the driver is enabled, from before the first bit."""
        lead = self._enable_lead if self._answer is not None else ENABLE_LEAD
        waits = self.due is not None and now >= self.due - lead
        return int(waits or now < self._enabled_until)

    def _busy_until(self) -> Ns:
        """When the answer that waits, or is on its way, is out, and a packet may follow."""
        if self._answer is not None:
            return self._answer_at + self._answer_span + ENABLE_LEAD
        return self._sent_until

    def _packet(self, packet: Packet, heard: Heard, index: int) -> None:
        """A verdict has fallen at byte ``index - 1`` of what was heard."""
        size = len(packet.body)
        verdict = packet.verdict
        wrong = verdict is _WRONG
        triggered = heard.ends(index - 1)
        general = packet.dest == GENERAL_CALL
        self.packets += 1
        if general and wrong:
            self._owner.tell(ReportKind.LOST, "broadcast with a wrong CRC")
            return
        # The NUL after the trigger byte delays what the device does next. While it makes a NAK it
        # goes on receiving, so that all bytes do up to the next STX (both as recorded).
        limit = -1 if wrong else 1
        run = 0
        if not self._robust:
            come = heard.data[index:] + heard.following
            run = 1 if come == b"\x00" else _run(come, limit)
        handled = heard.ends(index - 1 + run) if run else triggered
        replies = handled
        if self._turnaround:
            # With the robust receiver the NUL itself completed the packet.
            replies += (_AFTER_NUL if run or self._robust else _AFTER_TRIGGER)[size]
        answered = self.ack and not general
        if answered:
            if self._answer is not None:
                # Only at line rates that outrun the turnaround.
                self._owner.tell(
                    ReportKind.LOST, "an answer that had not begun when the next was due"
                )
            self._answer = (nak if wrong else ack)(packet.src, self.address)
            unchecked = verdict is _UNCHECKED
            self._enable_lead = ENABLE_LEAD_UNCHECKED if unchecked else _ENABLED_BEFORE[size]
        self._answer_at = replies
        if self._turnaround and not self._robust and (answered if wrong else not run):
            self._waits_for = (limit, size)
        if wrong:
            self._owner.tell(
                ReportKind.LOST, f"a packet from {packet.src} with a wrong CRC; it gets a NAK"
            )
            return
        if not answered:
            # Nothing to answer, but what it is told to send on takes as long to come.
            self._sent_until = max(self._sent_until, replies)
        if self._deaf:
            if answered:
                self._deaf_until = replies + self._answer_span + _DEAF_AFTER_ANSWER[size]
            else:
                self._deaf_until = handled + _DEAF_AFTER_BROADCAST[size]
        self._owner.network_line(packet.body, packet.src, packet.dest, triggered)

    def _put_off(self, heard: Heard, limit: int, size: int) -> None:
        """Bytes come before the answer has begun: it counts from their end instead."""
        bytes_come = heard.data + heard.following
        run = _run(bytes_come, limit)
        if not run or heard.ends(0) > self._answer_at:
            self._waits_for = None
            return
        was = self._answer_at
        self._answer_at = heard.ends(run - 1) + _AFTER_NUL[size]
        if limit > 0:
            self._waits_for = None
            if self._answer is None:
                self._sent_until = max(self._sent_until, self._answer_at)
                if self._deaf:
                    self._deaf_until = heard.ends(run - 1) + _DEAF_AFTER_BROADCAST[size]
            elif self._deaf:
                self._deaf_until += self._answer_at - was
        elif run < len(bytes_come):
            self._waits_for = None


def _run(data: bytes, limit: int) -> int:
    """How many bytes of ``data`` put an answer off: up to the next STX, ``limit`` if > 0."""
    stx = data.find(STX)
    run = len(data) if stx < 0 else stx
    return min(run, limit) if limit > 0 else run
