"""Every key that a configuration may hold: what it takes, what it is when left out, what it means.

Owns the whole vocabulary but for the settings of a kind, which come from the kind itself. The page
docs/configuration.md and examples/workshop.toml are held against these tables by tests.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from sacbus.config.notation import HIGHEST_ADDRESS, LOOPBACK, LOWEST_ADDRESS, quoted
from sacbus.daemon import FASTEST, SLOWEST
from sacbus.links.places import LATENCY_US
from sacbus.node import NodeSettings, misfits, setting_list

__all__ = ["ANY_LINK", "BUS", "LINKS", "NODE", "TOP", "Key", "setting_keys", "shown"]

#: The slowest rate that serial ports know is 300; 4 000 000 is the fastest that Linux sets.
LOWEST_BAUD: Final = 300
HIGHEST_BAUD: Final = 4_000_000

#: TOML's whole numbers have 64 bits.
_LARGEST: Final = (1 << 63) - 1

#: Arrays of so many values are shown as they stand.
_SHORT: Final = 3

#: A second of silence before a program's bytes go out is more than any adapter adds.
MOST_LATENCY_US: Final = 1_000_000

#: Characters that one system or another refuses in the name of a directory.
_NOT_IN_NAMES: Final = frozenset('/\\:*?"<>|')


@dataclass(frozen=True, slots=True)
class Key:
    """A key: ``allowed`` says in words what ``fits`` decides.

    ``default`` is its value when it is left out; where that is None, ``otherwise`` says in words
    what happens then. ``choices`` are the words it takes, if it takes words.
    """

    name: str
    allowed: str
    fits: Callable[[object], bool]
    help: str
    default: object = None
    otherwise: str = ""
    choices: tuple[str, ...] = ()
    required: bool = False


def shown(value: object) -> str:
    """A value as it stands in TOML, as far as one line has room for it."""
    match value:
        case bool():
            return str(value).lower()
        case int() if abs(value) > _LARGEST:
            return "a number of more than 64 bits"
        case dict():
            return "a table"
        case list() if len(value) <= _SHORT and not any(isinstance(one, list) for one in value):
            return f"[{', '.join(map(shown, value))}]"
        case list():
            return "an array"
        case str() | int() | float():
            return quoted(value)
        case _:
            return str(value)  # dates and times


def setting_keys(model: type[NodeSettings]) -> tuple[Key, ...]:
    """The settings of a kind as keys of its nodes."""
    return tuple(
        Key(one.name, one.allowed, _fits_setting(model, one.name), one.help, default=one.default)
        for one in setting_list(model)
    )


def _fits_setting(model: type[NodeSettings], name: str) -> Callable[[object], bool]:
    return lambda value: not misfits(model, {name: value})


def _flag(name: str, meaning: str, *, default: bool) -> Key:
    return Key(name, "true or false", lambda value: isinstance(value, bool), meaning, default)


def _whole(low: int, high: int) -> Callable[[object], bool]:
    def fits(value: object) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high

    return fits


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_path(value: object) -> bool:
    return isinstance(value, str) and value.isprintable() and bool(value.strip())


def _is_port(value: object) -> bool:
    return _is_path(value) and "://" not in str(value)


def _is_state(value: object) -> bool:
    return value is False or _is_path(value)


def _is_speed(value: object) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and SLOWEST <= value <= FASTEST  # not nan
    )


def _is_name(value: object) -> bool:
    """Whether a directory can have this name, on any system."""
    return (
        isinstance(value, str)
        and 0 < len(value.encode()) <= 100
        and value.isprintable()
        and value == value.strip()
        and value == unicodedata.normalize("NFC", value)
        and not _NOT_IN_NAMES.intersection(value)
        and not value.startswith((".", "-"))
        and not value.endswith(".")
    )


def _is_tables(value: object) -> bool:
    return isinstance(value, list | dict)  # what is in it is looked at for itself


def _is_listen(value: object) -> bool:
    return isinstance(value, str) or _whole(0, 65_535)(value)


TOP: Final = (
    Key(
        "state",
        "a directory, or false to keep nothing",
        _is_state,
        "where the nodes' EEPROM is kept, in a directory of each bus's name; false: in memory only",
        otherwise="your own state directory",
    ),
    Key(
        "speed",
        "a number from 0.000001 to 1000000",
        _is_speed,
        "bus seconds in a second; a real adapter needs 1",
        default=1.0,
    ),
    _flag(
        "precise",
        "be punctual to some 10 µs; costs a processor",
        default=False,
    ),
    Key("bus", "one [[bus]] at least", _is_tables, "a bus", required=True),
)

BUS: Final = (
    Key(
        "name",
        "a name that a directory can have",
        _is_name,
        "what it is called, and its directory in state; every bus its own",
        default="bus",
    ),
    Key(
        "protocol",
        "a protocol of an installed kind",
        _is_text,
        "what is spoken on the line",
        otherwise="that of its nodes; sac without nodes",
    ),
    Key(
        "baud",
        f"a whole number from {LOWEST_BAUD} to {HIGHEST_BAUD}",
        _whole(LOWEST_BAUD, HIGHEST_BAUD),
        "line rate",
        otherwise="the protocol's (38400 for sac)",
    ),
    Key(
        "lanes",
        "1 or 2",
        _whole(1, 2),
        "1: all on one pair of wires; 2: the master talks on one, the nodes on the other",
        otherwise="the protocol's (1 for sac)",
    ),
    Key(
        "seed",
        "a whole number",
        _whole(-_LARGEST - 1, _LARGEST),
        "for what overlapping bytes turn into",
        default=0,
    ),
    _flag(
        "pace",
        "false: the line may run ahead of the clock; a real adapter needs true",
        default=True,
    ),
    _flag(
        "terminals",
        "a pty for each node's terminal: PATH-10 beside the first link with a path",
        default=False,
    ),
    _flag(
        "watchdog",
        "stop nodes that move when the link of a program that has talked goes away",
        default=False,
    ),
    Key(
        "state",
        "a directory, or false to keep nothing",
        _is_state,
        "as above, for this bus",
        otherwise="the state of the whole",
    ),
    Key("nodes", "[[bus.nodes]]", _is_tables, "virtual nodes", otherwise="no nodes"),
    Key("links", "[[bus.links]]", _is_tables, "ways in", otherwise="no links"),
)

NODE: Final = (
    Key(
        "address",
        f"a whole number from {LOWEST_ADDRESS} to {HIGHEST_ADDRESS}",
        _whole(LOWEST_ADDRESS, HIGHEST_ADDRESS),
        "of one node; this or addresses",
    ),
    Key(
        "addresses",
        'addresses like "10-19,85"',
        _is_text,
        "of several nodes that are the same but for it",
    ),
    Key("kind", "an installed kind", _is_text, "see `sacbus kinds`", default="sac"),
)

_KIND: Final = Key(
    "kind",
    "pty, tcp, rfc2217 or adapter",
    lambda value: value in ("pty", "tcp", "rfc2217", "adapter"),
    "what it is",
    choices=("pty", "tcp", "rfc2217", "adapter"),
    required=True,
)
_ECHO: Final = _flag(
    "echo",
    "give a program its own bytes back, as two-wire adapters do",
    default=False,
)
_LATENCY: Final = Key(
    "latency_us",
    f"a whole number from 0 to {MOST_LATENCY_US}",
    _whole(0, MOST_LATENCY_US),
    "how long the line has been idle before a program's bytes go out, µs",
    default=LATENCY_US,
)
_LISTEN: Final = Key(
    "listen",
    'HOST:PORT or PORT, such as "127.0.0.1:7000"',
    _is_listen,
    "where to listen; a port alone is on the loopback, 0 lets the system choose",
    default=f"{LOOPBACK}:0",
)

#: The keys of a link, by its kind.
LINKS: Final = {
    "pty": (
        _KIND,
        Key(
            "path",
            "a path",
            _is_path,
            "a stable symlink to it",
            otherwise="the pty's own name",
        ),
        _ECHO,
        _LATENCY,
    ),
    "tcp": (_KIND, _LISTEN, _ECHO, _LATENCY),
    "rfc2217": (_KIND, _LISTEN, _ECHO, _LATENCY),
    "adapter": (
        _KIND,
        Key(
            "device",
            "the path of a serial port",
            _is_port,
            "of the real adapter: /dev/ttyUSB0, or COM5",
            required=True,
        ),
        _flag("rts", "RTS switches its direction", default=False),
        _flag(
            "echo",
            "it gives back what it sends; that is taken out of what it hears",
            default=False,
        ),
    ),
}

#: For a link whose kind is not known: what any of them takes.
ANY_LINK: Final = tuple(
    {
        key.name: replace(key, required=key is _KIND) for keys in LINKS.values() for key in keys
    }.values()
)
