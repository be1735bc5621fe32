"""Lines of the system: what follows a dollar, and the lines of the configure screen.

Owns the reading of these, with the values of persistent parameters and what becomes of wrong ones.
Case counts everywhere here. Source: manual, "Configure", "System Commands", "Miscellaneous",
Appendix C; spec, "System commands".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, assert_never

from sacbus.language.commands import (
    BARE,
    Beyond,
    Command,
    Configure,
    MapPins,
    Parameter,
    Ramp,
    Reboot,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    ShowMemory,
    StepMode,
    ToggleEncoder,
    ToggleStepMode,
)
from sacbus.language.line import DIGITS, NOTHING, Line, end_of, low_byte, short
from sacbus.language.readers.reader import Reader, alone

__all__ = ["SYSTEM_LETTERS", "read_parameter", "read_system"]

_BY_LETTER: Final = {parameter.letter: parameter for parameter in Parameter}
_UNUSED: Final = ("D", "l")
"""Letters that stand on the configure screen, or could, without a parameter."""

_PINS: Final = "U"
"""The letter of the hidden pin map; it takes two digits instead of a value."""

_RESERVED_IDS: Final = 3
"""0 is the general call, 1 mother, 2 and 3 frame packets (manual, "d_id")."""

_AVOIDED_BAUDS: Final = (57_600, 115_200, 230_400)
"""Manual, "sw": they "should always be avoided"."""

_SOFTWARE_BAUD: Final = 38_400
"""Manual, "RS485": the software port should not exceed this."""


def read_system(line: Line, at: int) -> Command | None:
    """A dollar."""
    letter = line.word[at : at + 1]
    reader = SYSTEM_LETTERS.get(letter)
    if reader is not None:
        return reader(line, at + 1)
    if letter.swapcase() in SYSTEM_LETTERS:
        line.refuse(at, f"{letter.swapcase()}: case counts after a dollar")
    else:
        line.refuse(at, f"one of {' '.join(SYSTEM_LETTERS)} after a dollar")
    return None


def _configure(line: Line, at: int) -> Command | None:
    return Configure() if at == len(line.word) else read_parameter(line, at)


def _unless_zero(command: Callable[[bool], Command]) -> Reader:
    """Reader of a setting that only an explicit zero switches off."""

    def read(line: Line, at: int) -> Command | None:
        after = end_of(DIGITS, line.word, at)
        if not line.ends(after):
            return None
        if after > at:
            line.stands("on", at)
        return command(after == at or bool(line.word[at:].strip("0")))

    return read


def _zero_or_one(expected: str, field: str, command: Callable[[bool], Command]) -> Reader:
    """Reader of a setting that is switched by 0 and 1 alone."""

    def read(line: Line, at: int) -> Command | None:
        flag = line.word[at : at + 1]
        if flag not in ("0", "1"):
            line.refuse(at, expected)
            return None
        if not line.ends(at + 1):
            return None
        line.stands(field, at)
        return command(flag == "1")

    return read


SYSTEM_LETTERS: Final[Mapping[str, Reader]] = {
    "C": _configure,
    "E": alone(ShowMemory()),
    "F": alone(StepMode(full_step=True)),
    "H": _unless_zero(SendCrcs),
    "K": _unless_zero(SendAcks),
    "L": _zero_or_one("0 (harmonic) or 1 (linear) after $L", "linear", Ramp),
    "O": _zero_or_one("0 (off) or 1 (on) after $O", "on", SendSoftOps),
    "P": alone(StepMode(full_step=False)),
    "R": alone(Reboot()),
    "U": alone(ToggleStepMode()),
    "n": alone(ToggleEncoder()),
}


def read_parameter(line: Line, at: int) -> Command | None:
    """A parameter's letter and its value, to the end of the command."""
    letter = line.word[at : at + 1]
    if letter == _PINS:
        return _map_pins(line, at + 1)
    parameter = _BY_LETTER.get(letter)
    if parameter is None:
        expected = "the letter of a parameter (A-N but D, U, a-n but l, u)"
        if letter in _UNUSED:
            line.remark(at, expected, f"'{letter}', which has none", NOTHING)
        else:
            line.refuse(at, expected)
        return None
    line.stands("parameter", at)
    at += 1
    read = (_decimal if parameter.decimal else _whole)(line, at, parameter)
    if read is None or not line.ends(read[1]):
        return None
    value = read[0]
    if value is None:
        return None
    line.stands("value", at)
    if not value and parameter.zero is not None:
        value = parameter.zero
        line.remark(at, f"{parameter.title} of at least 1", "0", f"{value} is used")
    _warn(line, at, parameter, value)
    return SetParameter(parameter, value)


def _map_pins(line: Line, at: int) -> Command | None:
    values = []
    for index, name in enumerate(("an exponent", "the levels of the pins"), start=at):
        if line.word[index : index + 1] not in tuple("01234567"):
            line.refuse(index, f"{name}, one digit 0 to 7")
            return None
        values.append(int(line.word[index]))
    if not line.ends(at + 2):
        return None
    line.stands("exponent", at)
    line.stands("pins", at + 1)
    return MapPins(*values)


def _decimal(line: Line, at: int, parameter: Parameter) -> tuple[int | None, int] | None:
    """Value in hundredths."""
    read = line.hundredths(at, parameter.title)
    if read is None:
        return None
    value100, after = read
    if value100 is BARE:
        line.refuse(at, f"the value of {parameter.title}")
        return None
    return value100, after


def _whole(line: Line, at: int, parameter: Parameter) -> tuple[int | None, int] | None:
    """Value of a whole number, None where it is ignored: beyond the largest each has its way."""
    after = end_of(DIGITS, line.word, at)
    title, largest = parameter.title, parameter.largest
    if after == at:
        line.refuse(at, f"the value of {title}")
        return None
    digits = line.word[at:after].lstrip("0") or "0"
    # int() refuses strings of thousands of digits: look at the length first.
    if len(digits) <= len(str(largest)) and int(digits) <= largest:
        return int(digits), after
    value: int | None
    match parameter.beyond:
        case Beyond.ONE | Beyond.LARGEST:
            value = largest
        case Beyond.LOW_BITS:
            value = low_byte(digits)
        case Beyond.IGNORED:
            value = None
        case _:
            assert_never(parameter.beyond)
    consequence = "the value is ignored" if value is None else f"{value} is used"
    line.remark(at, f"{title}, at most {largest}", short(digits), consequence)
    return value, after


def _warn(line: Line, at: int, parameter: Parameter, value: int) -> None:
    """Remark on what is stored all the same, though the manual advises against it."""
    expected = None
    if parameter is Parameter.D_ID and value <= _RESERVED_IDS:
        expected = "d_id from 4: 0 to 3 have other uses in packets"
    elif parameter is Parameter.SW and value > _SOFTWARE_BAUD:
        expected = f"sw of at most {_SOFTWARE_BAUD}, which is what a software port can do"
    elif parameter is Parameter.HW and value in _AVOIDED_BAUDS:
        expected = "hw of a rate that the device's clock can make"
    if expected is not None:
        line.remark(at, expected, str(value), "it is stored as it is")
