"""The Super Stepper Bus: the master's messages and the modules' answers, as bytes and as values.

Owns the header, the operands of the eight opcodes, the acknowledge and its checksum, and every
place of a bit, in one table. Figures are missing from the manual's text, so the places marked [D]
there are decisions. Both directions of the bus have wires of their own, so messages and answers are
never mixed up, though nothing in the bytes tells them apart.

Source: SS-MST67 manual, Tables 1 to 5; spec, superstepper.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from operator import index
from typing import Final, NamedTuple, assert_never

__all__ = [
    "ADDRESSES",
    "ANSWER_SIZE",
    "EEPROM_SIZE",
    "FULL_SPEED",
    "RAM_SIZE",
    "SIZES",
    "Answer",
    "ChangeSpeed",
    "Decay",
    "Expanded",
    "Message",
    "Microsteps",
    "MoveAtSpeed",
    "MoveSteps",
    "Opcode",
    "Rate",
    "Read",
    "Status",
    "Stop",
    "Write",
    "address_of",
    "decode",
    "decode_answer",
    "decode_status",
    "describe",
    "encode",
    "encode_answer",
    "opcode_of",
    "patience",
]

#: Five bits of address.
ADDRESSES: Final = range(32)

#: Bytes of an acknowledge, positive or negative.
ANSWER_SIZE: Final = 5

RAM_SIZE: Final = 0x20
EEPROM_SIZE: Final = 0x100

#: What a speed of 0 acts as: the timer counts 16 bits down (spec, [D]).
FULL_SPEED: Final = 0x1_0000


class Opcode(IntEnum):
    """Table 1."""

    MOVE_AT_SPEED = 0
    MOVE_STEPS = 1
    CHANGE_SPEED = 2
    MICROSTEPS = 3
    STOP = 4
    EXPANDED = 5
    WRITE = 6
    READ = 7


#: Bytes of a message by its opcode, the header included (Table 1; 5, "RS": [D]).
SIZES: Final = (4, 6, 3, 2, 2, 1, 4, 3)


class Rate(IntEnum):
    """R1 R0: what divides the timer (Table 2)."""

    FAST = 0
    MEDIUM = 1
    SLOW = 2
    NONE = 3

    @property
    def divider(self) -> int:
        """1, 8 or 64; 0: the motor does not move."""
        return (1, 8, 64, 0)[self]

    @property
    def least(self) -> int:
        """The smallest speed value that the manual allows: the fastest motion (Table 2)."""
        return (100, 20, 2, 0)[self]


class Decay(IntEnum):
    """DM1 DM0 (Table 3); 1 and 2 are both mixed."""

    FAST = 0
    MIXED = 1
    MIXED_TOO = 2
    SLOW = 3


class _Place(NamedTuple):
    """Some bits of a byte."""

    low: int
    width: int = 1

    def get(self, byte: int) -> int:
        return byte >> self.low & (1 << self.width) - 1

    def put(self, value: int) -> int:
        return (value & (1 << self.width) - 1) << self.low


# The table of places. Those of the header and of the address in an acknowledge are the vendor's
# published ones; all others stand in figures that the text lacks: [D].
_HEADER_OPCODE: Final = _Place(0, 3)
_HEADER_ADDRESS: Final = _Place(3, 5)
_DIR_RATE: Final = _Place(0, 2)  # [D] Dir/Rate, R1:R0
_DIR_CLOCKWISE: Final = _Place(2)  # [D] Dir/Rate, D
_DIR_ACCELERATE: Final = _Place(3)  # [D] Dir/Rate of opcode 0, A
_DIR_HOME: Final = _Place(3)  # [D] Home/Dir/Rate of opcode 1, H
_MS_DEGREES: Final = _Place(0, 2)  # [D] MSDeg/Decay, MS1:MS0
_MS_DECAY: Final = _Place(2, 2)  # [D] MSDeg/Decay, DM1:DM0
_STOP_ENABLE: Final = _Place(0)  # [D] Decel EN/DIS
_STOP_DECELERATE: Final = _Place(1)  # [D] Decel EN/DIS
_MEM_EEPROM: Final = _Place(0)  # [D] MemSel, R*/E
_MEM_WORD: Final = _Place(1)  # [D] MemSel, B*/W
_STATUS_BUSY: Final = _Place(0)  # [D] status register
_STATUS_HOME: Final = _Place(1)  # [D] status register
_STATUS_CHANGING: Final = _Place(2)  # [D] status register
_ACK_ADDRESS: Final = _Place(0, 5)
_ACK_OVERRUN: Final = _Place(5)  # [D] first byte of an acknowledge, O
_ACK_FRAMING: Final = _Place(6)  # [D] first byte of an acknowledge, F
_ACK_POSITIVE: Final = _Place(7)  # first byte of an acknowledge


@dataclass(frozen=True, slots=True)
class MoveAtSpeed:
    """Opcode 0. ``speed``: half a step's ticks of the divided timer, 0 to 65 535."""

    clockwise: bool
    speed: int
    rate: Rate = Rate.FAST
    accelerate: bool = True


