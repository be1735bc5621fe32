"""The steps of a scenario's file: loops unrolled, each step to its values.

Owns the reading of [[step]]. What is wrong with a step goes to the findings and the step is left
out; what steps have to do with each other and with the buses is looked at elsewhere (``rules.py``).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sacbus.bus import FaultError, fault_from
from sacbus.config import lines
from sacbus.config.keys import Key, shown
from sacbus.config.mistake import Findings
from sacbus.config.notation import addresses
from sacbus.config.source import Source
from sacbus.config.table import Table, tables
from sacbus.configuration import Configuration
from sacbus.kernel import Ns
from sacbus.language.queue_file import WrongRow
from sacbus.scenario.edits import queue_edits
from sacbus.scenario.expectations import (
    Counted,
    Expectation,
    NodeIs,
    PacketSeen,
    Shown,
    Silent,
    Straight,
    Together,
)
from sacbus.scenario.keys import (
    DEEDS,
    EXPECT,
    EXPECTED,
    MOST_STEPS,
    PIN,
    POWER,
    QUEUE,
    SEND,
    STEP,
    TURN,
    TYPE,
)
from sacbus.scenario.parameters import Value, put_in
from sacbus.scenario.quantity import bounds, nanoseconds
from sacbus.scenario.values import (
    Deed,
    Disturb,
    Lift,
    Mark,
    Pause,
    Pin,
    Poll,
    Power,
    Raw,
    Send,
    Step,
    Turn,
    Type,
)
from sacbus.wire import DC1, DC2

__all__ = ["StepReader", "Written"]

_KEYS = (*STEP, *DEEDS, *SEND)
_DEEDS = tuple(key.name for key in DEEDS)
_SENDS = tuple(key.name for key in SEND)


@dataclass(frozen=True, slots=True)
class Written:
    """A step, and where it stands in the text."""

    step: Step
    path: lines.Path


class StepReader:
    """Reads steps; ``buses`` tell what all nodes are, and may be none if they are wrong."""

    def __init__(self, source: Source, findings: Findings, buses: Sequence[Configuration]) -> None:
        self._source = source
        self._findings = findings
        self._buses = buses
        self._count = 0
        #: The bus of steps that name none: that of the group that they are in.
        self._bus = ""

    def read(
        self, path: lines.Path, content: object, header: str, scope: Mapping[str, Value]
    ) -> list[Written]:
        """The steps of an array of tables, in order, with their loops unrolled."""
        found: list[Written] = []
        for at, table in tables(self._findings, path, content, header):
            found += self._loop(at, table, header, scope)
        return found

    def _loop(
        self,
        path: lines.Path,
        content: Mapping[str, object],
        header: str,
        scope: Mapping[str, Value],
    ) -> list[Written]:
        """A step as often as it is to be done."""
        loops = {name: content[name] for name in ("each", "repeat", "bus") if name in content}
        filled = put_in(loops, scope, path, self._findings, set())
        assert isinstance(filled, dict)
        loop = Table.read(Findings("", {}), path, filled, STEP)
        each: tuple[int | None, ...] = (None,)
        if "each" in loop.values:
            each = self._nodes(loop.get("each"), loop.get("bus", self._bus))
        found: list[Written] = []
        for number in range(loop.get("repeat", 1)):
            for node in each:
                inner = dict(scope)
                if "repeat" in loop.values:
                    inner["round"] = number + 1
                if node is not None:
                    inner["node"] = node
                self._count += 1
                if self._count > MOST_STEPS + 1:
                    return found  # told already
                if self._count > MOST_STEPS:
                    what = f"expected at most {MOST_STEPS} steps with all loops, got more"
                    self._findings.add(path, what, "loop less often")
                    return found
                found += self._step(path, content, header, inner)
        return found

    def _step(
        self,
        path: lines.Path,
        content: Mapping[str, object],
        header: str,
        scope: Mapping[str, Value],
    ) -> list[Written]:
        inside = content.get("step")
        own = {name: value for name, value in content.items() if name != "step"}
        filled = put_in(own, scope, path, self._findings, set())
        assert isinstance(filled, dict)
        if "step" in content:
            filled["step"] = inside
        table = Table.read(self._findings, path, filled, _KEYS)
        done = [name for name in _DEEDS if name in table.values]
        if len(done) > 1:
            what = f"expected one thing to do, got {' and '.join(done)}"
            self._findings.add(path, what, "make several steps of it")
            return []
        if not done and table.lacks("wait") and all(map(table.lacks, _DEEDS)):
            what = f"expected something to do ({', '.join(_DEEDS)}) or wait, got nothing"
            self._findings.add(path, what, "give one")
            return []
        for name in _SENDS:
            if name in table.values and done and done != ["send"]:
                self._findings.add(table.at(name), "expected only with send", "remove it")
        if done == ["step"]:
            return self._group(table, inside, header, scope)
        deed = self._deed(table, done[0] if done else "wait")
        if deed is None:
            return []
        return [Written(self._when(table, deed), path)]

    def _group(
        self, table: Table, inside: object, header: str, scope: Mapping[str, Value]
    ) -> list[Written]:
        """Steps of a step: a pause stands for its beginning, and another for its end."""
        begin = Written(self._when(table, Pause(), name=""), table.path)
        around, self._bus = self._bus, table.get("bus", self._bus)
        steps = self.read(table.at("step"), inside, f"{header}.step", scope)
        self._bus = around
        name = table.get("name", "")
        end = [Written(Step(Pause(), name, place=begin.step.place), table.path)] if name else []
        return [begin, *steps, *end]

    def _when(self, table: Table, deed: Deed, name: str | None = None) -> Step:
        after = table.get("after")
        if isinstance(after, dict):
            after = self._expectation(
                Table.read(self._findings, table.at("after"), after, EXPECT),
                table.get("bus", self._bus),
            )
        line = self._findings.line(table.path)
        return Step(
            deed,
            table.get("name", "") if name is None else name,
            _time(table, "at"),
            after,
            _time(table, "wait") or 0,
            f"{self._source.name}:{line}",
        )

    def _deed(self, table: Table, name: str) -> Deed | None:
        bus = table.get("bus", self._bus)
        value = table.get(name)
        match name:
            case "send":
                return self._send(table, (value,) if isinstance(value, str) else tuple(value), bus)
            case "raw":
                return Raw(bytes.fromhex(value), bus)
            case "mark":
                return Mark(value)
            case "wait":
                return Pause()
            case "expect":
                return self._expectation(self._inner(table, name, EXPECT), bus)
            case "type":
                inner = self._inner(table, name, TYPE)
                if not _has(inner, "node", "keys"):
                    return None
                return Type(self._nodes(inner.get("node"), bus), inner.get("keys"), bus)
            case "turn":
                inner = self._inner(table, name, TURN)
                if not _has(inner, "node", "detents"):
                    return None
                return Turn(self._nodes(inner.get("node"), bus), inner.get("detents"), bus)
            case "power":
                inner = self._inner(table, name, POWER)
                if not _has(inner, "node", "on"):
                    return None
                return Power(self._nodes(inner.get("node"), bus), inner.get("on"), bus)
            case "fault":
                return self._fault(table, value, bus)
            case "lift":
                return Lift(value)
            case "queue":
                return self._queue(table, bus)
            case _:
                return self._pin(table, value, bus)

    def _send(self, table: Table, lines_: tuple[str, ...], bus: str) -> Deed:
        outcome = table.get("outcome", "ack")
        every = _time(table, "every")
        if every is None:
            if "for" in table.values:
                self._findings.add(table.at("for"), "expected only with every", "remove it")
            return Send(lines_, outcome, table.get("accept_duplicates", False), bus)
        return Poll(lines_, every, _time(table, "for"), outcome, bus)

    def _fault(self, table: Table, value: Mapping[str, object], bus: str) -> Deed | None:
        try:
            return Disturb(fault_from(value), bus)
        except FaultError as wrong:
            got = "nothing" if wrong.got is None else shown(wrong.got)
            where = (*table.at("fault"), *(one for one in wrong.key.split(".") if one != "fault"))
            self._findings.add(where, f"expected {wrong.expected}, got {got}", "correct it")
            return None

    def _queue(self, table: Table, bus: str) -> Deed | None:
        inner = self._inner(table, "queue", QUEUE)
        if not _has(inner, "node", "file"):
            return None
        nodes = (0,) if inner.get("node") == 0 else self._nodes(inner.get("node"), bus)
        file = self._source.directory / os.path.expanduser(inner.get("file"))  # noqa: PTH111
        try:
            edits = queue_edits(file, inner.get("file"))
        except WrongRow as wrong:
            what = f"expected {wrong.expected}, got {wrong.got}"
            name = f"{inner.get('file')} line {wrong.line} column {wrong.column}"
            self._findings.add(inner.at("file"), f"{name}: {what}", "correct it")
        except (OSError, ValueError) as wrong:
            why = getattr(wrong, "strerror", None) or wrong
            what = f"cannot read the queue file {inner.get('file')!r} ({why})"
            self._findings.add(inner.at("file"), what, "check the path and its permissions")
        else:
            return Send(tuple(f"{node}{edit}" for node in nodes for edit in edits), bus=bus)
        return None

    def _pin(self, table: Table, value: Mapping[str, object], bus: str) -> Deed | None:
        inner = self._inner(table, "pin", PIN, whole=False)
        levels: dict[str, int] = {}
        for name, level in value.items():
            if name == "node":
                continue
            if isinstance(level, int) and not isinstance(level, bool):
                levels[name] = level
            else:
                what = f"expected a level, 0 or 1, got {level!r}"
                self._findings.add((*inner.path, name), what, "correct it")
        if not value.keys() - {"node"}:
            self._findings.add(inner.path, "expected a pin and its level, got none", "give one")
        if not _has(inner, "node") or not levels:
            return None
        return Pin(self._nodes(inner.get("node"), bus), levels, bus)

    def _inner(self, table: Table, name: str, keys: Sequence[Key], *, whole: bool = True) -> Table:
        content = table.get(name)
        return Table.read(self._findings, table.at(name), content, keys, whole=whole)

    def _expectation(self, table: Table, bus: str) -> Expectation | None:
        sorts = {EXPECTED[name]: name for name in EXPECTED if name in table.values}
        if not sorts:
            if all(map(table.lacks, EXPECTED)):
                what = f"expected something to look at ({', '.join(EXPECTED)}), got nothing"
                self._findings.add(table.path, what, "give one")
            return None
        if len(sorts) > 1:
            what = f"expected one sort of thing, got {' and '.join(sorts.values())}"
            self._findings.add(table.path, what, "make several steps of it")
            return None
        (sort,) = sorts
        within, lasting = _time(table, "within") or 0, _time(table, "for") or 0
        if within and lasting:
            self._findings.add(table.at("for"), "expected within or for, got both", "leave one out")
        nodes = self._nodes(table.get("node"), bus) if "node" in table.values else None
        if sort in ("node", "shown", "start_skew", "deviation") and nodes is None:
            if table.lacks("node"):
                self._findings.add(
                    table.path, f"expected node ({EXPECT[0].allowed}), got none", "give one"
                )
            return None
        match sort:
            case "node":
                assert nodes is not None
                return NodeIs(
                    nodes,
                    _bounds(table, "position"),
                    _bounds(table, "velocity"),
                    table.get("state"),
                    table.get("pin", {}),
                    within,
                    lasting,
                    bus,
                )
            case "shown":
                assert nodes is not None
                return self._shown(table, nodes, within, bus)
            case "packet":
                return self._packet(table, within, bus)
            case "start_skew":
                return Together(nodes or (), nanoseconds(table.get("start_skew")), bus)
            case "deviation":
                return Straight(nodes or (), table.get("deviation"), bus)
            case "silence":
                return Silent(nanoseconds(table.get("silence")), table.get("from"), bus)
            case _:
                counts = {
                    name: bounds(table.get(name))
                    for name in EXPECTED
                    if EXPECTED[name] == "count" and name in table.values
                }
                return Counted(counts, nodes, within, lasting, bus)

    def _shown(
        self, table: Table, nodes: tuple[int, ...], within: Ns, bus: str
    ) -> Expectation | None:
        if len(nodes) != 1:
            self._findings.add(table.at("node"), "expected one node", "make a step of each")
            return None
        return Shown(nodes[0], table.get("shown"), within, bus)

    def _packet(self, table: Table, within: Ns, bus: str) -> Expectation:
        body: bytes | None = None
        kind, source, destination = "packet", table.get("from"), table.get("to")
        if "packet" in table.values:
            body = table.get("packet").encode("latin-1", "replace")
        if "soft_op" in table.values:
            body = bytes((DC1 if table.get("soft_op") == "start" else DC2,))
            destination = 0
        kind = table.get("answer", kind)
        return PacketSeen(
            kind,
            body,
            table.get("pattern"),
            source,
            destination,
            table.get("count", 1),
            within,
            bus,
        )

    def _nodes(self, given: Any, bus: str) -> tuple[int, ...]:  # noqa: ANN401 (has been looked at)
        """Addresses as ``_NODES`` takes them."""
        if given == "all":
            there = [one for one in self._buses if not bus or one.name == bus]
            return tuple(node.address for one in there[:1] for node in one.every_node)
        return addresses(given) if isinstance(given, str) else (given,)


def _has(table: Table, *names: str) -> bool:
    return all(name in table.values for name in names)


def _time(table: Table, name: str) -> Ns | None:
    return nanoseconds(table.get(name)) if name in table.values else None


def _bounds(table: Table, name: str) -> Any:  # noqa: ANN401
    return bounds(table.get(name)) if name in table.values else None
