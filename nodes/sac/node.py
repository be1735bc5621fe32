"""A SAC: network port, message processor, command processor and motion engine put together.

Owns the node as the bus sees it (the contract of ``sacbus.node``), the wiring of its parts, and
what its boots set up; each part's rules are in its own file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nodes.sac.boot import LISTENS, NO_POWER, VERSION_LINE, Start
from nodes.sac.command import CommandProcessor, shortest
from nodes.sac.engine import Engine
from nodes.sac.memory import Memory
from nodes.sac.message import MessageProcessor
from nodes.sac.movement import SacMovement
from nodes.sac.network import NetworkPort
from nodes.sac.pins import SacPins
from nodes.sac.ports import HardwarePort, Ports, understand
from nodes.sac.queries import Query, answer
from nodes.sac.screens import Flags
from nodes.sac.settings import SacSettings
from nodes.sac.terminal import TerminalPort
from sacbus.kernel import LineRate, Ns
from sacbus.language import Session, Stop
from sacbus.node import BOOT, OFF, Heard, Report, ReportKind, Snapshot
from sacbus.wire import DC1, DC2, GENERAL_CALL

__all__ = ["SacNode"]


class SacNode:
    """One virtual SAC, with the factory's memory as its settings give it.

    It starts booted, or cold if its settings say so: then it is deaf for a second of bus time.
    """

    kind = "sac"

    __slots__ = (
        "_commands",
        "_configured",
        "_engine",
        "_memory",
        "_messages",
        "_movement",
        "_network",
        "_onlookers",
        "_pins",
        "_ports",
        "_rate",
        "_settings",
        "_start",
        "_tell_bus",
        "eeprom",
        "memory_changed",
        "microstep_pins",
        "now",
        "soft_ops",
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
        self._settings = settings
        self._rate = rate
        self._tell_bus = tell
        #: When something was last done to it, or it did something.
        self.now: Ns = 0
        #: Made when it is first needed: most nodes have nobody at their terminal.
        self._ports: Ports | None = None
        #: Frequency of the clock at the xclk pin.
        self.xclk_hz = settings.xclk_hz
        self._pins: SacPins | None = None
        self._movement: SacMovement | None = None
        #: Those of both that there are: they look whether anything has changed.
        self._onlookers: tuple[SacPins | SacMovement, ...] = ()
        #: Called each time the contents of the EEPROM have changed.
        self.memory_changed: Callable[[], None] | None = None
        #: What the EEPROM holds; what the node obeys is what it held at the last boot.
        self.eeprom = self._factory_memory()
        remarks = [] if memory is None else self._take_stored(memory)
        #: The boot that is under way; None most of a node's life.
        self._start: Start | None = None
        self._boot(0, cold=settings.boot == "cold")
        for remark in remarks:
            tell(Report(0, address, ReportKind.WARNING, remark))

    def _factory_memory(self) -> Memory:
        return self._settings.factory_memory(self._configured, self._rate.baud)

    def _boot(self, now: Ns, *, cold: bool) -> None:
        """Begin as after power came, with what the EEPROM holds; not ``cold``: without the wait."""
        memory = self._memory = self.eeprom
        self._engine = Engine(self._settings.oscillator, memory.external_clock(self.xclk_hz))
        self._commands = CommandProcessor(
            Session.start(memory.defaults()), self._settings.drive(memory), self._engine, self
        )
        if memory.queue is not None:
            self._commands.queue.load(memory.queue)
        if self._pins is not None and not self._pins.estop:
            self._commands.bar(barred=True, now=now)
        self._network = NetworkPort(self._settings, self._rate, self)
        self._messages = MessageProcessor(self._commands, self)
        #: Levels of MS3 MS2 MS1, bits 2 to 0: low until a driver's table says otherwise.
        self.microstep_pins = 0
        self._set_up_ports()
        self._reset_session()
        if cold:
            self._network.listen_from(now + LISTENS)
            self._start = Start(now + LISTENS, listens=True)
            if self._ports is not None:
                self._ports.terminal.boot(VERSION_LINE)
        else:
            self._start = Start(now) if memory.autorun else None

    @property
    def address(self) -> int:
        """Its d_id."""
        return self._network.address

    @property
    def receiving(self) -> bool:
        """True while its receiver stands open."""
        return self._network.receiving or (self._ports is not None and self._ports.exchanged)

    @property
    def quiet(self) -> bool:
        """True while it has nothing to send, and nobody is to be told of starts and ends."""
        if self._start is not None:
            return False
        sends = self._network.due
        if self._ports is not None:
            sends = self._ports.due(sends)
        return sends is None and not self._commands.tells_ops

    def hear(self, heard: Heard, now: Ns) -> None:
        """Bytes from the line."""
        self.now = now
        if self._ports is None or (keys := self._ports.keys(heard)) is None:
            self._network.hear(heard)
        else:
            self._terminal_keys(keys, now)
        if self._onlookers:
            self.look(now)

    def wake_at(self) -> Ns | None:
        """The next answer or packet to send, the end of the command that runs, or of a boot."""
        if self._start is not None:
            return self._start.over
        sends = self._network.due
        if self._ports is not None:
            sends = self._ports.due(sends)
        ends = self._commands.due
        if sends is None:
            return ends
        return sends if ends is None or sends < ends else ends

    def wake(self, now: Ns) -> bytes | None:
        """End what is over; send what is due."""
        self.now = now
        if self._start is not None:
            self._end_boot(self._start, now)
        self._commands.wake(now)
        if self._onlookers:
            self.look(now)
        data = self._network.wake(now)
        return data if self._ports is None else self._ports.say(data, now)

    def state(self, now: Ns) -> str:
        """What the engine does; SYNC while a command is held that has not begun; OFF; BOOT."""
        if self._start is not None:
            return self.off_or_booting
        return "SYNC" if self._commands.held is not None else self._engine.state(now).name

    def snapshot(self, now: Ns) -> Snapshot:
        """State, position and counts at ``now``."""
        commands, engine, network = self._commands, self._engine, self._network
        pulses, microsteps, rotor = engine.where(now)
        per_step = 2**self._memory.ustep
        held = commands.held
        current = commands.current or held
        pending = commands.pending
        defaults = commands.session.defaults
        return Snapshot(
            address=self.address,
            kind=self.kind,
            state=self.state(now),
            position_steps=microsteps / per_step,
            position_pulses=pulses,
            rpm=engine.rpm(now),
            current="" if current is None else shortest(current, defaults),
            pending=tuple(shortest(one, defaults) for one in pending),
            counters={"packets": network.packets, "ack": network.acks, "nak": network.naks},
            rotor_steps=rotor / per_step if self._settings.pull_in else None,
        )

    # ---- memory ----

    def persist(self) -> Mapping[str, object]:
        """The EEPROM's contents."""
        return self.eeprom.stored()

    def _take_stored(self, memory: Mapping[str, object]) -> list[str]:
        """Have the EEPROM hold what was stored; sentences about what was not taken as it stood.

        Settings that were given win over it, and the stored d_id over the configured address.
        """
        asked = self._settings.asked_for()
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

    def stop(self, now: Ns) -> None:
        """Stop as by ``S``: no further pulse, and nothing of what waits; not while off or booting.

        Whoever calls this has the bus ask the node anew when it wants to be woken.
        """
        self.now = now
        if self._start is None:
            self._commands.execute(Stop(grace=False), now)
        if self._onlookers:
            self.look(now)

    def power(self, *, on: bool, now: Ns) -> None:
        """Switch it off, or on again for a cold boot; nothing if it is that already.

        Off, it does nothing and forgets all but its EEPROM, also where its motor stands. Whoever
        calls this from outside the bus has the bus ask the node anew when it wants to be woken.
        """
        self.now = now
        if on is not (self._start is NO_POWER):
            return
        if on:
            self._boot(now, cold=True)
        else:
            self._commands.execute(Stop(grace=False), now)
            self._network.listen_from(None)
            self._start = NO_POWER
        if self._onlookers:
            self.look(now)

    def reboot(self, now: Ns) -> None:
        """The warm boot of ``$R``: parameters anew from EEPROM; queue and motor stay.

        It ends with an event of its own at the same instant: then the bus finds the node at its new
        address.
        """
        before = self._memory
        memory = self._memory = self.eeprom
        self._commands.reboot(Session.start(memory.defaults()), self._settings.drive(memory), now)
        self._commands.set_clock(
            memory.external_clock(self.xclk_hz) or self._settings.oscillator, now
        )
        self._engine.change_microsteps(before.ustep, memory.ustep)
        self._set_up_ports()
        self._reset_session()
        self._show_prompt()
        self._start = Start(now)

    def _reset_session(self) -> None:
        """The settings of the session are the memory's again."""
        memory = self._memory
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

    def _end_boot(self, start: Start, now: Ns) -> None:
        if start.over is None or start.over > now:
            return
        reset = self._pins is not None and not self._pins.rst
        if start.restores or (start.listens and reset):
            self.write(self._factory_memory())
            self._boot(now, cold=False)
            self.tell(
                ReportKind.WARNING,
                "factory restore: its EEPROM is as configured again, the saved queue is gone",
            )
        self._start = None
        if start.listens:
            self._show_prompt()
        if self._memory.autorun:
            self._commands.autorun(self._memory.autorun, now)

    def _show_prompt(self) -> None:
        if self._ports is not None:
            self._ports.terminal.restart()

    # ---- what its parts, and its pins, are asked for ----

    @property
    def commands(self) -> CommandProcessor:
        """Its command processor."""
        return self._commands

    @property
    def network(self) -> NetworkPort:
        """Its network port."""
        return self._network

    @property
    def engine(self) -> Engine:
        """Its motion engine."""
        return self._engine

    @property
    def obeyed(self) -> Memory:
        """The memory that it booted with."""
        return self._memory

    @property
    def powered(self) -> bool:
        """Whether it is switched on."""
        return self._start is not NO_POWER

    @property
    def booted(self) -> bool:
        """Whether it runs: switched on, and its boot is over."""
        return self._start is None

    @property
    def off_or_booting(self) -> str:
        """OFF or BOOT; empty while it runs."""
        if self._start is None:
            return ""
        return OFF if self._start is NO_POWER else BOOT

    # ---- the ports ----

    def _set_up_ports(self) -> None:
        """Give the two ports their roles and rates."""
        memory, line = self._memory, self._rate
        hears = understand(memory.sw, line.baud)
        if memory.network:
            rate = LineRate(memory.hw, line.bits)
            self._network.set_up(memory, rate)
            self._ports_made().exchange(rate, line, hears=hears)
        else:
            self._network.set_up(memory, line, garbles=not hears)
            if self._ports is not None:
                self._ports.put_back()
        if not hears:
            self.tell(
                ReportKind.WARNING,
                f"sw is {memory.sw} baud, the line runs at {line.baud}: it hears nothing, and "
                "nobody understands it",
            )

    def _ports_made(self) -> Ports:
        if self._ports is None:
            self._ports = Ports(self)
        return self._ports

    @property
    def terminal(self) -> HardwarePort:
        """Its hardware port, where its terminal is (``ports.py``)."""
        return self._ports_made().hardware

    @property
    def terminal_port(self) -> TerminalPort | None:
        """Its terminal; None as long as nobody has asked for it."""
        return None if self._ports is None else self._ports.terminal

    @property
    def watched(self) -> bool:
        """Whether anybody is at the far end of the terminal."""
        return self._ports is not None and self._ports.watched

    def hardware_keys(self, keys: bytes, now: Ns) -> None:
        """Bytes arrive at the hardware port."""
        self.now = now
        packets = self._ports_made().packets(keys, now)
        if packets is None:
            self._terminal_keys(keys, now)
        else:
            self._network.hear(packets)
        if self._onlookers:
            self.look(now)

    def _terminal_keys(self, keys: bytes, now: Ns) -> None:
        """Keys arrive at the terminal, on whichever port; a boot under way takes them all."""
        if keys and (self._start is None or not self._start.key()):
            self._ports_made().terminal.take(keys, now)

    def show(self, text: bytes) -> None:
        """What the terminal prints."""
        self._ports_made().show(text)

    def line_typed(self, line: bytes, now: Ns) -> None:
        """A line was typed at the terminal port."""
        self._messages.terminal_line(line, self._ports_made().terminal, now)

    def answer(self, query: Query) -> list[str]:
        """What a query shows on the terminal."""
        commands, network = self._commands, self._network
        flags = Flags(
            gap=commands.gap,
            debug=commands.debug,
            throttle=self.throttles,
            soft_ops=self.soft_ops,
            ack=network.ack,
            crc=network.crc,
            source=self._messages.last_source,
        )
        return answer(query, commands, self.eeprom, flags)

    # ---- pins ----

    @property
    def pins(self) -> SacPins:
        """Its pins, made when they are first asked for: most nodes have nothing wired to them."""
        if self._pins is None:
            self._pins = SacPins(self)
            self._onlookers = (*self._onlookers, self._pins)
        return self._pins

    @property
    def movement(self) -> SacMovement:
        """Its motion as it tells of it, made when it is first asked for."""
        if self._movement is None:
            self._movement = SacMovement(self)
            self._onlookers = (*self._onlookers, self._movement)
        return self._movement

    def look(self, now: Ns) -> None:
        """Something has been done at ``now``: let those see it who tell of it."""
        for onlooker in self._onlookers:
            onlooker.look(now)

    def send_soft_ops(self, *, on: bool) -> None:
        """Tell the network of the starts and ends of commands, or no longer."""
        #: Whether they are told of over the network.
        self.soft_ops = on
        self.watch_ops()

    def watch_ops(self) -> None:
        """See anew whether anybody is to be told of starts and ends of commands."""
        watched = self._pins is not None and self._pins.watched
        self._commands.switch_ops(on=self.soft_ops or watched, now=self.now)

    def feed_xclk(self, hz: int, now: Ns) -> None:
        """From ``now`` on a clock of ``hz`` comes to the xclk pin; 0: no edges.

        It matters while the node is set to the external clock. Whoever calls this from outside the
        bus has the bus ask the node anew when it wants to be woken.
        """
        self.now = now
        self.xclk_hz = hz
        clock = self._memory.external_clock(self.xclk_hz)
        if clock is not None:
            self._commands.set_clock(clock, now)
        if self._onlookers:
            self.look(now)

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        """A packet was accepted."""
        self._messages.network_line(body, source, destination, now)

    def tell_ops(self, *, start: bool, at: Ns) -> Ns:
        """Soft ops tell everybody that a command starts or ends; when that will be out."""
        if not self.soft_ops:
            return at  # the op pins alone are watched
        return self._network.send(GENERAL_CALL, bytes((DC1 if start else DC2,)), at)

    def tell_of_command(self, kind: ReportKind, text: str, command: str | None = None) -> None:
        """About a command that runs later than it came, or else about the line that has come."""
        self.tell(kind, text, self._messages.line if command is None else command, 0)

    def tell(self, kind: ReportKind, text: str, line: str = "", column: int = 0) -> None:
        """Report something, now."""
        self._tell_bus(Report(self.now, self.address, kind, text, line, column))
