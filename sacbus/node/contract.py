"""What the bus and a node are to each other: what a node hears, can be asked, and tells.

Owns these shapes; knows no protocol and no kind.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, runtime_checkable
from typing import Protocol as Contract

from sacbus.kernel import LineRate, Ns
from sacbus.movement import Movement

__all__ = [
    "BOOT",
    "OFF",
    "STANDBY",
    "Heard",
    "MistunedNode",
    "Node",
    "PinError",
    "Pins",
    "Report",
    "ReportKind",
    "Snapshot",
    "Terminal",
]

#: The states of a node that does nothing, of one that has power and does not obey yet, and of one
#: that has none.
STANDBY: Final = "STANDBY"
BOOT: Final = "BOOT"
OFF: Final = "OFF"


@dataclass(slots=True)
class Heard:
    """Some bytes of one transmission as they arrived, with their times.

    ``data`` is what came over the wire, garbled where transmissions overlapped. Its first byte is
    number ``first`` of a transmission that started at ``start``; all its bytes follow each other
    without a pause. ``ninth`` holds a 0 or 1 for each of them where the line has ninth bits and the
    sender sent some. ``following`` is what its sender goes on with behind ``data``: a device sees
    each of these bytes begin in time, so it may take into account that they come, and when. What
    they turn out to be is heard later, if at all. ``framing`` holds a 1 for each byte whose stop
    bit did not come; None where all did.
    """

    data: bytes
    start: Ns
    first: int
    rate: LineRate
    following: bytes
    ninth: bytes | None = None
    framing: bytes | None = None

    def begins(self, index: int) -> Ns:
        """When byte ``index`` of ``data`` began (its start bit)."""
        return self.start + self.rate.span(self.first + index)

    def ends(self, index: int) -> Ns:
        """When byte ``index`` of ``data`` had arrived (the end of its stop bit)."""
        return self.start + self.rate.span(self.first + index + 1)

    def begun_before(self, moment: Ns) -> int:
        """How many bytes of ``data`` began before ``moment``."""
        begun = self.rate.bytes_begun(moment - self.start) - self.first
        return min(max(begun, 0), len(self.data))


class ReportKind(Enum):
    """What a report is about; the value is the word that users see."""

    REFUSED = "refused"  #: a line, or a part of one, that the node does not understand
    IGNORED = "ignored"  #: understood, but without effect now
    MESSAGE = "message"  #: text for the node's terminal
    OVERRUN = "queue overrun"
    WARNING = "warning"  #: obeyed, but it may not be what was meant
    LOST = "lost"  #: a packet that the device loses by its nature


@dataclass(frozen=True, slots=True)
class Report:
    """Something a node says out of band: never on the wire, never an exception.

    ``address`` is the node's, None when it is about the line itself. ``line`` is the command line
    that it is about, ``column`` the place in it (from 1; 0: the whole).
    """

    when: Ns
    address: int | None
    kind: ReportKind
    text: str
    line: str = ""
    column: int = 0

    def __str__(self) -> str:
        where = f" in {self.line!r}" if self.line else ""
        place = f", column {self.column}" if self.column else ""
        who = "line" if self.address is None else f"node {self.address}"
        return f"{who}: {self.kind.value}{where}{place}: {self.text}"


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A node at one instant, for dashboards and scenarios. Positions are signed, clockwise up."""

    address: int
    kind: str
    state: str
    position_steps: float
    position_pulses: int
    rpm: float
    current: str
    pending: tuple[str, ...]
    counters: Mapping[str, int]
    #: Where the motor stands in full steps, if that can be elsewhere: it may have stalled.
    rotor_steps: float | None = None


class Terminal(Contract):
    """A node's terminal port: keys in, text out; a dumb terminal, no packets."""

    #: Takes what the port prints, at once; None while nobody is connected: what is printed is lost.
    show: Callable[[bytes], None] | None

    def type(self, keys: bytes, now: Ns) -> None:
        """Keys arrive. The owner asks the bus to touch the node afterwards (``Bus.touch``)."""
        ...


class PinError(ValueError):
    """A pin that a node does not have, or a level that it cannot have; the text is for users."""


