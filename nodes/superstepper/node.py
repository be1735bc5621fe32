"""An SS-MST67: serial port, command processor and motor put together.

Owns the node as the bus sees it (the contract of ``sacbus.node``), and what power-on sets up; each
part's rules are in its own file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from nodes.superstepper.command import CommandProcessor
from nodes.superstepper.engine import EIGHTHS, Engine, timer
from nodes.superstepper.memory import FALLBACK_CODE, baud_error, nominal_baud, own_baud
from nodes.superstepper.movement import SuperStepperMovement
from nodes.superstepper.network import NetworkPort
from nodes.superstepper.pins import SuperStepperPins
from nodes.superstepper.settings import SuperStepperSettings
from sacbus.kernel import US, LineRate, Ns
from sacbus.node import OFF, Heard, Report, ReportKind, Snapshot
from sacbus.wire.superstepper import Message, describe

__all__ = ["SuperStepperNode"]

#: An error of its rate that is worth a warning: what data sheets leave to each side of a line.
_TOLERANCE: Final = 0.025


class SuperStepperNode:
    """One virtual SS-MST67, with the factory's EEPROM as its settings give it."""

    kind = "ss-mst67"
    #: It has none.
    terminal = None

    __slots__ = (
        "_commands",
        "_configured",
        "_movement",
        "_network",
        "_pins",
        "_rate",
        "_settings",
        "_tell_bus",
        "eeprom",
        "memory_changed",
        "now",
        "powered",
    )

    def __init__(
        self,
        address: int,
        settings: SuperStepperSettings,
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
        self.powered = True
        self._pins: SuperStepperPins | None = None
        self._movement: SuperStepperMovement | None = None
        #: Called each time the contents of the EEPROM have changed.
        self.memory_changed: Callable[[], None] | None = None
        self.eeprom = settings.factory_eeprom(address, rate.baud)
        remarks = []
        if memory is not None:
            kept = {name: value for name, value in memory.items() if name not in settings.stored}
            remarks = self.eeprom.restore(kept)
        self._power_on()
        self._tell_how_it_is_set()
        for remark in remarks:
            self.tell(ReportKind.WARNING, remark)

    def _power_on(self) -> None:
        """Take over what the jumpers select, and load the RAM."""
        settings, eeprom = self._settings, self.eeprom
        self._network = NetworkPort(
            0 if self._hardwired else eeprom.address,
            self,
            self._rate,
            nine=settings.nine,
            turnaround=settings.turnaround_us * US,
        )
        self._network.deaf = nominal_baud(self.uart_code) != self._rate.baud
        self._commands = CommandProcessor(Engine(timer(settings.ppm)), eeprom, self)

    @property
    def _hardwired(self) -> bool:
        """Whether rate and address are those of JMP1."""
        return self._settings.jmp1 == "open"

    def _tell_how_it_is_set(self) -> None:
        """What may not be as it was meant."""
        if self.address != self._configured:
            why = "JMP1 is open" if self._hardwired else "its EEPROM says so"
            self.tell(
                ReportKind.WARNING,
                f"it answers at address {self.address}, not at the configured "
                f"{self._configured}: {why}",
            )
        baud = nominal_baud(self.uart_code)
        if self._network.deaf:
            self.tell(
                ReportKind.WARNING,
                f"it is set to {baud} baud, the line runs at {self._rate.baud}: it hears nothing",
            )
            return
        code = self.uart_code
        error = baud_error(code)
        if abs(error) > _TOLERANCE:
            self.tell(
                ReportKind.WARNING,
                f"its crystal makes {own_baud(code):.0f} baud of code {code}, {error:+.1%} off "
                f"{baud}: a real module may be misunderstood",
            )

    @property
    def uart_baud(self) -> int | None:
        """What its crystal makes of the line's rate, where that is to be so; None: the line's."""
        if not self._settings.own_baud or self._network.deaf:
            return None
        return round(own_baud(self.uart_code))

    @property
    def uart_code(self) -> int:
        """The baud code that it runs by."""
        return FALLBACK_CODE if self._hardwired else self.eeprom.baud_code

    # ---- the bus's side ----

    @property
    def address(self) -> int:
        """What it answers to."""
        return self._network.address

    @property
    def receiving(self) -> bool:
        """All bytes are for all modules anyway."""
        return False

    @property
    def quiet(self) -> bool:
        """True while it has nothing to send."""
        return self._network.due is None

    def hear(self, heard: Heard, now: Ns) -> None:
        """Bytes from the master's lane."""
        self.now = now
        self._commands.wake(now)
        self._network.hear(heard)
        self.look(now)

    def wake_at(self) -> Ns | None:
        """The next answer, the end of a message's patience, of a motion or of a direction."""
        engine = self._commands.engine
        times = (self._network.due, engine.turns, engine.end)
        return min((one for one in times if one is not None), default=None)

    def wake(self, now: Ns) -> bytes | None:
        """End what is over; send what is due."""
        self.now = now
        self._commands.wake(now)
        data = self._network.wake(now)
        self.look(now)
        return data

    def state(self, now: Ns) -> str:
        """What the motor does; OFF."""
        return self._commands.engine.state(now) if self.powered else OFF

    def snapshot(self, now: Ns) -> Snapshot:
        """State, position and counts at ``now``."""
        commands, network = self._commands, self._network
        engine = commands.engine
        command = commands.command if engine.running(now) is not None else None
        return Snapshot(
            address=self.address,
            kind=self.kind,
            state=self.state(now),
            position_steps=engine.eighths(now) / EIGHTHS,
            position_pulses=engine.position(now),
            rpm=engine.rpm(now, self.steps_per_revolution),
            current="" if command is None else describe(command),
            pending=(),
            counters={
                "messages": network.messages,
                "ack": network.answers,
                "nak": network.naks,
                "framing errors": network.framing_errors,
                "overruns": network.overruns,
                "steps run": commands.steps_run(now),
            },
        )

    def stop(self, now: Ns) -> None:
        """No further step, as by opcode 4 without deceleration; a driver that is off stays off."""
        self.now = now
        if self.powered:
            self._commands.emergency(now)
        self.look(now)

    def power(self, *, on: bool, now: Ns) -> None:
        """Switch it off, or on again; nothing if it is that already. It obeys at once [D].

        Off, it forgets all but its EEPROM, also where its motor stands.
        """
        self.now = now
        if on is self.powered:
            return
        home = self._commands.home
        self.powered = on
        self._power_on()
        self._commands.home = home
        if on:
            self._tell_how_it_is_set()
        else:
            self._network.switch_off()
        self.look(now)

    def persist(self) -> Mapping[str, object]:
        """The EEPROM's contents."""
        return self.eeprom.stored()

    # ---- what its parts, its pins and its movement are asked for ----

    @property
    def commands(self) -> CommandProcessor:
        """Its command processor."""
        return self._commands

    @property
    def network(self) -> NetworkPort:
        """Its serial port."""
        return self._network

    @property
    def steps_per_revolution(self) -> int:
        """Full steps of its motor in a turn."""
        return self._settings.steps_per_revolution

    @property
    def pins(self) -> SuperStepperPins:
        """Its pins, made when they are first asked for."""
        if self._pins is None:
            self._pins = SuperStepperPins(self)
        return self._pins

    @property
    def movement(self) -> SuperStepperMovement:
        """Its motion as it tells of it, made when it is first asked for."""
        if self._movement is None:
            self._movement = SuperStepperMovement(self)
        return self._movement

    def look(self, now: Ns) -> None:
        """Something has been done at ``now``: let those see it who tell of it."""
        if self._pins is not None:
            self._pins.look(now)
        if self._movement is not None:
            self._movement.look(now)

    def message(self, message: Message, now: Ns) -> int:
        """A message for it has come."""
        return self._commands.execute(message, now)

    def eeprom_written(self) -> None:
        """Its EEPROM has changed."""
        if self.memory_changed is not None:
            self.memory_changed()

    def tell(self, kind: ReportKind, text: str) -> None:
        """Report something, now."""
        self._tell_bus(Report(self.now, self.address, kind, text))