@dataclass(frozen=True, slots=True)
class MoveSteps:
    """Opcode 1: so many (micro)steps, or with ``home`` until the home sensor falls."""

    clockwise: bool
    speed: int
    steps: int
    rate: Rate = Rate.FAST
    home: bool = False


@dataclass(frozen=True, slots=True)
class ChangeSpeed:
    """Opcode 2."""

    speed: int


@dataclass(frozen=True, slots=True)
class Microsteps:
    """Opcode 3. ``exponent``: a step is 2**exponent microsteps, 0 to 3."""

    exponent: int
    decay: Decay = Decay.FAST

    @property
    def byte(self) -> int:
        """As it stands in RAM 5."""
        return _MS_DEGREES.put(self.exponent) | _MS_DECAY.put(self.decay)

    @classmethod
    def of(cls, byte: int) -> Microsteps:
        """What a byte says."""
        return cls(_MS_DEGREES.get(byte), Decay(_MS_DECAY.get(byte)))


@dataclass(frozen=True, slots=True)
class Stop:
    """Opcode 4. ``enabled``: the driver keeps its current."""

    decelerate: bool = True
    enabled: bool = True


@dataclass(frozen=True, slots=True)
class Expanded:
    """Opcode 5, reserved: does nothing."""


@dataclass(frozen=True, slots=True)
class Write:
    """Opcode 6: a byte into RAM or EEPROM."""

    address: int
    data: int
    eeprom: bool = False


@dataclass(frozen=True, slots=True)
class Read:
    """Opcode 7: a byte, or a word of RAM. Of EEPROM always a byte (Table 5)."""

    address: int
    eeprom: bool = False
    word: bool = False


Message = MoveAtSpeed | MoveSteps | ChangeSpeed | Microsteps | Stop | Expanded | Write | Read


@dataclass(frozen=True, slots=True)
class Answer:
    """An acknowledge. ``value``: the data read, a byte or a word; 0 of other messages.

    Not ``positive``: a time-out ended a message that had not come whole, which was not executed.
    ``framing``, ``overrun``: bytes without a stop bit, or that were lost, since the last answer.
    """

    address: int
    positive: bool = True
    value: int = 0
    framing: bool = False
    overrun: bool = False

    @property
    def flags(self) -> tuple[str, ...]:
        """What ``framing`` and ``overrun`` tell, in words."""
        told = ("framing error",) if self.framing else ()
        return (*told, "overrun") if self.overrun else told


class Status(NamedTuple):
    """RAM 6. ``home_complete``: the last move ended at the home sensor."""

    busy: bool = False
    home_complete: bool = False
    changing_speed: bool = False

    @property
    def byte(self) -> int:
        """As it stands in RAM 6."""
        return (
            _STATUS_BUSY.put(self.busy)
            | _STATUS_HOME.put(self.home_complete)
            | _STATUS_CHANGING.put(self.changing_speed)
        )


def decode_status(byte: int) -> Status:
    """What the status register says."""
    return Status(
        bool(_STATUS_BUSY.get(byte)),
        bool(_STATUS_HOME.get(byte)),
        bool(_STATUS_CHANGING.get(byte)),
    )


#: Byte times, and ns at least, after which a message that has not come whole is given up [D].
_PATIENCE_BYTES: Final = 10
_PATIENCE_NS: Final = 5_000_000


def patience(byte_ns: int) -> int:
    """Silence, in ns, that ends a message, where a byte takes ``byte_ns``."""
    return max(_PATIENCE_BYTES * byte_ns, _PATIENCE_NS)


def address_of(header: int) -> int:
    """Whom a header addresses."""
    return _HEADER_ADDRESS.get(header)


def opcode_of(header: int) -> Opcode:
    """What a header asks for."""
    return Opcode(_HEADER_OPCODE.get(header))


