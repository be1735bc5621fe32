"""The screens of a SAC's terminal: values to lines of text, as the manual shows them.

Owns the look of every screen but the queue's, which has a reader too (``sacbus.language``'s
``queue_screen``). Pure: values come in, lines without their ends go out.

Decisions where the manual is silent. Its picture of the configure screen has lost its exact
spacing; ours has fixed columns that most of its rows have to the character. The session screen has
the same columns, with one row for each default and flag, flags as 0 and 1. The EEPROM screen has
the raw values: a direction as a level of its pin, ops as a number. In debug mode it is the dump of
1024 bytes, the size of an ATmega328P's EEPROM; where each value lies is ``image``'s business.
Source: manual, "Configure", "xRef", "Session defaults", "V", "System Commands"; spec, commands.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from sacbus.language import Motion, Parameter, Session
from sacbus.language.commands.quantities import fixed_text

__all__ = [
    "EEPROM_SIZE",
    "Flags",
    "configuration",
    "dump",
    "eeprom",
    "image",
    "references",
    "session",
    "timing",
    "velocity",
]

Values = Mapping[Parameter, int]
"""A value for every parameter; accelerations in hundredths."""

_P: Final = Parameter
_LEFT: Final = (
    *(_P.AUTORUN, _P.RAMP, _P.CLOCK, None, _P.NETWORK, _P.CW, _P.DIR, _P.IHD, _P.XCLK),
    *(_P.USTEP, _P.PULSE, _P.SLOW, _P.D_ID, _P.R_ID),
)
"""The left column of the configure screen; None is D, which is not in use."""
_RIGHT: Final = (
    *(_P.SPRF, _P.CYCLE, _P.XFREQ, _P.ACC, _P.DEC, _P.L_ACC, _P.L_DEC, _P.OPS, _P.SOFT_OPS),
    *(_P.ACK, _P.CRC, None, _P.HW, _P.SW),
)
"""The right column; None is an empty place."""


# --- configure ---------------------------------------------------------------------------------


def configuration(values: Values) -> list[str]:
    """``CC`` and ``$C``: the persistent parameters, A to N and a to n."""
    lines = ["Config:"]
    for left, right in zip(_LEFT, _RIGHT, strict=True):
        line = f"D {'':13}0" if left is None else _cell(left, 13, _shown(left, values))
        if right is not None:
            line = f"{line:22}{_cell(right, 14, _shown(right, values))}"
        lines.append(line)
    return lines


def _cell(parameter: Parameter, width: int, value: object) -> str:
    return f"{parameter.letter} {parameter.title:{width}}{value}"


def _shown(parameter: Parameter, values: Values) -> str:
    value = values[parameter]
    if parameter is Parameter.DIR:
        # dir is a level of the pin, cw the level for clockwise (manual, "dir").
        return _way(cw=value == values[Parameter.CW])
    if parameter is Parameter.OPS:
        return f"{value:b}"
    return fixed_text(value) if parameter.decimal else str(value)


def _way(*, cw: bool) -> str:
    return "CW" if cw else "CCW"


# --- session -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Flags:
    """What a session has besides its defaults; source: of the last packet to this node alone."""

    gap: bool
    debug: bool
    throttle: bool
    soft_ops: bool
    ack: bool
    crc: bool
    source: int


def session(defaults: Session, flags: Flags) -> list[str]:
    """``CF``: session defaults, flags, and the encoder's mode as ``EnT`` or ``EnF``."""
    rows = (
        ("RPM", defaults.rpm),
        ("cycle", defaults.cycle_us),
        ("acc", fixed_text(defaults.acc100)),
        ("dec", fixed_text(defaults.dec100)),
        ("ramp", int(defaults.linear)),
        ("dir", _way(cw=defaults.defaults.cw)),
        ("full step", int(defaults.full_step)),
        ("GAP", int(flags.gap)),
        ("debug", int(flags.debug)),
        ("soft_ops", int(flags.soft_ops)),
        ("ACK", int(flags.ack)),
        ("CRC", int(flags.crc)),
        ("encoder", "EnT" if flags.throttle else "EnF"),
        ("source", flags.source),
    )
    return ["Session:", *(f"{title:15}{value}" for title, value in rows)]


