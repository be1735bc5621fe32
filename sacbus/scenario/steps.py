"""The steps of a scenario's file: loops unrolled, each step to its values.

Owns the reading of [[step]]. What is wrong with a step goes to the findings and the step is left
out; what steps have to do with each other and with the buses is looked at elsewhere (``rules.py``).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sacbus.bus import FaultError, fault_from
from sacbus.config import lines
from sacbus.config.keys import Key, shown
from sacbus.config.mistake import Findings
from sacbus.config.source import Source
from sacbus.config.table import Table, tables
from sacbus.configuration import Configuration, check
from sacbus.language.queue_file import WrongRow
from sacbus.mother.request import SPEAKS
from sacbus.scenario.edits import queue_edits
from sacbus.scenario.expecting import ExpectationReader, time_of
from sacbus.scenario.keys import (
    DEEDS,
    EXPECT,
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
from sacbus.scenario.quantity import marked_bytes
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
        self._expected = ExpectationReader(findings, buses)
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
            each = self._expected.nodes(loop.get("each"), loop.get("bus", self._bus))
            if "every" in content and "send" in content:
                content = self._round(path, content, each, scope)
                each = (None,)
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

    def _round(
        self,
        path: lines.Path,
        content: Mapping[str, object],
        nodes: Sequence[int | None],
        scope: Mapping[str, Value],
    ) -> Mapping[str, object]:
        """A step that polls each node: one step, whose lines are those of all nodes in turn."""
        given = content["send"]
        found: list[object] = []
        for node in nodes:
            assert node is not None, "addresses"
            inner = {**scope, "node": node}
            found += [
                put_in(line, inner, (*path, "send"), self._findings, set())
                for line in (given if isinstance(given, list) else [given])
            ]
        return {**content, "send": found}

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
            after = self._expected.read(
                Table.read(self._findings, table.at("after"), after, EXPECT),
                table.get("bus", self._bus),
            )
        line = self._findings.line(table.path)
        return Step(
            deed,
            table.get("name", "") if name is None else name,
            time_of(table, "at"),
            after,
            time_of(table, "wait") or 0,
            f"{self._source.name}:{line}",
        )

    def _deed(self, table: Table, name: str) -> Deed | None:
        bus = table.get("bus", self._bus)
        value = table.get(name)
        match name:
            case "send":
                lines_ = value if isinstance(value, list) else [value]
                return self._send(table, tuple(map(str, lines_)), bus)
            case "raw":
                data, ninth = marked_bytes(value)
                return Raw(data, bus, ninth)
            case "mark":
                return Mark(value)
            case "wait":
                return Pause()
            case "expect":
                return self._expected.read(self._inner(table, name, EXPECT), bus)
            case "type":
                inner = self._inner(table, name, TYPE)
                if not _has(inner, "node", "keys"):
                    return None
                return Type(self._expected.nodes(inner.get("node"), bus), inner.get("keys"), bus)
            case "turn":
                inner = self._inner(table, name, TURN)
                if not _has(inner, "node", "detents"):
                    return None
                return Turn(self._expected.nodes(inner.get("node"), bus), inner.get("detents"), bus)
            case "power":
                inner = self._inner(table, name, POWER)
                if not _has(inner, "node", "on"):
                    return None
                return Power(self._expected.nodes(inner.get("node"), bus), inner.get("on"), bus)
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
        every = time_of(table, "every")
        if every is None:
            if "for" in table.values:
                self._findings.add(table.at("for"), "expected only with every", "remove it")
            again, says = table.get("accept_duplicates", False), table.get("says")
            return Send(lines_, outcome, again, bus, says)
        if "says" in table.values:
            self._findings.add(table.at("says"), "expected only without every", "remove it")
        return Poll(lines_, every, time_of(table, "for"), outcome, bus)

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
        there = next((one for one in self._buses if not bus or one.name == bus), None)
        if there is not None and (spoken := check(there).name) not in SPEAKS:
            what = (
                f"expected a bus that speaks {' or '.join(SPEAKS)}, as queue files do, got {spoken}"
            )
            self._findings.add(table.at("queue"), what, "leave it out")
            return None
        nodes = (0,) if inner.get("node") == 0 else self._expected.nodes(inner.get("node"), bus)
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
        return Pin(self._expected.nodes(inner.get("node"), bus), levels, bus)

    def _inner(self, table: Table, name: str, keys: Sequence[Key], *, whole: bool = True) -> Table:
        content = table.get(name)
        return Table.read(self._findings, table.at(name), content, keys, whole=whole)


def _has(table: Table, *names: str) -> bool:
    return all(name in table.values for name in names)