class _Field(NamedTuple):
    """A value of a message: where it stands there, its name for people, and what it may be."""

    key: str
    name: str
    most: int
    expected: str


def _number(key: str, most: int, name: str = "") -> _Field:
    return _Field(key, name or key, most, f"a whole number from 0 to {most}")


def _flags(*keys: str) -> tuple[_Field, ...]:
    return tuple(_Field(key, key, 1, "True or False") for key in keys)


def _member(key: str, kind: type[Rate | Decay]) -> _Field:
    members = ", ".join(str(one) for one in kind.__members__)
    return _Field(key, key, len(kind) - 1, f"a {kind.__name__} ({members})")


_ADDRESSED: Final = _number("address", ADDRESSES[-1])
_SPEED: Final = _number("speed", 0xFFFF)
_RATE: Final = _member("rate", Rate)
_MEMORY: Final = (_number("address", 0xFF, "place"), *_flags("eeprom"))

#: What is asked of a message before it is made bytes of.
_FIELDS: Final[dict[type[Message], tuple[_Field, ...]]] = {
    MoveAtSpeed: (_SPEED, _RATE, *_flags("clockwise", "accelerate")),
    MoveSteps: (_number("steps", 0xFFFF), _SPEED, _RATE, *_flags("clockwise", "home")),
    ChangeSpeed: (_SPEED,),
    Microsteps: (_number("exponent", 3), _member("decay", Decay)),
    Stop: _flags("decelerate", "enabled"),
    Expanded: (),
    Write: (*_MEMORY, _number("data", 0xFF, "byte")),
    Read: (*_MEMORY, *_flags("word")),
}


def _check(field: _Field, value: object) -> None:
    try:
        fits = 0 <= index(value) <= field.most  # type: ignore[arg-type]  # what is none is refused
    except TypeError:
        fits = False
    if not fits:
        raise ValueError(f"{field.name}: expected {field.expected}, got {value!r}")


def encode(address: int, message: Message) -> bytes:
    """The bytes of a message; ValueError, naming it, for a value that it has no room for."""
    _check(_ADDRESSED, address)
    for field in _FIELDS[type(message)]:
        _check(field, getattr(message, field.key))
    opcode, operands = _operands(message)
    header = _HEADER_ADDRESS.put(address) | _HEADER_OPCODE.put(opcode)
    return bytes((header, *operands))


def _operands(message: Message) -> tuple[Opcode, tuple[int, ...]]:
    match message:
        case MoveAtSpeed(clockwise, speed, rate, accelerate):
            how = _direction(clockwise, rate) | _DIR_ACCELERATE.put(accelerate)
            return Opcode.MOVE_AT_SPEED, (how, *_word(speed))
        case MoveSteps(clockwise, speed, steps, rate, home):
            how = _direction(clockwise, rate) | _DIR_HOME.put(home)
            return Opcode.MOVE_STEPS, (how, *_word(speed), *_word(steps))
        case ChangeSpeed(speed):
            return Opcode.CHANGE_SPEED, _word(speed)
        case Microsteps():
            return Opcode.MICROSTEPS, (message.byte,)
        case Stop(decelerate, enabled):
            how = _STOP_DECELERATE.put(decelerate) | _STOP_ENABLE.put(enabled)
            return Opcode.STOP, (how,)
        case Write(address, data, eeprom):
            return Opcode.WRITE, (_MEM_EEPROM.put(eeprom), address, data)
        case Read(address, eeprom, word):
            return Opcode.READ, (_MEM_EEPROM.put(eeprom) | _MEM_WORD.put(word), address)
        case Expanded():
            return Opcode.EXPANDED, ()
        case _:
            assert_never(message)


def _direction(clockwise: bool, rate: Rate) -> int:
    return _DIR_RATE.put(rate) | _DIR_CLOCKWISE.put(clockwise)


def _word(value: int) -> tuple[int, int]:
    return value >> 8, value & 0xFF


def decode(data: bytes) -> tuple[int, Message]:
    """Address and meaning of a whole message; ValueError where it has not its opcode's size.

    Bits that mean nothing are not looked at.
    """
    opcode = opcode_of(data[0]) if data else Opcode.EXPANDED
    if len(data) != SIZES[opcode]:
        raise ValueError(f"expected {SIZES[opcode]} bytes of a message, got {data.hex(' ')!r}")
    return address_of(data[0]), _meaning(opcode, data)


