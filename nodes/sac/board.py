"""The board of a SAC: network port, message processor, command processor and engine put together.

Owns the wiring of the parts, what they ask of each other and of the node that they are, and what
its boots set up; each part's rules are in its own file, and what the bus sees of it all in
``node.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nodes.sac.boot import LISTENS, NO_POWER, VERSION_LINE, Start
from nodes.sac.command import CommandProcessor
from nodes.sac.engine import Engine
from nodes.sac.memory import Memory
from nodes.sac.message import MessageProcessor
from nodes.sac.movement import SacMovement
from nodes.sac.network import NetworkPort
from nodes.sac.pins import SacPins
from nodes.sac.ports import Ports, understand
from nodes.sac.queries import Query, answer
from nodes.sac.screens import Flags
from nodes.sac.settings import SacSettings
from nodes.sac.terminal import TerminalPort
from sacbus.kernel import LineRate, Ns
from sacbus.language import Session
from sacbus.node import BOOT, OFF, Report, ReportKind
from sacbus.wire import DC1, DC2, GENERAL_CALL

__all__ = ["SacBoard"]


class SacBoard:
    """The parts of one SAC, and its EEPROM. What only some nodes need is made when it is asked for.

    Whoever does something to it notes when, in ``now``, and has it :meth:`look` afterwards.
    """

    __slots__ = (
        "_configured",
        "_movement",
        "_pins",
        "_rate",
        "_tell_bus",
        "commands",
        "eeprom",
        "engine",
        "memory_changed",
        "messages",
        "microstep_pins",
        "network",
        "now",
        "obeyed",
        "onlookers",
        "ports",
        "settings",
        "soft_ops",
        "start",
        "throttles",
        "xclk_hz",
    )

    def __init__(
        self,
        address: int,
        settings: SacSettings,
        rate: LineRate,
        tell: Callable[[Report], None],
        memory: Mapping[str, object] | None = None,
    ) -> None:
        """``memory`` is what its EEPROM holds; None: what it left the factory with."""
        self._configured = address
        self.settings = settings
        self._rate = rate
        self._tell_bus = tell
        #: When something was last done to it, or it did something.
        self.now: Ns = 0
        #: Made when it is first needed: most nodes have nobody at their terminal.
        self.ports: Ports | None = None
        #: Frequency of the clock at the xclk pin.
        self.xclk_hz = settings.xclk_hz
        self._pins: SacPins | None = None
        self._movement: SacMovement | None = None
        #: Those of both that there are: they look whether anything has changed.
        self.onlookers: tuple[SacPins | SacMovement, ...] = ()
        #: Called each time the contents of the EEPROM have changed.
        self.memory_changed: Callable[[], None] | None = None
        #: What the EEPROM holds; what the node obeys is what it held at the last boot.
        self.eeprom = self._factory_memory()
        remarks = [] if memory is None else self._take_stored(memory)
        #: The boot that is under way; None most of a node's life.
        self.start: Start | None = None
        self.boot(0, cold=settings.boot == "cold")
        for remark in remarks:
            tell(Report(0, address, ReportKind.WARNING, remark))

    def _factory_memory(self) -> Memory:
        return self.settings.factory_memory(self._configured, self._rate.baud)

    def boot(self, now: Ns, *, cold: bool) -> None:
        """Begin as after power came, with what the EEPROM holds; not ``cold``: without the wait."""
        memory = self.obeyed = self.eeprom
        self.engine = Engine(self.settings.oscillator, memory.external_clock(self.xclk_hz))
        self.commands = CommandProcessor(
            Session.start(memory.defaults()), self.settings.drive(memory), self.engine, self
        )
        if memory.queue is not None:
            self.commands.queue.load(memory.queue)
        if self._pins is not None and not self._pins.estop:
            self.commands.bar(barred=True, now=now)
        self.network = NetworkPort(self.settings, self._rate, self)
        self.messages = MessageProcessor(self.commands, self)
        #: Levels of MS3 MS2 MS1, bits 2 to 0: low until a driver's table says otherwise.
        self.microstep_pins = 0
        self._set_up_ports()
        self._reset_session()
        if cold:
            self.network.listen_from(now + LISTENS)
            self.start = Start(now + LISTENS, listens=True)
            if self.ports is not None:
                self.ports.terminal.boot(VERSION_LINE)
        else:
            self.start = Start(now) if memory.autorun else None

    # ---- memory ----

    def _take_stored(self, memory: Mapping[str, object]) -> list[str]:
        """Have the EEPROM hold what was stored; sentences about what was not taken as it stood.

        Settings that were given win over it, and the stored d_id over the configured address.
        """
        asked = self.settings.asked_for()
        kept = {name: value for name, value in memory.items() if name not in asked}
        self.eeprom, remarks = self.eeprom.restored(kept)
        if self.eeprom.d_id != self._configured:
            remarks.append(
                f"EEPROM: d_id {self.eeprom.d_id} is stored and wins over the configured "
                f"{self._configured}"
            )
        return remarks

    def write(self, memory: Memory) -> None:
        """Put this into the EEPROM; it is obeyed after the next boot."""
        if memory == self.eeprom:
            return
        self.eeprom = memory
        if self.memory_changed is not None:
            self.memory_changed()

    # ---- boots ----

    def reboot(self, now: Ns) -> None:
        """The warm boot of ``$R``: parameters anew from EEPROM; queue and motor stay.

        It ends with an event of its own at the same instant: then the bus finds the node at its new
        address.
        """
        before = self.obeyed
        memory = self.obeyed = self.eeprom
        self.commands.reboot(Session.start(memory.defaults()), self.settings.drive(memory), now)
        self.commands.set_clock(
            memory.external_clock(self.xclk_hz) or self.settings.oscillator, now
        )
        self.engine.change_microsteps(before.ustep, memory.ustep)
        self._set_up_ports()
        self._reset_session()
        self._show_prompt()
        self.start = Start(now)

    def _reset_session(self) -> None:
        """The settings of the session are the memory's again."""
        memory = self.obeyed
        #: Whether the encoder turns the speed of continuous motion (EnT), or steps the motor (EnF).
        self.throttles = False
        self.send_soft_ops(on=bool(memory.soft_ops))
        pins = memory.microstep_pins
        if pins is not None:
            self.microstep_pins = pins
        else:
            self.tell(
                ReportKind.WARNING,
                f"driver {memory.r_id} has no microsteps of 2**{memory.ustep}: pulses are "
                "multiplied by that, and its pins stay as they are",
            )

    def end_boot(self, start: Start, now: Ns) -> None:
        """End the boot that is under way, if it is over by now."""
        if start.over is None or start.over > now:
            return
        reset = self._pins is not None and not self._pins.rst
        if start.restores or (start.listens and reset):
            self.write(self._factory_memory())
            self.boot(now, cold=False)
            self.tell(
                ReportKind.WARNING,
                "factory restore: its EEPROM is as configured again, the saved queue is gone",
            )
        self.start = None
        if start.listens:
            self._show_prompt()
        if self.obeyed.autorun:
            self.commands.autorun(self.obeyed.autorun, now)

    def _show_prompt(self) -> None:
        if self.ports is not None:
            self.ports.terminal.restart()

    # ---- what its parts, and its pins, are asked for ----

    @property
    def powered(self) -> bool:
        """Whether it is switched on."""
        return self.start is not NO_POWER

    @property
    def booted(self) -> bool:
        """Whether it runs: switched on, and its boot is over."""
        return self.start is None

    @property
    def off_or_booting(self) -> str:
        """OFF or BOOT; empty while it runs."""
        if self.start is None:
            return ""
        return OFF if self.start is NO_POWER else BOOT

    # ---- the ports ----

    def _set_up_ports(self) -> None:
        """Give the two ports their roles and rates."""
        memory, line = self.obeyed, self._rate
        hears = understand(memory.sw, line.baud)
        if memory.network:
            rate = LineRate(memory.hw, line.bits)
            self.network.set_up(memory, rate)
            self.ports_made().exchange(rate, line, hears=hears)
        else:
            self.network.set_up(memory, line, garbles=not hears)
            if self.ports is not None:
                self.ports.put_back()
        if not hears:
            self.tell(
                ReportKind.WARNING,
                f"sw is {memory.sw} baud, the line runs at {line.baud}: it hears nothing, and "
                "nobody understands it",
            )

    def ports_made(self) -> Ports:
        """Its two ports with their terminal, which are there from now on."""
        if self.ports is None:
            self.ports = Ports(self)
        return self.ports

    @property
    def terminal_port(self) -> TerminalPort | None:
        """Its terminal; None as long as nobody has asked for it."""
        return None if self.ports is None else self.ports.terminal

    @property
    def watched(self) -> bool:
        """Whether anybody is at the far end of the terminal."""
        return self.ports is not None and self.ports.watched

    def hardware_keys(self, keys: bytes, now: Ns) -> None:
        """Bytes arrive at the hardware port."""
        self.now = now
        packets = self.ports_made().packets(keys, now)
        if packets is None:
            self.terminal_keys(keys, now)
        else:
            self.network.hear(packets)
        if self.onlookers:
            self.look(now)

    def terminal_keys(self, keys: bytes, now: Ns) -> None:
        """Keys arrive at the terminal, on whichever port; a boot under way takes them all."""
        if keys and (self.start is None or not self.start.key()):
            self.ports_made().terminal.take(keys, now)

    def show(self, text: bytes) -> None:
        """What the terminal prints."""
        self.ports_made().show(text)

    def line_typed(self, line: bytes, now: Ns) -> None:
        """A line was typed at the terminal port."""
        self.messages.terminal_line(line, self.ports_made().terminal, now)

    def answer(self, query: Query) -> list[str]:
        """What a query shows on the terminal."""
        commands, network = self.commands, self.network
        flags = Flags(
            gap=commands.gap,
            debug=commands.debug,
            throttle=self.throttles,
            soft_ops=self.soft_ops,
            ack=network.ack,
            crc=network.crc,
            source=self.messages.last_source,
        )
        return answer(query, commands, self.eeprom, flags)

    # ---- pins ----

    @property
    def pins(self) -> SacPins:
        """Its pins, made when they are first asked for: most nodes have nothing wired to them."""
        if self._pins is None:
            self._pins = SacPins(self)
            self.onlookers = (*self.onlookers, self._pins)
        return self._pins

    @property
    def movement(self) -> SacMovement:
        """Its motion as it tells of it, made when it is first asked for."""
        if self._movement is None:
            self._movement = SacMovement(self)
            self.onlookers = (*self.onlookers, self._movement)
        return self._movement

    def look(self, now: Ns) -> None:
        """Something has been done at ``now``: let those see it who tell of it."""
        for onlooker in self.onlookers:
            onlooker.look(now)

    def send_soft_ops(self, *, on: bool) -> None:
        """Tell the network of the starts and ends of commands, or no longer."""
        #: Whether they are told of over the network.
        self.soft_ops = on
        self.watch_ops()

    def watch_ops(self) -> None:
        """See anew whether anybody is to be told of starts and ends of commands."""
        watched = self._pins is not None and self._pins.watched
        self.commands.switch_ops(on=self.soft_ops or watched, now=self.now)

    def feed_xclk(self, hz: int, now: Ns) -> None:
        """From ``now`` on a clock of ``hz`` comes to the xclk pin; 0: no edges.

        It matters while the node is set to the external clock. Whoever calls this from outside the
        bus has the bus ask the node anew when it wants to be woken.
        """
        self.now = now
        self.xclk_hz = hz
        clock = self.obeyed.external_clock(self.xclk_hz)
        if clock is not None:
            self.commands.set_clock(clock, now)
        if self.onlookers:
            self.look(now)

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        """A packet was accepted."""
        self.messages.network_line(body, source, destination, now)

    def tell_ops(self, *, start: bool, at: Ns) -> Ns:
        """Soft ops tell everybody that a command starts or ends; when that will be out."""
        if not self.soft_ops:
            return at  # the op pins alone are watched
        return self.network.send(GENERAL_CALL, bytes((DC1 if start else DC2,)), at)

    def tell_of_command(self, kind: ReportKind, text: str, command: str | None = None) -> None:
        """About a command that runs later than it came, or else about the line that has come."""
        self.tell(kind, text, self.messages.line if command is None else command, 0)

    def tell(
        self,
        kind: ReportKind,
        text: str,
        line: str = "",
        column: int = 0,
        *,
        when: Ns | None = None,
    ) -> None:
        """Report something of now, or of ``when``, which was heard of only now."""
        at = self.now if when is None else when
        self._tell_bus(Report(at, self.network.address, kind, text, line, column))
