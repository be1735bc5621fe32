"""The memory of a SAC in words, for people who read its file.

Owns what a value means and which unit it has. Source: manual, "Configure"; spec, "System commands".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from nodes.sac.memory import Memory, name_of
from sacbus.language import Parameter
from sacbus.language.commands.quantities import fixed_text
from sacbus.language.queue_file import QueueRow
from sacbus.node import MemoryTable, MemoryValue, MemoryWords

__all__ = ["memory_words"]

#: What 0, 1, 2 mean.
_CHOICES: Final[Mapping[Parameter, tuple[str, ...]]] = {
    Parameter.RAMP: ("harmonic ramps", "linear ramps"),
    Parameter.CLOCK: ("pulses by the clock at xclk", "pulses by its own oscillator"),
    Parameter.NETWORK: ("network at the software port", "network at the hardware port"),
    Parameter.CW: ("dir is low for clockwise", "dir is high for clockwise"),
    Parameter.R_ID: ("A4988", "DRV8825", "by the pin map"),
    Parameter.SOFT_OPS: ("DC1 and DC2 are not sent", "DC1 and DC2 tell of every command"),
    Parameter.ACK: ("packets are not answered", "packets are answered with ACK or NAK"),
    Parameter.CRC: ("packets are sent without a CRC", "packets are sent with a CRC"),
    Parameter.OVERRIDE: ("commands count full steps", "commands count pulses"),
}

#: The units of the others.
_UNITS: Final[Mapping[Parameter, str]] = {
    Parameter.IHD: "half microseconds taken from every period",
    Parameter.XCLK: "half microseconds added to every period",
    Parameter.PULSE: "us, the width of a pulse",
    Parameter.SLOW: "RPM",
    Parameter.D_ID: "the node's address",
    Parameter.SPRF: "full steps a revolution",
    Parameter.XFREQ: "Hz at xclk",
    Parameter.ACC: "RPM a full step",
    Parameter.DEC: "RPM a full step",
    Parameter.L_ACC: "rad/s²",
    Parameter.L_DEC: "rad/s²",
    Parameter.HW: "baud",
    Parameter.SW: "baud",
}

_COLUMNS: Final = (
    *("Q", "steps", "way", "RPM", "cycle", "ramp", "acc", "dec", "U", "sync", "T us"),
    "as a command",
)


def memory_words(stored: Mapping[str, object], address: int | None) -> MemoryWords:
    """A stored memory in words. ``address``: the configured one, which is the factory's d_id."""
    factory = Memory() if address is None else Memory(d_id=address)
    memory, remarks = factory.restored(stored)
    values = []
    for parameter in Parameter:
        at_factory = address if parameter is Parameter.D_ID else None
        at_factory = memory.factory(parameter) if at_factory is None else at_factory
        value = memory.value(parameter)
        differs = value != at_factory
        if parameter is Parameter.SW and name_of(parameter) not in stored:
            values.append(MemoryValue(parameter.letter, parameter.title, "-", "as the line", None))
            continue
        values.append(
            MemoryValue(
                parameter.letter,
                parameter.title,
                _shown(parameter, value),
                _meaning(parameter, memory),
                _shown(parameter, at_factory) if differs else None,
            )
        )
    tables = [
        MemoryTable(
            "pin map of driver 2 ($CUnx)",
            ("exponent", "microsteps", "MS3 MS2 MS1"),
            tuple(
                (str(exponent), str(1 << exponent), f"{levels:03b}")
                for exponent, levels in enumerate(memory.pins)
            ),
        )
    ]
    if memory.queue is not None:
        rows = tuple(
            _row(QueueRow(position, motion), memory)
            for position, motion in enumerate(memory.queue, start=1)
        )
        tables.append(MemoryTable("saved queue (QS)", _COLUMNS, rows))
    return MemoryWords(tuple(values), tuple(tables), tuple(remarks))


def _shown(parameter: Parameter, value: int) -> str:
    return fixed_text(value) if parameter.decimal else str(value)


def _meaning(parameter: Parameter, memory: Memory) -> str:
    value = memory.value(parameter)
    if parameter in _CHOICES:
        return _CHOICES[parameter][value]
    match parameter:
        case Parameter.AUTORUN:
            return f"loops from position 1 to {value} after a boot" if value else "no loop at boot"
        case Parameter.DIR:
            way = "clockwise" if memory.clockwise else "counter-clockwise"
            return f"{way} by default"
        case Parameter.USTEP:
            beyond = "" if memory.microstep_pins is not None else ", which its driver has not"
            return f"{1 << value} microstep{'s' if value else ''} a full step{beyond}"
        case Parameter.CYCLE:
            return f"us a full step, {memory.defaults().rpm_of(value)} RPM"
        case Parameter.OPS:
            on = "op_sa and op_sb tell of commands" if value else "op_sa and op_sb stay low"
            return f"{value:b} in binary: {on}"
        case _:
            return _UNITS[parameter]


def _row(row: QueueRow, memory: Memory) -> tuple[str, ...]:
    motion = row.motion
    return (
        str(row.position),
        f"{motion.steps or 'endless'}{' p' if motion.pulses else ''}",
        "CW" if motion.cw else "CCW",
        str(motion.rpm),
        str(motion.cycle_us),
        "linear" if motion.linear else "harmonic",
        fixed_text(motion.acc100),
        fixed_text(motion.dec100),
        str(motion.extra_pulses),
        "yes" if motion.sync else "no",
        str(motion.wait_us),
        row.move(memory.defaults()).text(),
    )
