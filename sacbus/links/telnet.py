"""RFC 2217 without I/O: what a client sends comes apart into data, settings and answers.

Owns pyserial's ``rfc2217.PortManager``, which does the negotiating, and whose known defects end in
this file. Given a suboption that was never begun (``IAC SE``), is too short or holds a parity or
stop size that does not exist, it raises; it collects a suboption without a bound; it never answers
a client that asks for break, DTR, RTS, inbound flow control or the signature, nor one that sets the
masks of line and modem state; and it looks at data byte by byte in Python. So it is handed whole
sequences only, that have been found in order, and never any data.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, cast

from serial import rfc2217

from .link import SerialFormat

__all__ = ["ComPort", "Telnet"]

#: The longest suboption that is looked at. Those of RFC 2217 have at most ten bytes, save the
#: signature, which is a line of text.
LONGEST: Final = 512

_SIGNATURE: Final = b"\x00"
_SIGNED: Final = b"sacbus"

_IAC: Final = rfc2217.IAC
_IAC_DOUBLED: Final = rfc2217.IAC_DOUBLED
_BEGIN: Final = _IAC + rfc2217.SB
_END: Final = _IAC + rfc2217.SE

#: One sequence that begins with IAC, whole. A suboption ends with IAC SE; another command in it, or
#: its like, cuts it off and is one itself. Possessive, so that no garbage makes it slow.
_SEQUENCE: Final = re.compile(
    rb"\xff(?:(?P<data>\xff)"
    rb"|(?P<option>[\xfb-\xfe].)"
    rb"|\xfa(?P<body>(?:[^\xff]++|\xff\xff)*+)(?:(?P<whole>\xff\xf0)|(?=\xff[^\xff]))"
    rb"|[^\xfa-\xff])",
    re.DOTALL,
)
_BODY: Final = re.compile(rb"\xff\xfa(?:[^\xff]++|\xff\xff)*+", re.DOTALL)

#: Bytes that a suboption of RFC 2217 must hold for PortManager to understand it.
_LEAST: Final = {
    rfc2217.SET_BAUDRATE: 4,
    rfc2217.SET_DATASIZE: 1,
    rfc2217.SET_PARITY: 1,
    rfc2217.SET_STOPSIZE: 1,
    rfc2217.SET_CONTROL: 1,
    rfc2217.SET_LINESTATE_MASK: 1,
    rfc2217.SET_MODEMSTATE_MASK: 1,
}
#: What may be set, where PortManager takes more than it can look up; 0 asks what is set.
_KNOWN: Final = {
    rfc2217.SET_PARITY: {0, *rfc2217.RFC2217_REVERSE_PARITY_MAP},
    rfc2217.SET_STOPSIZE: {0, *rfc2217.RFC2217_REVERSE_STOPBIT_MAP},
}
_MASKS: Final = {
    rfc2217.SET_LINESTATE_MASK: rfc2217.SERVER_SET_LINESTATE_MASK,
    rfc2217.SET_MODEMSTATE_MASK: rfc2217.SERVER_SET_MODEMSTATE_MASK,
}
#: Kinds of flow control that are asked for or set and that PortManager knows nothing of, and the
#: answer: none of them is in use.
_NO_FLOW: Final = {
    rfc2217.SET_CONTROL_REQ_FLOW_SETTING_IN: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL_IN,
    rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL_IN: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL_IN,
    rfc2217.SET_CONTROL_USE_SW_FLOW_CONTOL_IN: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL_IN,
    rfc2217.SET_CONTROL_USE_HW_FLOW_CONTOL_IN: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL_IN,
    rfc2217.SET_CONTROL_USE_DTR_FLOW_CONTROL: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL_IN,
    rfc2217.SET_CONTROL_USE_DCD_FLOW_CONTROL: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL,
    rfc2217.SET_CONTROL_USE_DSR_FLOW_CONTROL: rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL,
}


class ComPort:
    """The serial port that a client takes us for: what it has set, and lines that say: go ahead.

    In pyserial's words, since PortManager acts on it. A virtual line has nothing that break, RTS or
    DTR could act on: they are kept, so that a client finds them as it left them.
    """

    cts = dsr = cd = True
    ri = False

    def __init__(self, baud: int) -> None:
        self.baudrate = baud
        self.format = SerialFormat()
        self.rts = self.dtr = True
        self.break_condition = self.rtscts = self.xonxoff = False

    @property
    def bytesize(self) -> int:
        return self.format.data_bits

    @bytesize.setter
    def bytesize(self, bits: int) -> None:
        if not 5 <= bits <= 8:
            raise ValueError(f"data bits: expected 5 to 8, got {bits}")
        self.format = replace(self.format, data_bits=bits)

    @property
    def parity(self) -> str:
        return self.format.parity

    @parity.setter
    def parity(self, parity: str) -> None:
        self.format = replace(self.format, parity=parity)

    @property
    def stopbits(self) -> float:
        return self.format.stop_bits

    @stopbits.setter
    def stopbits(self, bits: float) -> None:
        self.format = replace(self.format, stop_bits=bits)

    def reset_input_buffer(self) -> None:
        """Nothing is kept here: what the client hears after our answer came after its wish."""

    def reset_output_buffer(self) -> None:
        """What the client has said is on its way to the line already."""


class Telnet:
    """One client's side of a connection: give it what came, by :meth:`receive`.

    ``hear`` is given the client's data, in order with what it sets on ``port`` in between; ``say``
    what must go back to it, in whole sequences. Nothing is ever raised for what a client sends.
    """

    def __init__(
        self, baud: int, hear: Callable[[bytes], None], say: Callable[[bytes], None]
    ) -> None:
        self.port = ComPort(baud)
        self._hear = hear
        self._say = say
        self._answers = bytearray()
        #: The beginning of a sequence whose rest has not come; of a suboption too long not that.
        self._begun = b""
        self._too_long = False
        # It asks little of its two partners, and its types ask for two of pyserial's ports.
        self._negotiation = rfc2217.PortManager(cast("Any", self.port), cast("Any", self))
        self._answer()

    @staticmethod
    def escaped(data: bytes) -> bytes:
        """The line's bytes as a client must be sent them."""
        return data.replace(_IAC, _IAC_DOUBLED)

    def receive(self, data: bytes) -> None:
        """Bytes from the client, cut anywhere."""
        if _IAC not in data and not self._begun:
            self._hear(data)
        elif not self._begun and _IAC not in data.replace(_IAC_DOUBLED, b""):
            self._hear(data.replace(_IAC_DOUBLED, _IAC))
        else:
            self._take_apart(self._begun + data)

    def write(self, data: bytes) -> None:
        """PortManager's: say this."""
        self._answers += data

    def _take_apart(self, data: bytes) -> None:
        self._begun = b""
        heard = bytearray()
        at = 0
        while (start := data.find(_IAC, at)) >= 0:
            heard += data[at:start]
            found = _SEQUENCE.match(data, start)
            if found is None:
                self._keep(data[start:])
                at = len(data)
                break
            at = found.end()
            if found["data"]:
                heard += _IAC
                continue
            if heard:  # it was said before, under the settings of before
                self._answer()
                self._hear(bytes(heard))
                heard.clear()
            self._obey(found)
        heard += data[at:]
        self._answer()
        if heard:
            self._hear(bytes(heard))

    def _keep(self, begun: bytes) -> None:
        """Wait for the rest of a sequence; of one that is too long for its end only."""
        body = _BODY.match(begun)
        if body is not None and len(body[0]) - len(_BEGIN) > LONGEST:
            self._too_long = True
            begun = _BEGIN + begun[body.end() :]
        self._begun = begun

    def _obey(self, sequence: re.Match[bytes]) -> None:
        if sequence["option"]:
            self._negotiate(sequence[0])
        elif sequence["body"] is not None:
            too_long = self._too_long or len(sequence["body"]) > LONGEST
            self._too_long = False
            if sequence["whole"] and not too_long:
                body = sequence["body"].replace(_IAC_DOUBLED, _IAC)
                if body[:1] == rfc2217.COM_PORT_OPTION:
                    self._set(body[1:2], body[2:])

    def _set(self, what: bytes, value: bytes) -> None:
        """One suboption of RFC 2217, that a client sets or asks for something by."""
        if what == _SIGNATURE:
            if not value:
                self._tell(_SIGNATURE, _SIGNED)
            return
        if len(value) < _LEAST.get(what, 0):
            return
        if what == rfc2217.SET_CONTROL and (answer := self._control(value[:1])):
            self._tell(rfc2217.SERVER_SET_CONTROL, answer)
            return
        if what in _KNOWN and value[0] not in _KNOWN[what]:
            value = b"\x00"  # the answer to what cannot be is what is
        value = value.replace(_IAC, _IAC_DOUBLED)
        self._negotiate(_BEGIN + rfc2217.COM_PORT_OPTION + what + value + _END)
        if what in _MASKS:
            self._tell(_MASKS[what], value[:1])

    def _control(self, wish: bytes) -> bytes | None:
        """The answer to a wish that PortManager would leave without one; None for the others."""
        port = self.port
        if wish == rfc2217.SET_CONTROL_REQ_BREAK_STATE:
            on, off = rfc2217.SET_CONTROL_BREAK_ON, rfc2217.SET_CONTROL_BREAK_OFF
            return on if port.break_condition else off
        if wish == rfc2217.SET_CONTROL_REQ_DTR:
            return rfc2217.SET_CONTROL_DTR_ON if port.dtr else rfc2217.SET_CONTROL_DTR_OFF
        if wish == rfc2217.SET_CONTROL_REQ_RTS:
            return rfc2217.SET_CONTROL_RTS_ON if port.rts else rfc2217.SET_CONTROL_RTS_OFF
        return _NO_FLOW.get(wish)

    def _negotiate(self, sequence: bytes) -> None:
        deque(self._negotiation.filter(sequence), maxlen=0)  # no data in it

    def _tell(self, what: bytes, value: bytes) -> None:
        self._negotiation.rfc2217_send_subnegotiation(what, value)

    def _answer(self) -> None:
        if self._answers:
            answers = bytes(self._answers)
            self._answers.clear()
            self._say(answers)