class Pins(Contract):
    """A node's pins: inputs to drive, outputs to look at. Levels are 0 and 1."""

    @property
    def inputs(self) -> Sequence[str]:
        """Names of the pins that can be driven."""
        ...

    @property
    def outputs(self) -> Sequence[str]:
        """Names of the pins that the node drives."""
        ...

    @property
    def told(self) -> Sequence[str]:
        """The outputs whose edges a watcher is told of; pulses are too many."""
        ...

    def check(self, pin: str, level: int) -> None:
        """PinError for what is no input, and for a level that it cannot have."""
        ...

    def drive(self, pin: str, level: int, now: Ns) -> None:
        """Drive an input; PinError as from :meth:`check`.

        The owner asks the bus to touch the node afterwards (``Bus.touch``).
        """
        ...

    def level(self, pin: str, now: Ns) -> int:
        """The level of any pin at ``now``; PinError if there is none of that name."""
        ...

    def watch(self, watcher: Callable[[str, int, Ns], object] | None, now: Ns) -> None:
        """Have ``watcher(pin, level, when)`` called at each edge from ``now`` on; None: nobody.

        The owner asks the bus to touch the node afterwards (``Bus.touch``).
        """
        ...


class Node(Contract):
    """A device on the bus: a synchronous state machine that is told the time.

    The bus calls :meth:`hear` with bytes that may concern it, asks :meth:`wake_at` after every call
    and calls :meth:`wake` then. A node never raises for anything it hears.
    """

    @property
    def address(self) -> int:
        """The address it answers to now; another only after a wake or a touch (``Bus.touch``)."""
        ...

    @property
    def receiving(self) -> bool:
        """True while its receiver stands open: bytes that are not for it may still matter to it."""
        ...

    @property
    def terminal(self) -> Terminal | None:
        """Its terminal port, made when it is first asked for; None for kinds without one."""
        ...

    @property
    def pins(self) -> Pins | None:
        """Its pins, made when first asked for; None for a kind without any."""
        ...

    @property
    def movement(self) -> Movement | None:
        """Its motion, for who records it; made when first asked for; None for what never moves."""
        ...

    @property
    def quiet(self) -> bool:
        """True while it will send nothing until it hears something or is touched (``Bus.touch``).

        What it does then when it is woken shows nowhere but in how it looks, and whoever looks
        brings the bus up to date first. So in real time the bus may let it wait for some ms; by
        bus time it is woken as exactly as ever. What it reports then is told as late, with the
        time at which it was. Where in doubt, False: that costs a wake-up of the process each time.
        """
        ...

    def hear(self, heard: Heard, now: Ns) -> None:
        """Bytes have arrived; ``now`` is when the last of them ended."""
        ...

    def wake_at(self) -> Ns | None:
        """When the node has something to do next: an answer, a change of state; never a pulse."""
        ...

    def wake(self, now: Ns) -> bytes | None:
        """Do what is due, and give the bytes that the node begins to send at ``now``, if any.

        It may be called when nothing is due after all; then nothing happens.
        """
        ...

    def state(self, now: Ns) -> str:
        """The state that its snapshot would give at ``now``, at a fraction of the cost.

        A node that does nothing is in STANDBY, whatever its kind; one that starts and does not
        obey yet in BOOT, and wakes when that is over.
        """
        ...

    def snapshot(self, now: Ns) -> Snapshot:
        """What can be seen of it at ``now``; changes nothing."""
        ...

    def stop(self, now: Ns) -> None:
        """Stop its motor at once and drop all that waits, as its kind does in an emergency.

        Nothing while it is off or boots, nor for what never moves. The owner asks the bus to touch
        the node afterwards (``Bus.touch``).
        """
        ...

    def power(self, *, on: bool, now: Ns) -> None:
        """Switch it off, or on again for a cold boot; nothing if it is that already.

        Off, it forgets all but its EEPROM. The owner asks the bus to touch the node afterwards.
        """
        ...

    #: Called by the node each time the contents of its EEPROM have changed.
    memory_changed: Callable[[], None] | None

    def persist(self) -> Mapping[str, object]:
        """The contents of its EEPROM, as JSON has them. Cheap: it is asked at each change."""
        ...


@runtime_checkable
class MistunedNode(Contract):
    """What a node has besides whose UART may run at a rate of its own."""

    @property
    def uart_baud(self) -> int | None:
        """That rate, as it is put on its line; None: the line's."""
        ...
