"""The serial port of an SS-MST67: bytes to messages, and the answers.

Owns where a message begins and ends by either mode, the time-out of one that does not come whole,
and what the flags of an answer tell. What a message does is the command processor's business.

In 8-bit mode nothing marks a header: a message follows the one before it, whoever that was for, so
every module counts them all, and a byte that is lost shifts everything until the time-out. In 9-bit
mode a ninth bit of 1 begins a message.

Decisions where the vendor's pages are silent: the time-out is 10 byte times, at least 5 ms, from
the end of the last byte; what a header in 9-bit mode cuts short gets no answer; F and O tell of
what came since the last answer; while an answer waits or goes out the port holds two bytes, as its
UART does, and what comes beyond them is lost and told as an overrun.
"""

from __future__ import annotations

from typing import Final, Protocol

from sacbus.kernel import LineRate, Ns
from sacbus.node import Heard, ReportKind
from sacbus.wire.superstepper import (
    ANSWER_SIZE,
    SIZES,
    Answer,
    Message,
    address_of,
    decode,
    encode_answer,
    opcode_of,
    patience,
)

__all__ = ["NetworkPort", "PortOwner"]

#: Bytes that a UART holds that nobody reads.
_HELD: Final = 2


class PortOwner(Protocol):
    """The node behind the port."""

    def message(self, message: Message, now: Ns) -> int:
        """A message has come; the data of its answer."""
        ...

    def tell(self, kind: ReportKind, text: str) -> None:
        """Something worth a report."""
        ...


class NetworkPort:
    """Messages in, answers out."""

    __slots__ = (
        "_answer",
        "_answer_at",
        "_begun",
        "_framing",
        "_held",
        "_last",
        "_nine",
        "_overrun",
        "_owner",
        "_patience",
        "_sending_until",
        "_span",
        "_turnaround",
        "address",
        "answers",
        "deaf",
        "framing_errors",
        "messages",
        "naks",
        "overruns",
    )

    def __init__(
        self, address: int, owner: PortOwner, rate: LineRate, *, nine: bool, turnaround: Ns
    ) -> None:
        self.address = address
        self._owner = owner
        self._nine = nine
        self._turnaround = turnaround
        self._patience = patience(rate.span(1))
        self._span = rate.span(ANSWER_SIZE)
        #: True while it hears nothing: no power, or set to another rate than its line's.
        self.deaf = False
        #: The bytes of a message so far, whoever it is for, and when the last of them ended.
        self._begun = bytearray()
        self._last: Ns = 0
        #: The answer that waits, and when its first bit goes out.
        self._answer: bytes | None = None
        self._answer_at: Ns = 0
        #: Until when an answer waits or goes out, and what has come meanwhile: bytes as they were
        #: heard, with when each began and ended.
        self._sending_until: Ns = 0
        self._held: list[tuple[int, int | None, Ns, Ns]] = []
        #: What the next answer tells.
        self._framing = False
        self._overrun = False
        self.messages = 0
        self.answers = 0
        self.naks = 0
        self.framing_errors = 0
        self.overruns = 0

    # ---- hearing ----

    def hear(self, heard: Heard) -> None:
        """Bytes have arrived."""
        if self.deaf:
            return
        ninth, framing = heard.ninth, heard.framing
        for place, byte in enumerate(heard.data):
            begins, ends = heard.begins(place), heard.ends(place)
            if framing is not None and framing[place]:
                self._framing = True
                self.framing_errors += 1
            mark = None if ninth is None else ninth[place]
            self._read_held(begins)
            if ends < self._sending_until:
                self._hold(byte, mark, begins, ends)
            else:
                self._take(byte, mark, begins, ends)

    def _hold(self, byte: int, mark: int | None, begins: Ns, ends: Ns) -> None:
        if len(self._held) < _HELD:
            self._held.append((byte, mark, begins, ends))
        else:
            self._overrun = True
            self.overruns += 1
            self._owner.tell(ReportKind.LOST, "a byte that came while it was answering")

    def _read_held(self, now: Ns) -> None:
        """What has come while an answer went out, once that is out."""
        if self._held and now >= self._sending_until:
            held, self._held = self._held, []
            for one in held:
                self._take(*one, read=self._sending_until)

    def _take(
        self, byte: int, mark: int | None, begins: Ns, ends: Ns, *, read: Ns | None = None
    ) -> None:
        """A byte, at its end, or ``read`` later."""
        begun = self._begun
        if begun and begins - self._last >= self._patience:
            begun.clear()
        if self._nine and mark is not None:
            if mark:
                begun.clear()
            elif not begun:
                return
        begun.append(byte)
        self._last = ends
        if len(begun) < SIZES[opcode_of(begun[0])]:
            return
        whole = bytes(begun)
        begun.clear()
        if address_of(whole[0]) == self.address:
            self.messages += 1
            now = ends if read is None else read
            self._reply(self._owner.message(decode(whole)[1], now), now)

    def _reply(self, value: int, now: Ns, *, positive: bool = True) -> None:
        self._answer = encode_answer(
            Answer(self.address, positive, value, self._framing, self._overrun)
        )
        self._framing = self._overrun = False
        self._answer_at = now + (self._turnaround if positive else 0)
        self._sending_until = self._answer_at + self._span
        if positive:
            self.answers += 1
        else:
            self.naks += 1

    # ---- answering ----

    @property
    def due(self) -> Ns | None:
        """When an answer goes out, a message is given up, or held bytes are read."""
        if self._answer is not None:
            return self._answer_at
        if self._held:
            return self._sending_until
        if self._begun and address_of(self._begun[0]) == self.address:
            return self._last + self._patience
        return None

    def wake(self, now: Ns) -> bytes | None:
        """The bytes whose turn it is."""
        self._read_held(now)
        if self._answer is None and self._begun and now >= self._last + self._patience:
            mine = address_of(self._begun[0]) == self.address
            self._begun.clear()
            if mine:
                self._reply(0, now, positive=False)
        if self._answer is None or now < self._answer_at:
            return None
        answer, self._answer = self._answer, None
        return answer

    def switch_off(self) -> None:
        """What was to be said is forgotten, and nothing is heard."""
        self.deaf = True
        self._begun.clear()
        self._held.clear()
        self._answer = None
