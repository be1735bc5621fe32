"""What is said to an SS-MST67 in words: ``3 move-steps 1600 --speed 2500`` to a message.

Owns the one table of commands, with their operands and options, that ``sacbus ss`` and scenarios
go by, the reading of a line by it, and what an answer to each command says. A line is what stands
behind LINK in ``sacbus ss``: an address and a command, apart by spaces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

from sacbus.language.line import quoted
from sacbus.mother.errors import BadRequest
from sacbus.wire.superstepper import (
    ADDRESSES,
    Answer,
    ChangeSpeed,
    Decay,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Rate,
    Read,
    Stop,
    Write,
    decode_status,
)

__all__ = ["COMMANDS", "Command", "Meaning", "Order", "Word", "is_negative", "meaning", "read_line"]

#: Lines that are kept as read: who polls says the same to each module again and again.
LINES: Final = 1_024

_BYTE: Final = 0xFF
_WORD: Final = 0xFFFF


@dataclass(frozen=True, slots=True)
class Word:
    """An operand or an option of a command: a number up to ``most``, or one of ``choices``.

    Neither: a flag. ``default`` None: it must be given, if it is no flag. ``below``: what is said
    of a number below 0, which may have been meant for the other direction.
    """

    name: str
    meaning: str = ""
    most: int | None = None
    choices: tuple[str, ...] = ()
    default: int | str | None = None
    below: str = ""

    @property
    def key(self) -> str:
        """As an argument is called."""
        return self.name.lstrip("-").replace("-", "_")

    @property
    def flag(self) -> bool:
        """Whether it has no value."""
        return self.most is None and not self.choices

    @property
    def expected(self) -> str:
        """What it takes, in words."""
        if self.choices:
            return f"{', '.join(self.choices[:-1])} or {self.choices[-1]}"
        return f"a number from 0 to {self.most}"

    def read(self, text: str) -> int | str:
        """A value; ValueError, with what is expected, for another. Numbers may be ``0x1f``."""
        if self.choices:
            if text in self.choices:
                return text
        elif self.most is not None:
            try:
                number = int(text, 0)
            except ValueError:
                number = -1
            if 0 <= number <= self.most:
                return number
        more = f": {self.below}" if self.below and is_negative(text) else ""
        raise ValueError(f"expected {self.expected}, got {quoted(text)}{more}")


def is_negative(word: str) -> bool:
    """Whether it is a number below 0, and so no option."""
    return word.startswith("-") and word[1:].isdecimal()


class Meaning(NamedTuple):
    """What an answer says: in words, and for programs by name.

    ``mere``: it says that the module has the message, and no more.
    """

    words: str
    fields: Mapping[str, object]
    mere: bool = False


@dataclass(frozen=True, slots=True)
class Command:
    """A command: its name, what it does, its operands and options, and the message it is.

    ``message`` takes the values by their keys; ValueError for those that do not go together.
    """

    name: str
    summary: str
    message: Callable[..., Message]
    operands: tuple[Word, ...] = ()
    options: tuple[Word, ...] = ()
    meaning: Callable[[Answer], Meaning] = lambda _answer: Meaning("ACK", {}, mere=True)


def _move_at_speed(speed: int, rate: str, ccw: bool, at_once: bool) -> Message:
    return MoveAtSpeed(not ccw, speed, Rate[rate.upper()], not at_once)


def _move_steps(steps: int, speed: int, rate: str, ccw: bool) -> Message:
    return MoveSteps(not ccw, speed, steps, Rate[rate.upper()])


def _home(speed: int, rate: str, cw: bool, most: int) -> Message:
    return MoveSteps(cw, speed, most, Rate[rate.upper()], home=True)


def _microsteps(per_step: str, decay: str) -> Message:
    return Microsteps(int(per_step).bit_length() - 1, Decay[decay.upper()])


def _stop(at_once: bool, off: bool) -> Message:
    return Stop(not at_once, not off)


def _read(place: int, word: bool, eeprom: bool) -> Message:
    if word and eeprom:
        raise ValueError("a word is read of RAM alone, leave --word or --eeprom out")
    return Read(place, eeprom, word)


def _write(place: int, byte: int, eeprom: bool) -> Message:
    return Write(place, byte, eeprom)


def _value(answer: Answer) -> Meaning:
    return Meaning(f"{answer.value} (0x{answer.value:02x})", {})


def _status(answer: Answer) -> Meaning:
    fields = decode_status(answer.value)._asdict()
    words = ", ".join(name.replace("_", " ") for name, on in fields.items() if on)
    return Meaning(words or "at rest", {"status": fields})


_SPEED: Final = Word("--speed", "Half a step's ticks of 250 ns: larger is slower.", _WORD)
_RATE: Final = Word("--rate", "/ 1, / 8, / 64.", choices=("fast", "medium", "slow"), default="fast")
_CCW: Final = Word("--ccw", "Counterclockwise.")
_OTHER_WAY: Final = f"{_CCW.name} turns the other way"

#: All commands, by name; those that move first.
COMMANDS: Final[Mapping[str, Command]] = {
    one.name: one
    for one in (
        Command(
            "move-at-speed",
            "Move until something else is said.",
            _move_at_speed,
            (Word("speed", most=_WORD, below=f"a speed has no sign, {_OTHER_WAY}"),),
            (_RATE, _CCW, Word("--at-once", "Without acceleration.")),
        ),
        Command(
            "move-steps",
            "Move a number of (micro)steps.",
            _move_steps,
            (Word("steps", most=_WORD, below=f"steps count up, {_OTHER_WAY}"),),
            (_SPEED, _RATE, _CCW),
        ),
        Command(
            "home",
            "Move until the home sensor falls.",
            _home,
            (),
            (
                _SPEED,
                _RATE,
                Word("--cw", "Clockwise."),
                Word("--most", "Steps at most.", _WORD, default=_WORD),
            ),
        ),
        Command(
            "change-speed",
            "Change the speed of the move that runs.",
            ChangeSpeed,
            (Word("speed", most=_WORD),),
        ),
        Command(
            "microsteps",
            "Set the microsteps per step, and the decay mode.",
            _microsteps,
            (Word("per-step", choices=("1", "2", "4", "8")),),
            (Word("--decay", "", choices=("fast", "mixed", "slow"), default="fast"),),
        ),
        Command(
            "stop",
            "Stop the motor.",
            _stop,
            (),
            (
                Word("--at-once", "Without deceleration."),
                Word("--off", "Then take the driver's current off."),
            ),
        ),
        Command(
            "read",
            "Read a byte or a word at PLACE of the module's memory.",
            _read,
            (Word("place", most=_BYTE),),
            (
                Word("--word", "The byte there, and the next one, of RAM."),
                Word("--eeprom", "Of the EEPROM."),
            ),
            _value,
        ),
        Command(
            "write",
            "Write BYTE to PLACE of the module's memory.",
            _write,
            (Word("place", most=_BYTE), Word("byte", most=_BYTE)),
            (Word("--eeprom", "Into the EEPROM."),),
        ),
        Command(
            "status",
            "Read the status register.",
            lambda: Read(6),
            meaning=_status,
        ),
        Command(
            "steps-run",
            "Read how many steps the last move has run, modulo 65536.",
            lambda: Read(7, word=True),
            meaning=lambda answer: Meaning(f"{answer.value} steps", {}),
        ),
    )
}


class Order(NamedTuple):
    """A line, read: whom it is for, the words of its command, and what they come to."""

    address: int
    text: str
    command: Command
    message: Message


def meaning(command: Command, answer: Answer) -> Meaning:
    """What an answer says, with what the module has seen of the line."""
    said = command.meaning(answer)
    if not answer.flags:
        return said
    return Meaning(f"{said.words} (it has seen: {', '.join(answer.flags)})", said.fields)


@lru_cache(LINES)
def read_line(line: str) -> Order:
    """A line by the table; BadRequest, naming what is expected, for a wrong one."""
    first, *words = line.split() or [""]
    try:
        address = _address(first)
        name = words[0] if words else ""
        if name not in COMMANDS:
            got = quoted(name) if words else "none"
            raise ValueError(f"expected a command ({', '.join(COMMANDS)}), got {got}")
        command = COMMANDS[name]
        message = command.message(**_values(command, words[1:]))
    except ValueError as fault:
        raise BadRequest(f"line {quoted(line)}: {fault}") from fault
    return Order(address, " ".join(words), command, message)


def _address(text: str) -> int:
    if text.isascii() and text.isdecimal() and len(text) <= 9 and int(text) in ADDRESSES:
        return int(text)
    raise ValueError(
        f"expected an address from 0 to {ADDRESSES[-1]} and a command, as in 3 stop, "
        f"got {quoted(text)}"
    )


def _values(command: Command, words: Sequence[str]) -> dict[str, Any]:
    """The values of a command by their keys; ``Any``: of as many types as there are words."""
    options = {one.name: one for one in command.options}
    values: dict[str, Any] = {
        one.key: False if one.flag else one.default for one in command.options
    }
    operands = []
    left = iter(words)
    for given in left:
        if not given.startswith("-") or is_negative(given):
            operands.append(given)
            continue
        name, equals, value = given.partition("=")
        option = options.get(name)
        if option is None:
            known = ", ".join(options) or "no options"
            raise ValueError(f"{command.name}: expected {known}, got {quoted(given)}")
        if option.flag:
            if equals:
                raise ValueError(f"{name}: expected no value, got {quoted(value)}")
            values[option.key] = True
            continue
        text = value if equals else next(left, None)
        if text is None:
            raise ValueError(f"{name}: expected {option.expected}, got nothing")
        values[option.key] = _read_value(option, text)
    wanted = command.operands
    if len(operands) != len(wanted):
        names = " and ".join(one.name.upper() for one in wanted) or "nothing"
        got = " ".join(operands)
        raise ValueError(
            f"expected {names} behind {command.name}, got {quoted(got) if got else 'nothing'}"
        )
    values |= {one.key: _read_value(one, text) for one, text in zip(wanted, operands, strict=True)}
    for option in command.options:
        if values[option.key] is None:
            raise ValueError(f"expected {option.name} with {option.expected}, got none")
    return values


def _read_value(word: Word, text: str) -> int | str:
    try:
        return word.read(text)
    except ValueError as fault:
        raise ValueError(f"{word.name}: {fault}") from fault
