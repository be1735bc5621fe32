"""All faults by their names, and faults from names and values as a file gives them.

Owns the words for faults in scenarios and what each takes. Times are text with a unit, bytes are
text in hexadecimal.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Final

from sacbus.bus.damage import BitErrors, Delay, Drop, Duplicate, SwappedReply
from sacbus.bus.disturbers import Babble, NoiseBursts
from sacbus.bus.duration import TIME, DurationError, duration
from sacbus.bus.fault import Fault, FaultError
from sacbus.bus.hearing import Cut, Dead, Echo, LateDirection, Latency, WrongBaud
from sacbus.kernel import Ns

__all__ = ["FAULTS", "fault_from"]

#: The address of whoever is on the line without being a node.
STRANGER: Final = "stranger"

_HEX: Final = re.compile(r"[0-9a-fA-F]{2}( ?[0-9a-fA-F]{2})*")


class _Values:
    """The values that a fault was given, each of which is taken once and checked."""

    def __init__(self, key: str, given: object, main: str) -> None:
        """``main`` is the value that may stand alone."""
        self._key = key
        self._given: dict[str, object] = (
            dict(given) if isinstance(given, Mapping) else {main: given}
        )
        self._asked: list[str] = []

    def whole(self, name: str, default: int | None = None) -> int:
        value: object = self._take(name, "a whole number", default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self._wrong(name, "a whole number", value)
        return value

    def number(self, name: str) -> float:
        value = self._take(name, "a number", None)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._wrong(name, "a number", value)
        return value

    def time(self, name: str) -> Ns:
        value = self._take(name, TIME, None)
        try:
            return duration(value)
        except DurationError as wrong:
            raise self._wrong(name, wrong.expected, value) from wrong

    def address(self, name: str) -> int:
        return self._checked(name, self._take(name, "an address, 1 to 255", None))

    def addresses(self, name: str) -> frozenset[int]:
        value = self._take(name, "a list of addresses", None)
        if not isinstance(value, list | tuple) or not value:
            raise self._wrong(name, "a list of addresses", value)
        return frozenset(self._checked(name, one) for one in value)

    def node(self, name: str) -> int | None:
        """An address, or None where nothing was given or a stranger is meant."""
        value = self._take(name, "", STRANGER)
        return None if value == STRANGER else self._checked(name, value)

    def link(self, name: str) -> str | None:
        """A link's name, or None, also for ``true``: every link."""
        value = self._take(name, "", True)  # noqa: FBT003 (as a file has it)
        if value is True:
            return None
        if not isinstance(value, str):
            raise self._wrong(name, "the name of a link, or true for all of them", value)
        return value

    def bytes(self, name: str) -> bytes:
        value = self._take(name, "bytes in hexadecimal", None)
        if not isinstance(value, str) or _HEX.fullmatch(value) is None:
            raise self._wrong(name, 'bytes in hexadecimal such as "02 0a"', value)
        return bytes.fromhex(value)

    def over(self) -> None:
        """FaultError for the first value that was given and nobody asked for."""
        for name, value in self._given.items():
            if name not in self._asked:
                raise self._wrong(name, f"one of {', '.join(self._asked)}", value)

    def _take(self, name: str, expected: str, default: object) -> object:
        self._asked.append(name)
        if name in self._given:
            return self._given[name]
        if default is None:
            raise FaultError(f"{self._key}.{name}", expected, None)
        return default

    def _checked(self, name: str, address: object) -> int:
        if isinstance(address, bool) or not isinstance(address, int) or not 1 <= address <= 255:
            raise self._wrong(name, "an address, 1 to 255", address)
        return address

    def _wrong(self, name: str, expected: str, got: object) -> FaultError:
        return FaultError(f"{self._key}.{name}", expected, got)


FAULTS: Final[Mapping[str, tuple[str, Callable[[_Values], Fault]]]] = {
    "bit_errors": ("rate", lambda given: BitErrors(given.number("rate"))),
    "drop": ("rate", lambda given: Drop(given.number("rate"))),
    "duplicate": ("rate", lambda given: Duplicate(given.number("rate"))),
    "delay": ("rate", lambda given: Delay(given.number("rate"), given.time("up_to"))),
    "swapped_reply": ("rate", lambda given: SwappedReply(given.number("rate"))),
    "noise_bursts": (
        "per_second",
        lambda given: NoiseBursts(given.number("per_second"), given.whole("bytes", 3)),
    ),
    "babble": (
        "pattern",
        lambda given: Babble(given.bytes("pattern"), given.time("every"), given.node("node")),
    ),
    "dead": ("node", lambda given: Dead(given.address("node"))),
    "cut": ("beyond", lambda given: Cut(given.addresses("beyond"))),
    "wrong_baud": (
        "node",
        lambda given: WrongBaud(given.address("node"), given.whole("baud")),
    ),
    "latency": ("by", lambda given: Latency(given.time("by"), given.link("link"))),
    "late_direction": (
        "by",
        lambda given: LateDirection(given.time("by"), given.node("node"), given.link("link")),
    ),
    "echo": ("link", lambda given: Echo(given.link("link"))),
}
"""The words for faults, with the value that may stand alone and the making of each."""


def fault_from(given: Mapping[str, object]) -> Fault:
    """The fault that one name with its values says, such as ``{"bit_errors": 1e-4}``.

    Values are a table of their names, or the main one alone: ``{"delay": {"rate": 0.1, "up_to":
    "2 ms"}}``. FaultError names the key, what was expected, and what came.
    """
    if len(given) != 1:
        raise FaultError("fault", "one fault", list(given))
    ((key, values),) = given.items()
    if key not in FAULTS:
        raise FaultError(key, f"one of {', '.join(FAULTS)}", values)
    main, make = FAULTS[key]
    taken = _Values(key, values, main)
    fault = make(taken)
    taken.over()
    return fault