def velocity(defaults: Session) -> list[str]:
    """``VD``: ``7 RPM  cycle 42567``."""
    return [f"{defaults.rpm} RPM  cycle {defaults.cycle_us}"]


def timing(characters: int, load_us: int) -> list[str]:
    """What debug prints after a command: how long it took to come and to be loaded, in us.

    characters: of the line, its end included, 10 bits each at the factory's baud rate. It is the
    time "taken to receive the serial input, parse the data and load it into the command buffer"
    (manual, introduction).
    """
    return [f"{characters * 10_000_000 // Parameter.HW.factory + load_us} us"]


# --- xRef --------------------------------------------------------------------------------------


def references(array: Sequence[int]) -> list[str]:
    """``XD``: the xRef array with the 0 that ends it; one that is empty is that 0 alone."""
    entries = array or (0,)
    if 0 in entries:
        entries = entries[: entries.index(0) + 1]
    return [f"x_ {index} {position}" for index, position in enumerate(entries)]


# --- EEPROM ------------------------------------------------------------------------------------

EEPROM_SIZE: Final = 1024
"""Bytes of an ATmega328P's EEPROM, the processor of the device."""
_ERASED: Final = b"\xff"

_BY_LETTER: Final = (*(one for one in _LEFT if one), *(one for one in _RIGHT if one), _P.OVERRIDE)
_ROW: Final = struct.Struct("<BIIIffBI")
"""Of a saved queue position: flags, steps, RPM, cycle, acc, dec, usteps, deltaT."""


def eeprom(values: Values, pins: Sequence[int]) -> list[str]:
    """``$E``: every parameter, hidden ones too, and the pin levels of driver 2 in binary."""
    lines = ["EEPROM:"]
    for parameter in _BY_LETTER:
        value = values[parameter]
        lines.append(_cell(parameter, 13, fixed_text(value) if parameter.decimal else value))
    lines.append(f"U {'pins':13}{' '.join(f'{levels:03b}' for levels in pins)}")
    return lines


def image(values: Values, pins: Sequence[int], queue: Iterable[Motion]) -> bytes:
    """The bytes of the EEPROM; ``queue``: as it was saved, nothing if it never was.

    Parameters A to N, a to n and u in 1, 2 or 4 bytes, the lowest first, accelerations as the
    processor's floats; then the pins of driver 2; then the queue, 26 bytes a position, whose flags
    are 1 CCW, 2 pulses, 4 linear, 8 sync. What nothing was written to is FF.
    """
    data = b"".join(_stored(parameter, values[parameter]) for parameter in _BY_LETTER)
    data += bytes(pins)
    for row in queue:
        flags = (not row.cw) + 2 * row.pulses + 4 * row.linear + 8 * row.sync
        data += _ROW.pack(
            *(flags, row.steps or 0, row.rpm, row.cycle_us, row.acc100 / 100, row.dec100 / 100),
            *(row.extra_pulses, row.wait_us),
        )
    return data.ljust(EEPROM_SIZE, _ERASED)


def _stored(parameter: Parameter, value: int) -> bytes:
    if parameter.decimal:
        return struct.pack("<f", value / 100)
    for size in (1, 2):
        if parameter.largest < 1 << 8 * size:
            return value.to_bytes(size, "little")
    return value.to_bytes(4, "little")


def dump(data: bytes) -> list[str]:
    """``$E`` in debug mode: 16 bytes a line behind the address of the first, hexadecimal."""
    return [f"{at:04X}  {data[at : at + 16].hex(' ').upper()}" for at in range(0, len(data), 16)]
