"""The command processor of an SS-MST67: what each message does, at once.

Owns the move that runs (its speed, its direction, how many steps are left), the home sensor's part
in it, the status register and the count of steps run. How a motion goes is the plan's business,
where the motor stands the engine's. A command replaces the one that runs.
Source: manual, "Commands"; spec, superstepper ("Motion").
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, assert_never

from nodes.superstepper.course import ACCEL, DECEL, Stretch
from nodes.superstepper.engine import EIGHTHS, Engine
from nodes.superstepper.memory import MS_DECAY, Eeprom, Ram
from nodes.superstepper.plan import Entry, Profile, brake, speed_plan, steps_plan
from nodes.superstepper.ramp import Pace
from sacbus.kernel import Ns
from sacbus.node import ReportKind
from sacbus.wire.superstepper import (
    FULL_SPEED,
    RAM_SIZE,
    ChangeSpeed,
    Expanded,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Rate,
    Read,
    Status,
    Stop,
    Write,
)

__all__ = ["CommandProcessor", "Owner"]


class Owner(Protocol):
    """The node behind it."""

    def tell(self, kind: ReportKind, text: str) -> None:
        """Something worth a report."""
        ...

    def eeprom_written(self) -> None:
        """Its EEPROM has changed."""
        ...


class _Move(NamedTuple):
    """The move that runs, or has run out.

    ``steps``: None: for ever. ``since``: what the engine had counted as its own first step came.
    """

    command: MoveAtSpeed | MoveSteps
    value: int
    steps: int | None
    since: int

    @property
    def divider(self) -> int:
        return self.command.rate.divider

    @property
    def sign(self) -> int:
        return 1 if self.command.clockwise else -1


class CommandProcessor:
    """Obeys messages; everything happens at the time that is given."""

    __slots__ = (
        "_eeprom",
        "_home_complete",
        "_move",
        "_off_after",
        "_owner",
        "_ram",
        "_run_from",
        "_stored_speed",
        "enabled",
        "engine",
        "home",
    )

    def __init__(self, engine: Engine, eeprom: Eeprom, owner: Owner) -> None:
        """Power has come."""
        self.engine = engine
        self._owner = owner
        self._eeprom = eeprom
        self._ram = Ram(eeprom.profile)
        #: Level of the home sensor's input: pulled up.
        self.home = 1
        #: Whether the driver's current flows.
        self.enabled = True
        #: Whether it is switched off once the motor has come to its stop.
        self._off_after = False
        self._move: _Move | None = None
        self._home_complete = False
        #: What opcode 2 left at rest, for the next opcode 0.
        self._stored_speed: int | None = None
        #: What the engine had counted as the present move began.
        self._run_from = 0

    @property
    def command(self) -> MoveAtSpeed | MoveSteps | None:
        """The move that runs or has run out; None when it was stopped, or none came."""
        return None if self._move is None else self._move.command

    @property
    def microsteps(self) -> Microsteps:
        """The present microsteps and decay mode."""
        return self._ram.microsteps

    def status(self, now: Ns) -> Status:
        """The status register."""
        state = self.engine.state(now)
        running = self.engine.running(now) is not None
        return Status(running, self._home_complete, state in (ACCEL, DECEL))

    def steps_run(self, now: Ns) -> int:
        """Steps since the last move began, modulo 65 536."""
        return (self.engine.steps(now) - self._run_from) % 0x1_0000

    def execute(self, message: Message, now: Ns) -> int:
        """Do it; the data of the answer."""
        match message:
            case MoveAtSpeed():
                self._move_at_speed(message, now)
            case MoveSteps():
                self._move_steps(message, now)
            case ChangeSpeed(speed):
                self._change_speed(speed, now)
            case Microsteps():
                self._set_microsteps(message, now)
            case Stop():
                self._stop(message, now)
            case Write():
                self._write(message, now)
            case Read():
                return self._read(message, now)
            case Expanded():
                pass
            case _:
                assert_never(message)
        return 0

    def wake(self, now: Ns) -> None:
        """A motion may be over."""
        self.engine.finish(now)
        if self._off_after and self.engine.running(now) is None:
            self._off_after = False
            self.enabled = False

    def emergency(self, now: Ns) -> None:
        """No step follows; the driver's current stays as it is, or as it was to be in the end."""
        self.enabled &= not self._off_after
        self._off_after = False
        self._halt(now)

    def home_falls(self, now: Ns) -> None:
        """The home sensor's input has fallen."""
        move = self._move
        homes = move is not None and isinstance(move.command, MoveSteps) and move.command.home
        if homes and self.engine.running(now) is not None:
            self.engine.cut(now)
            self._home_complete = True

    # ---- moves ----

    def _profile(self) -> Profile:
        ram = self._ram
        return Profile(ram.start or FULL_SPEED, Pace.of(ram.rate, ram.time_base))

    def _begin(self, command: MoveAtSpeed | MoveSteps, now: Ns) -> bool:
        """What every move begins with; False where the motor does not move by that rate."""
        self._home_complete = False
        self._off_after = False
        self.enabled = True
        self._run_from = self.engine.steps(now)
        if command.rate is Rate.NONE:
            self._halt(now)
            self._owner.tell(
                ReportKind.WARNING, "rate 3 divides the timer by nothing: the motor does not move"
            )
            return False
        return True

    def _move_at_speed(self, command: MoveAtSpeed, now: Ns) -> None:
        stored, self._stored_speed = self._stored_speed, None
        if self._begin(command, now):
            value = stored or command.speed or FULL_SPEED
            self._go(_Move(command, value, None, 0), now)

    def _move_steps(self, command: MoveSteps, now: Ns) -> None:
        if not self._begin(command, now):
            return
        if command.steps:
            self._go(_Move(command, command.speed or FULL_SPEED, command.steps, 0), now)
        else:
            self._halt(now)

    def _change_speed(self, speed: int, now: Ns) -> None:
        """Of the move that runs; at rest, or on the way to a stop, it is kept for later."""
        value = speed or FULL_SPEED
        move = self._move
        if move is None or self.engine.running(now) is None:
            self._stored_speed = value
            return
        steps = move.steps
        if steps is not None:
            steps -= max(self._begun(now) - move.since, 0)
        self._go(move._replace(value=value, steps=steps), now, ramps=True)

    def _begun(self, now: Ns) -> int:
        """Steps that were ever issued, and that of the period that runs."""
        engine = self.engine
        running = engine.running(now)
        return engine.steps(now) + int(running is not None and not engine.clk(now))

    def _go(self, move: _Move, now: Ns, *, ramps: bool = False) -> None:
        """``ramps``: whatever its accelerate bit says."""
        profile = self._profile()
        command = move.command
        least = command.rate.least
        if move.value < least:
            self._owner.tell(
                ReportKind.WARNING, f"speed {move.value} is below the {least} that its rate allows"
            )
        before = 0

        def plan(entry: Entry | None) -> Sequence[Stretch]:
            nonlocal before
            if entry is not None and entry.sign != move.sign:
                before = sum(one.periods or 0 for one in brake(entry, profile))
            how = entry, move.value, move.divider, move.sign, profile
            if move.steps is not None:
                return steps_plan(*how, move.steps)
            ramped = ramps or (isinstance(command, MoveAtSpeed) and command.accelerate)
            return speed_plan(*how, ramps=ramped)

        begun = self._begun(now)
        self.engine.go(plan, now)
        self._move = move._replace(since=begun + before)

    def _halt(self, now: Ns) -> None:
        """No step follows."""
        self.engine.finish(now)
        self.engine.cut(now)
        self._move = None

    def _stop(self, message: Stop, now: Ns) -> None:
        self.enabled = message.enabled
        self._off_after = False
        if not message.decelerate:
            self._halt(now)
        elif self.engine.running(now) is not None:
            self._off_after = not message.enabled
            self.enabled = True
            profile = self._profile()

            def plan(entry: Entry | None) -> Sequence[Stretch]:
                return [] if entry is None else brake(entry, profile)

            self.engine.go(plan, now)
            self._move = None

    # ---- microsteps and memories ----

    def _set_microsteps(self, wanted: Microsteps, now: Ns) -> None:
        self._ram.set_microsteps(wanted)
        self._use_microsteps(now)

    def _use_microsteps(self, now: Ns) -> None:
        self.engine.set_unit(EIGHTHS >> self._ram.microsteps.exponent, now)

    def _read(self, message: Read, now: Ns) -> int:
        if message.eeprom:
            return self._eeprom.bytes[message.address]
        status, run = self.status(now).byte, self.steps_run(now)
        first = self._ram.read(message.address, status, run)
        if not message.word:
            return first
        return first << 8 | self._ram.read(message.address + 1, status, run)

    def _write(self, message: Write, now: Ns) -> None:
        if message.eeprom:
            if self._eeprom.write(message.address, message.data):
                self._owner.eeprom_written()
        elif not self._ram.write(message.address, message.data):
            self._owner.tell(
                ReportKind.IGNORED, f"a write to RAM 0x{message.address:02x}, which takes none"
            )
        elif message.address % RAM_SIZE == MS_DECAY:
            self._use_microsteps(now)
