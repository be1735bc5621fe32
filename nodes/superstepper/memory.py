"""The two memories of an SS-MST67: the EEPROM and the RAM map, byte by byte.

Owns which byte means what (Tables 6 to 8), what is stored of the EEPROM and in which form, and what
is made of stored values that do not fit. What the status and the steps run are is not kept here.
Source: manual, "BAUD Rate Selection", "EEPROM Memory Map", "RAM Memory Map"; spec, superstepper.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from sacbus.wire.superstepper import ADDRESSES, EEPROM_SIZE, RAM_SIZE, Microsteps

__all__ = [
    "BAUDS",
    "CRYSTAL",
    "FACTORY_BAUD",
    "FALLBACK_CODE",
    "MS_DECAY",
    "STATUS",
    "STEPS_RUN",
    "Eeprom",
    "Ram",
    "baud_error",
    "code_of",
    "nominal_baud",
    "own_baud",
]

#: Table 6: nominal rates by their codes.
BAUDS: Final[Mapping[int, int]] = {
    103: 2_400,
    51: 4_800,
    25: 9_600,
    16: 14_400,
    12: 19_200,
    8: 28_800,
    6: 38_400,
    3: 57_600,
    2: 76_800,
    1: 115_200,
}

#: Hz of the crystal that the UART divides by 16 and by the code plus 1.
CRYSTAL: Final = 4_000_000

#: The rate that JMP1 open selects, 2400 baud, and that of a code that Table 6 lacks (spec, [D]).
FALLBACK_CODE: Final = 103

#: The code that the EEPROM leaves the factory with: 9600 baud (spec, [D]).
FACTORY_BAUD: Final = 25


def nominal_baud(code: int) -> int:
    """The rate that a code stands for."""
    return BAUDS.get(code, BAUDS[FALLBACK_CODE])


def code_of(baud: int) -> int | None:
    """The code of a rate; None where Table 6 has none."""
    return next((code for code, rate in BAUDS.items() if rate == baud), None)


def own_baud(code: int) -> float:
    """The rate that the UART really has by that code, bit/s."""
    return CRYSTAL / 16 / ((code if code in BAUDS else FALLBACK_CODE) + 1)


def baud_error(code: int) -> float:
    """By how much that is wrong: 0.085 is 8.5 % too fast."""
    return own_baud(code) / nominal_baud(code) - 1


#: Where the EEPROM's bytes stand (Table 7). Words have their high byte first.
_BAUD: Final = 0
_ADDRESS: Final = 1
_RATE: Final = 2
_TIME_BASE: Final = 4
_START: Final = 5
_USER: Final = 7

#: What user bytes hold that nobody has written: an erased EEPROM's (decision).
_ERASED: Final = 0xFF


class Eeprom:
    """256 bytes. ``bytes`` is replaced at each change, so that many may share what is alike."""

    __slots__ = ("bytes",)

    def __init__(
        self,
        address: int,
        *,
        baud: int = FACTORY_BAUD,
        rate: int = 0x0100,
        time_base: int = 10,
        start: int = 32_000,
    ) -> None:
        """As it leaves the factory, but for what is given; ``address`` is the configured one."""
        head = bytes((baud, address, rate >> 8, rate & 0xFF, time_base, start >> 8, start & 0xFF))
        self.bytes = head + bytes((_ERASED,)) * (EEPROM_SIZE - _USER)

    @property
    def baud_code(self) -> int:
        """What selects the rate."""
        return self.bytes[_BAUD]

    @property
    def address(self) -> int:
        """The low five bits of what is stored (spec, [D])."""
        return self.bytes[_ADDRESS] & ADDRESSES[-1]

    @property
    def profile(self) -> bytes:
        """What is loaded into RAM 0 to 4 at power-on."""
        return self.bytes[_RATE:_USER]

    def write(self, address: int, byte: int) -> bool:
        """Put a byte there; False where it stood already."""
        if self.bytes[address] == byte:
            return False
        self.bytes = self.bytes[:address] + bytes((byte,)) + self.bytes[address + 1 :]
        return True

    # ---- in and out of the file ----

    def stored(self) -> dict[str, object]:
        """By name, as JSON has it; user bytes in hexadecimal, as far as any has been written."""
        memory = self.bytes
        stored: dict[str, object] = {
            "baud_code": memory[_BAUD],
            "address": memory[_ADDRESS],
            "rate": _word(memory, _RATE),
            "time_base": memory[_TIME_BASE],
            "starting_speed": _word(memory, _START),
        }
        user = memory[_USER:].rstrip(bytes((_ERASED,)))
        if user:
            stored["user"] = user.hex()
        return stored

    def restore(self, stored: Mapping[str, object]) -> list[str]:
        """Take what was stored; a sentence for each value that is not taken."""
        remarks = []
        memory = bytearray(self.bytes)
        for name, value in stored.items():
            place = _PLACES.get(name)
            if name == "user":
                user = _user(value)
                if user is None:
                    remarks.append(
                        f"EEPROM: user expected {EEPROM_SIZE - _USER} bytes in hexadecimal at "
                        "most; none taken"
                    )
                else:
                    memory[_USER : _USER + len(user)] = user
            elif place is None:
                remarks.append(f"EEPROM: {name!r} is not known to this version; ignored")
            else:
                at, size = place
                largest = (1 << 8 * size) - 1
                if type(value) is not int or not 0 <= value <= largest:
                    remarks.append(
                        f"EEPROM: {name} expected 0 to {largest}, got {value!r}; as configured"
                    )
                else:
                    memory[at : at + size] = value.to_bytes(size, "big")
        self.bytes = bytes(memory)
        return remarks


#: Where stored values stand, and how many bytes each has.
_PLACES: Final = {
    "baud_code": (_BAUD, 1),
    "address": (_ADDRESS, 1),
    "rate": (_RATE, 2),
    "time_base": (_TIME_BASE, 1),
    "starting_speed": (_START, 2),
}


def _user(stored: object) -> bytes | None:
    if not isinstance(stored, str):
        return None
    try:
        user = bytes.fromhex(stored)
    except ValueError:
        return None
    return user if len(user) <= EEPROM_SIZE - _USER else None


def _word(memory: bytes | bytearray, address: int) -> int:
    return memory[address] << 8 | memory[address + 1]


#: Where the RAM's bytes stand (Table 8).
MS_DECAY: Final = 5
STATUS: Final = 6
STEPS_RUN: Final = 7
_RAM_USER: Final = 9
_RESERVED: Final = 0x18


class Ram:
    """32 bytes, loaded at power-on; addresses beyond them are taken by their low bits (decision).

    Status and steps run are whoever's who counts them: a read asks for them.
    """

    __slots__ = ("_bytes",)

    def __init__(self, profile: bytes) -> None:
        """Power has come: what the EEPROM holds for it, and 0 elsewhere (decision)."""
        self._bytes = bytearray(profile) + bytes(_RESERVED - len(profile))

    @property
    def rate(self) -> int:
        """By how much the speed value changes at a beat."""
        return _word(self._bytes, 0)

    @property
    def time_base(self) -> int:
        """A beat is a ms longer than this says."""
        return self._bytes[2]

    @property
    def start(self) -> int:
        """The speed value that ramps begin at."""
        return _word(self._bytes, 3)

    @property
    def microsteps(self) -> Microsteps:
        """MSDeg/Decay."""
        return Microsteps.of(self._bytes[MS_DECAY])

    def set_microsteps(self, wanted: Microsteps) -> None:
        """As opcode 3 does."""
        self._bytes[MS_DECAY] = wanted.byte

    def read(self, address: int, status: int, steps_run: int) -> int:
        """A byte; reserved ones are 0."""
        match address % RAM_SIZE:
            case 6:
                return status
            case 7:
                return steps_run >> 8
            case 8:
                return steps_run & 0xFF
            case place if place >= _RESERVED:
                return 0
            case place:
                return self._bytes[place]

    def write(self, address: int, byte: int) -> bool:
        """Put a byte there; False where none can be put: the counted ones, and reserved ones."""
        place = address % RAM_SIZE
        if STATUS <= place < _RAM_USER or place >= _RESERVED:
            return False
        self._bytes[place] = byte
        return True
