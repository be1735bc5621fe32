"""The EEPROM of a SAC: its persistent parameters, its pin map, and the queue that was saved.

Owns what is stored, in which form, and what is made of stored values that do not fit. Parameters
bear the names of ``sacbus.language.Parameter`` in lower case; factory values and limits stand there
alone. The saved queue is stored as rows of the companion's CSV, so that people can read it.

Two parameters have a factory value of the place where the node is put: ``d_id`` is the configured
address, and the rate of the software port, which is on the line, is the line's own (decisions).
Source: manual, "Configure", "EEPROM", "ustep", "Queue".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, TypeGuard

from sacbus.language import QUEUE_LENGTH, Defaults, Motion, Parameter
from sacbus.language.queue_file import QueueRow, WrongRow, read_rows
from sacbus.motion import Drive, PullOut, Timebase

__all__ = ["BAUD", "PINS", "QUEUE", "Memory", "name_of"]

#: The rate of a line at which a SAC as it left the factory is understood.
BAUD: Final = Parameter.SW.factory

#: The names under which the pin map and the saved queue are stored.
PINS: Final = "pins"
QUEUE: Final = "queue"

#: Levels of MS3 MS2 MS1 as bits 2 to 0, by exponent, for the drivers that have a table of their
#: own: A4988 and DRV8825 (their data sheets; spec, "System commands").
_DRIVERS: Final = ((0b000, 0b001, 0b010, 0b011, 0b111), (0b000, 0b001, 0b010, 0b011, 0b100, 0b101))

#: What driver 2 starts with: exponent n at levels n, "represented internally as the exponent"
#: (manual, "ustep"; decision).
_OWN_PINS: Final = tuple(range(Parameter.USTEP.largest + 1))

#: What versions before the queue was saved called OVERRIDE, the other way round; never but 1.
_FORMER: Final = "full_step"

#: One for all nodes that are alike: what is worked out for one then serves them all.
_drive = lru_cache(maxsize=256)(Drive)
_defaults = lru_cache(maxsize=256)(Defaults)


def name_of(parameter: Parameter) -> str:
    """What a parameter is called in memory, in settings and in the file: ``d_id``."""
    return parameter.name.lower()


_BY_NAME: Final = {name_of(parameter): parameter for parameter in Parameter}


@dataclass(frozen=True, slots=True)
class Memory:
    """What an EEPROM holds; as it left the factory (``d_id``: 85, as every SAC is born).

    Flags are 0 or 1, accelerations hundredths, all else as on the configure screen. ``pins``:
    levels of MS3 MS2 MS1 by exponent, for driver 2. ``queue``: 30 commands, None: never saved.
    ``line``: what the line runs at that the node is on; it is not stored.
    """

    autorun: int = Parameter.AUTORUN.factory
    ramp: int = Parameter.RAMP.factory
    clock: int = Parameter.CLOCK.factory
    network: int = Parameter.NETWORK.factory
    cw: int = Parameter.CW.factory
    dir: int = Parameter.DIR.factory
    ihd: int = Parameter.IHD.factory
    xclk: int = Parameter.XCLK.factory
    ustep: int = Parameter.USTEP.factory
    pulse: int = Parameter.PULSE.factory
    slow: int = Parameter.SLOW.factory
    d_id: int = Parameter.D_ID.factory
    r_id: int = Parameter.R_ID.factory
    sprf: int = Parameter.SPRF.factory
    cycle: int = Parameter.CYCLE.factory
    xfreq: int = Parameter.XFREQ.factory
    acc: int = Parameter.ACC.factory
    dec: int = Parameter.DEC.factory
    l_acc: int = Parameter.L_ACC.factory
    l_dec: int = Parameter.L_DEC.factory
    ops: int = Parameter.OPS.factory
    soft_ops: int = Parameter.SOFT_OPS.factory
    ack: int = Parameter.ACK.factory
    crc: int = Parameter.CRC.factory
    hw: int = Parameter.HW.factory
    sw: int = Parameter.SW.factory
    override: int = Parameter.OVERRIDE.factory
    pins: tuple[int, ...] = _OWN_PINS
    queue: tuple[Motion, ...] | None = None
    line: int = BAUD

    # ---- single values ----

    def value(self, parameter: Parameter) -> int:
        """What is stored for a parameter."""
        value: int = getattr(self, name_of(parameter))
        return value

    def values(self) -> dict[Parameter, int]:
        """What is stored for every parameter."""
        return {parameter: self.value(parameter) for parameter in Parameter}

    def factory(self, parameter: Parameter) -> int:
        """The factory value; of the port on the line the line's rate, as long as nobody sets it."""
        return self.line if parameter is Parameter.SW else parameter.factory

    def with_values(self, values: Mapping[Parameter, int]) -> Memory:
        """With parameters set; each value must be one that its parameter takes."""
        return _set(self, values)

    def with_pins(self, exponent: int, levels: int) -> Memory:
        """With one entry of driver 2's pin map set; both 0 to 7."""
        pins = list(self.pins)
        pins[exponent] = levels
        return replace(self, pins=tuple(pins))

    def with_queue(self, rows: Sequence[Motion]) -> Memory:
        """With the 30 positions of a queue saved."""
        return replace(self, queue=tuple(rows))

    # ---- what it means to the node ----

    @property
    def clockwise(self) -> bool:
        """Whether no sign means clockwise: ``dir`` is the level that ``cw`` says is clockwise."""
        return self.dir == self.cw

    @property
    def microstep_pins(self) -> int | None:
        """Levels of MS3 MS2 MS1 (bits 2 to 0) for its microsteps; None: the driver has none such.

        Then the pins stay as they are; pulses are multiplied all the same (decision).
        """
        table = (*_DRIVERS, self.pins)[self.r_id]
        return table[self.ustep] if self.ustep < len(table) else None

    def defaults(self) -> Defaults:
        """The system defaults that a session starts from; one object for the same values."""
        return _defaults(
            cycle_us=self.cycle,
            acc100=self.acc,
            dec100=self.dec,
            linear_acc100=self.l_acc,
            linear_dec100=self.l_dec,
            linear=bool(self.ramp),
            sprf=self.sprf,
            cw=self.clockwise,
            full_step=not self.override,
        )

    def external_clock(self, hz: int) -> Timebase | None:
        """What times pulses instead of the oscillator, with ``hz`` at xclk; None: nothing does."""
        return None if self.clock else Timebase.external(self.xfreq, hz)

    def drive(
        self,
        *,
        auto_micro: bool = False,
        pull_in_rpm: int | None = None,
        pull_out: PullOut = (),
    ) -> Drive:
        """What the motion engine must know of the hardware; the same object for the same values.

        The arguments are what no memory holds: an option of the node, and its motor.
        """
        return _drive(
            sprf=self.sprf,
            slow_rpm=self.slow,
            ustep=self.ustep,
            ihd=self.ihd,
            xclk=self.xclk,
            pulse_us=self.pulse,
            pull_in_rpm=pull_in_rpm,
            auto_micro=auto_micro,
            pull_out=pull_out,
        )

    # ---- in and out of the file ----

    def stored(self) -> dict[str, object]:
        """All of it by name, JSON values, for the EEPROM's file.

        The rate on the line is left out until somebody sets it, so that a node may be put on a line
        of another rate.
        """
        memory: dict[str, object] = {
            name: self.value(parameter)
            for name, parameter in _BY_NAME.items()
            if parameter is not Parameter.SW or self.value(parameter) != self.factory(parameter)
        }
        memory[PINS] = list(self.pins)
        if self.queue is not None:
            memory[QUEUE] = [
                QueueRow(position, motion).text().strip()
                for position, motion in enumerate(self.queue, start=1)
            ]
        return memory

    def restored(self, stored: Mapping[str, object]) -> tuple[Memory, list[str]]:
        """This memory with what was stored put in; a sentence for each value not taken as is."""
        remarks: list[str] = []
        values: dict[Parameter, int] = {}
        for name, value in stored.items():
            parameter = _BY_NAME.get(name)
            if parameter is not None:
                taken, remark = _parameter(name, parameter, value)
                if taken is not None:
                    values[parameter] = taken
                if remark is not None:
                    remarks.append(remark)
            elif name not in (PINS, QUEUE, _FORMER):
                remarks.append(f"EEPROM: parameter {name!r} is not known to this version; ignored")
        memory = self.with_values(values)
        if PINS in stored:
            if _is_pin_map(stored[PINS]):
                memory = replace(memory, pins=tuple(stored[PINS]))
            else:
                remarks.append("EEPROM: pins expected 8 levels of 0 to 7; factory values used")
        if QUEUE in stored:
            queue, remark = _queue(stored[QUEUE], memory.defaults())
            memory = replace(memory, queue=queue)
            if remark is not None:
                remarks.append(remark)
        return memory, remarks


