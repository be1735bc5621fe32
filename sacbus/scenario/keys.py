"""Every key that a scenario may hold: what it takes, what it is when left out, what it means.

Owns the whole vocabulary but for that of buses, which is a configuration's. The page
docs/scenarios.md is held against these tables by tests.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.bus.duration import TIME
from sacbus.config.keys import Key
from sacbus.config.notation import NotationError, addresses
from sacbus.scenario.parameters import RESERVED, is_value
from sacbus.scenario.quantity import QuantityError, bounds, marked_bytes, nanoseconds

__all__ = [
    "DEEDS",
    "EXPECT",
    "EXPECTED",
    "PIN",
    "POWER",
    "QUEUE",
    "SEND",
    "STEP",
    "TOP",
    "TURN",
    "TYPE",
]

#: Steps that a scenario may have when its loops are unrolled.
MOST_STEPS: Final = 10_000

_BOUNDS: Final = 'a number, [low, high], "<= 3" or ">= 3"'
_NODES: Final = 'an address, addresses like "10-12,85", or "all"'


def _is_time(value: object) -> bool:
    try:
        nanoseconds(value)
    except QuantityError:
        return False
    return True


def _is_bounds(value: object) -> bool:
    try:
        bounds(value)
    except QuantityError:
        return False
    return True


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_name(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def _is_flag(value: object) -> bool:
    return isinstance(value, bool)


def _is_table(value: object) -> bool:
    return isinstance(value, dict)


def _is_tables(value: object) -> bool:
    return isinstance(value, list | dict)  # what is in it is looked at for itself


def _is_lines(value: object) -> bool:
    """A line that is an address alone may be a number: what ``{node}`` becomes."""
    given = value if isinstance(value, list) else [value]
    return bool(given) and all(isinstance(one, str) or _whole(0, 255)(one) for one in given)


def _is_nodes(value: object) -> bool:
    if isinstance(value, str) and value != "all":
        try:
            addresses(value)
        except NotationError:
            return False
        return True
    return value == "all" or _whole(0, 255)(value)


def _is_hex(value: object) -> bool:
    try:
        return isinstance(value, str) and bool(marked_bytes(value)[0])
    except QuantityError:
        return False


def _is_something(value: object) -> bool:
    return isinstance(value, str) and bool(value)


def _is_levels(value: object) -> bool:
    level = _whole(0, 1 << 32)
    return isinstance(value, dict) and bool(value) and all(map(level, value.values()))


def _is_parameters(value: object) -> bool:
    return isinstance(value, dict) and all(
        is_value(one) and name not in RESERVED for name, one in value.items()
    )


def _whole(low: int, high: int) -> Callable[[object], bool]:
    def fits(value: object) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high

    return fits


def _words(*words: str) -> Callable[[object], bool]:
    return lambda value: value in words


TOP: Final = (
    Key("title", "a text", _is_name, "what results are told under", otherwise="the file's name"),
    Key(
        "seed",
        "a whole number",
        _whole(-(1 << 63), (1 << 63) - 1),
        "for what is left to chance on each [[bus]] here without a seed of its own",
        default=0,
    ),
    Key(
        "end",
        TIME,
        _is_time,
        "when it ends; a step that is not over by then has failed",
        otherwise="when all steps are over",
    ),
    Key(
        "parameters",
        f"a table of numbers, texts, true and false, or lists of them; not {' or '.join(RESERVED)}",
        _is_parameters,
        "values that stand as {name} in texts; lists make a case of each combination",
        otherwise="no parameters",
    ),
    Key(
        "buses",
        "the path of a configuration",
        _is_name,
        "where its buses are, in place of [[bus]]",
        otherwise="the [[bus]] here",
    ),
    Key("bus", "[[bus]]", _is_tables, "a bus, as in a configuration", otherwise="those of buses"),
    Key("step", "one [[step]] at least", _is_tables, "what happens", required=True),
)

STEP: Final = (
    Key("name", "a text", _is_name, "what other steps call it, and failures are told under"),
    Key(
        "at",
        TIME,
        _is_time,
        "when it begins, from the beginning on",
        otherwise="when the step above it is over",
    ),
    Key(
        "after",
        "the name of a step, or a table as of expect",
        lambda value: _is_name(value) or _is_table(value),
        "it begins when that step is over, or when that has come",
        otherwise="when the step above it is over",
    ),
    Key("wait", TIME, _is_time, "how much later it begins; alone: a pause", otherwise="at once"),
    Key("bus", "a bus's name", _is_name, "where it is done", otherwise="on the first bus"),
    Key(
        "each",
        _NODES,
        _is_nodes,
        "done for each of these nodes in turn, whose address is {node}",
        otherwise="done once",
    ),
    Key(
        "repeat",
        f"a whole number from 1 to {MOST_STEPS}",
        _whole(1, MOST_STEPS),
        "done so often; {round} counts from 1",
        default=1,
    ),
)

#: What a step does: exactly one of these, or none with ``wait``.
DEEDS: Final = (
    Key(
        "send",
        'a line such as "10m400" or "3 stop", or several',
        _is_lines,
        "the bus's master sends it, with retries",
    ),
    Key(
        "raw",
        "bytes in hexadecimal, ^ before each whose ninth bit is 1",
        _is_hex,
        "put on the line as they are",
    ),
    Key("type", "a table", _is_table, "keys at a terminal"),
    Key("pin", "a table", _is_table, "inputs of nodes driven to levels"),
    Key("turn", "a table", _is_table, "the encoder turned"),
    Key("power", "a table", _is_table, "nodes switched off or on"),
    Key("fault", "a table of one fault", _is_table, "a fault of the line put on"),
    Key("lift", "the name of a step with a fault", _is_name, "that fault taken off"),
    Key("queue", "a table", _is_table, "a queue file sent to nodes as edits, with retries"),
    Key("mark", "a text", _is_name, "a remark in the recording"),
    Key("expect", "a table", _is_table, "what must come"),
    Key("step", "[[step.step]]", _is_tables, "several steps, one after the other"),
)

SEND: Final = (
    Key(
        "outcome",
        "ack, nak, no answer, unknown or any",
        _words("ack", "nak", "no answer", "unknown", "any"),
        "what each line must come to",
        default="ack",
        choices=("ack", "nak", "no answer", "unknown", "any"),
    ),
    Key(
        "accept_duplicates",
        "true or false",
        _is_flag,
        "after silence send again even what may then run twice",
        default=False,
    ),
    Key(
        "says",
        "a text",
        _is_name,
        "what each answer must say, as sacbus ss prints it; not of a SAC, which says nothing",
        otherwise="anything",
    ),
    Key(
        "every",
        TIME,
        _is_time,
        "polls: a line each time, in turn (with each: all nodes'), while the steps below go on",
        otherwise="all lines once",
    ),
    Key(
        "for",
        TIME,
        _is_time,
        "how long it polls; the step below waits for that",
        otherwise="to the end",
    ),
)

_NODE: Final = Key("node", _NODES, _is_nodes, "whose", required=True)

TYPE: Final = (
    _NODE,
    Key("keys", "a text", _is_text, 'what is typed; "\\r" ends a line', required=True),
)

PIN: Final = (_NODE,)

QUEUE: Final = (
    Key(
        "node",
        f"{_NODES}, or 0 for a broadcast",
        lambda value: _is_nodes(value) or _whole(0, 0)(value),
        "whose",
        required=True,
    ),
    Key("file", "a path", _is_name, "of the companion's CSV", required=True),
)

TURN: Final = (
    _NODE,
    Key(
        "detents",
        "a whole number from -1000 to 1000",
        _whole(-1_000, 1_000),
        "clockwise positive",
        required=True,
    ),
)

POWER: Final = (_NODE, Key("on", "true or false", _is_flag, "on: a cold boot", required=True))

#: What an expectation is about. Those of a node may stand together, and so may counts.
EXPECTED: Final = {
    "position": "node",
    "velocity": "node",
    "state": "node",
    "pin": "node",
    "shown": "shown",
    "packet": "packet",
    "pattern": "packet",
    "answer": "packet",
    "soft_op": "packet",
    "silence": "silence",
    "start_skew": "start_skew",
    "deviation": "deviation",
    "retries": "count",
    "naks": "count",
    "acks": "count",
    "timeouts": "count",
    "collisions": "count",
    "warnings": "count",
}

EXPECT: Final = (
    Key("node", _NODES, _is_nodes, "whose position, velocity, state, pins, terminal or counts"),
    Key("position", _BOUNDS, _is_bounds, "full steps, clockwise positive"),
    Key("velocity", _BOUNDS, _is_bounds, "RPM; one number is met within half an RPM"),
    Key(
        "state",
        'a text such as "STANDBY"',
        _is_name,
        "STANDBY, ACCEL, CRUISE, DECEL, STOP, SYNC, BOOT, OFF: one that the node's kind has",
    ),
    Key(
        "pin",
        "a table of levels by pins",
        _is_levels,
        "levels of inputs and outputs",
    ),
    Key(
        "shown",
        "a text",
        _is_something,
        "in what the terminal has shown since the last such expectation",
    ),
    Key("packet", "a text", _is_text, "the body of a packet"),
    Key("pattern", "a regular expression", _is_text, "that the whole body of a packet matches"),
    Key("answer", "ack or nak", _words("ack", "nak"), "an answer", choices=("ack", "nak")),
    Key(
        "soft_op",
        "start or end",
        _words("start", "end"),
        "what a node tells all when a command starts or ends",
        choices=("start", "end"),
    ),
    Key(
        "from",
        "an address",
        _whole(0, 255),
        "of the packet, answer or silence",
        otherwise="anybody",
    ),
    Key(
        "to", "an address", _whole(0, 255), "of the packet or answer; 0 is all", otherwise="anybody"
    ),
    Key(
        "count",
        "a whole number from 1 to 100000",
        _whole(1, 100_000),
        "so many packets or answers",
        default=1,
    ),
    Key("silence", TIME, _is_time, "nothing on the line, or from that node, for so long"),
    Key("start_skew", TIME, _is_time, "by which their last motions started apart at most"),
    Key(
        "deviation",
        "a number of full steps from 0 on",
        lambda value: _is_bounds(value) and isinstance(value, int | float) and value >= 0,
        "by which the nodes, as axes, left the straight line of their last motion at most",
    ),
    Key("retries", _BOUNDS, _is_bounds, "lines that the master sent again"),
    Key("naks", _BOUNDS, _is_bounds, "NAKs that the master got"),
    Key("acks", _BOUNDS, _is_bounds, "ACKs that the master got"),
    Key("timeouts", _BOUNDS, _is_bounds, "answers that the master waited for in vain"),
    Key("collisions", _BOUNDS, _is_bounds, "transmissions that another one overlapped"),
    Key("warnings", _BOUNDS, _is_bounds, "warnings, lines refused, queues overrun"),
    Key("within", TIME, _is_time, "how long it may take", otherwise="it must be so at once"),
    Key("for", TIME, _is_time, "it must stay so for that long", otherwise="once is enough"),
)
