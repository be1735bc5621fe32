"""An SS-MST67's EEPROM in words, for people.

Owns the names of its bytes and what is said about values that no module would use.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from nodes.superstepper.memory import BAUDS, Eeprom, baud_error, nominal_baud, own_baud
from sacbus.node import MemoryValue, MemoryWords

__all__ = ["memory_words"]

#: What the factory leaves there, by the names under which it is stored.
_FACTORY: Final = Eeprom(0).stored()

_NAMES: Final = {
    "baud_code": ("EEPROM 0", "SS BAUD Rate"),
    "address": ("EEPROM 1", "SS Address"),
    "rate": ("EEPROM 2:3", "Accel Decel Rate"),
    "time_base": ("EEPROM 4", "Accel Decel Time Base"),
    "starting_speed": ("EEPROM 5:6", "Starting Speed"),
}


def memory_words(memory: Mapping[str, object], address: int | None) -> MemoryWords:
    """What a node's ``persist`` gave, in words; ``address``: the configured one, if known."""
    eeprom = Eeprom(address or 0)
    remarks = eeprom.restore(memory)
    stored = eeprom.stored()
    factory = {**_FACTORY, **({} if address is None else {"address": address})}
    values = tuple(
        MemoryValue(
            key,
            name,
            str(stored[stored_as]),
            _meaning(stored_as, eeprom),
            None if stored[stored_as] == factory[stored_as] else str(factory[stored_as]),
        )
        for stored_as, (key, name) in _NAMES.items()
    )
    user = stored.get("user")
    if user is not None:
        words = "user defined, hexadecimal, from EEPROM 7 on"
        values += (MemoryValue("EEPROM 7:255", "User defined", str(user), words, "ff"),)
    if eeprom.baud_code not in BAUDS:
        remarks.append(
            f"baud code {eeprom.baud_code} is none of Table 6: it falls back to "
            f"{nominal_baud(eeprom.baud_code)} baud"
        )
    return MemoryWords(values, remarks=tuple(remarks))


def _meaning(name: str, eeprom: Eeprom) -> str:
    profile = eeprom.profile
    match name:
        case "baud_code":
            code = eeprom.baud_code
            error = baud_error(code)
            return f"{nominal_baud(code)} baud; really {own_baud(code):.1f}, {error:+.2%}"
        case "address":
            return f"answers at {eeprom.address}"
        case "rate":
            return "the speed value's change at a beat" if any(profile[:2]) else "no ramps"
        case "time_base":
            return f"a beat every {profile[2] + 1} ms"
        case _:
            return "the speed value that ramps begin at"