def _set(memory: Memory, values: Mapping[Parameter, int]) -> Memory:
    # Any: parameters are whole numbers all; mypy sees names, which might be any field's.
    fields: dict[str, Any] = {name_of(parameter): value for parameter, value in values.items()}
    return replace(memory, **fields)


def _parameter(name: str, parameter: Parameter, value: object) -> tuple[int | None, str | None]:
    """A stored value as it is taken, None if it is not, and what is to be said about it."""
    largest = parameter.largest
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= largest:
        expected = f"EEPROM: {name} expected 0 to {largest}, got {value!r}"
        return None, f"{expected}; factory value used"
    if value == 0 and parameter.zero is not None:
        zero = parameter.zero
        return zero, f"EEPROM: {name} is 0, which divides nothing; {zero} used"
    return value, None


def _is_pin_map(stored: object) -> TypeGuard[list[int]]:
    return (
        isinstance(stored, list)
        and len(stored) == len(_OWN_PINS)
        and all(type(levels) is int and levels in _OWN_PINS for levels in stored)
    )


def _queue(stored: object, defaults: Defaults) -> tuple[tuple[Motion, ...] | None, str | None]:
    """A saved queue, and what is wrong with one that is not taken."""
    if not isinstance(stored, list) or not all(isinstance(row, str) for row in stored):
        return None, "EEPROM: queue expected rows of text; none used"
    try:
        read = list(read_rows(stored, "the saved queue", defaults))
    except WrongRow as fault:
        return None, f"EEPROM: {fault}; no queue used"
    if [one.row.position for one in read] != list(range(1, QUEUE_LENGTH + 1)):
        return None, f"EEPROM: queue expected positions 1 to {QUEUE_LENGTH} in order; none used"
    told = [(one.row.position, remark) for one in read for remark in one.remarks]
    queue = tuple(_shared(one.row.motion) for one in read)
    if not told:
        return queue, None
    position, remark = told[0]
    more = f", and {len(told) - 1} more" if len(told) > 1 else ""
    return queue, (
        f"EEPROM: queue position {position} expected {remark.expected}, got {remark.got}; "
        f"{remark.text}{more}"
    )


@lru_cache(maxsize=256)
def _shared(motion: Motion) -> Motion:
    """One object for all positions, of all nodes, that hold the same command."""
    return motion