def _meaning(opcode: Opcode, data: bytes) -> Message:
    match opcode:
        case Opcode.MOVE_AT_SPEED:
            clockwise, rate = bool(_DIR_CLOCKWISE.get(data[1])), Rate(_DIR_RATE.get(data[1]))
            accelerate = bool(_DIR_ACCELERATE.get(data[1]))
            return MoveAtSpeed(clockwise, data[2] << 8 | data[3], rate, accelerate)
        case Opcode.MOVE_STEPS:
            clockwise, rate = bool(_DIR_CLOCKWISE.get(data[1])), Rate(_DIR_RATE.get(data[1]))
            steps, home = data[4] << 8 | data[5], bool(_DIR_HOME.get(data[1]))
            return MoveSteps(clockwise, data[2] << 8 | data[3], steps, rate, home)
        case Opcode.CHANGE_SPEED:
            return ChangeSpeed(data[1] << 8 | data[2])
        case Opcode.MICROSTEPS:
            return Microsteps.of(data[1])
        case Opcode.STOP:
            return Stop(bool(_STOP_DECELERATE.get(data[1])), bool(_STOP_ENABLE.get(data[1])))
        case Opcode.WRITE:
            return Write(data[2], data[3], bool(_MEM_EEPROM.get(data[1])))
        case Opcode.READ:
            eeprom, word = bool(_MEM_EEPROM.get(data[1])), bool(_MEM_WORD.get(data[1]))
            return Read(data[2], eeprom, word)
        case Opcode.EXPANDED:
            return Expanded()
        case _:
            assert_never(opcode)


def encode_answer(answer: Answer) -> bytes:
    """The five bytes of an acknowledge, checksum included."""
    first = (
        _ACK_POSITIVE.put(answer.positive)
        | _ACK_FRAMING.put(answer.framing)
        | _ACK_OVERRUN.put(answer.overrun)
        | _ACK_ADDRESS.put(answer.address)
    )
    body = bytes((first, 0, answer.value >> 8 & 0xFF, answer.value & 0xFF))
    return body + bytes((sum(body) & 0xFF,))


def decode_answer(data: bytes) -> Answer | None:
    """An acknowledge from its five bytes; None where the checksum is wrong, or the size."""
    if len(data) != ANSWER_SIZE or sum(data[:4]) & 0xFF != data[4]:
        return None
    return Answer(
        _ACK_ADDRESS.get(data[0]),
        bool(_ACK_POSITIVE.get(data[0])),
        data[2] << 8 | data[3],
        bool(_ACK_FRAMING.get(data[0])),
        bool(_ACK_OVERRUN.get(data[0])),
    )


_RATES: Final = {Rate.FAST: "", Rate.MEDIUM: " / 8", Rate.SLOW: " / 64"}
_WAYS: Final = {True: "clockwise", False: "counterclockwise"}


def describe(message: Message) -> str:
    """What a message asks for, in words."""
    match message:
        case MoveAtSpeed(clockwise, speed, rate, accelerate):
            ramp = "" if accelerate else ", at once"
            return f"move {_WAYS[clockwise]} at {_speed(speed, rate)}{ramp}"
        case MoveSteps(clockwise, speed, steps, rate, home):
            until = ", or until home falls" if home else ""
            noun = "step" if steps == 1 else "steps"
            return f"move {steps} {noun} {_WAYS[clockwise]} at {_speed(speed, rate)}{until}"
        case ChangeSpeed(speed):
            return f"change the speed to {speed or FULL_SPEED}"
        case Microsteps(exponent, decay):
            mode = "mixed" if decay in (Decay.MIXED, Decay.MIXED_TOO) else decay.name.lower()
            return f"{('full', 'half', 'quad', 'eight')[exponent]} steps, {mode} decay"
        case Stop(decelerate, enabled):
            how = "decelerate and stop" if decelerate else "stop at once"
            return how if enabled else f"{how}, driver off"
        case Expanded():
            return "reserved"
        case Write(address, data, eeprom):
            return f"write 0x{data:02x} to {_place(address, eeprom)}"
        case Read(address, eeprom, word):
            size = "word" if word and not eeprom else "byte"
            return f"read the {size} at {_place(address, eeprom)}"
        case _:
            assert_never(message)


def _speed(speed: int, rate: Rate) -> str:
    if rate is Rate.NONE:
        return "no rate"
    return f"speed {speed or FULL_SPEED}{_RATES[rate]}"


def _place(address: int, eeprom: bool) -> str:
    return f"{'EEPROM' if eeprom else 'RAM'} 0x{address:02x}"
