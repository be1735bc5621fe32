"""What no scenario can be: nodes that are not there, times that cannot come, lines that cannot go.

Owns the rules that the values themselves do not carry, for scenarios from files and from Python
alike; and what can be asked of a line alone. Nothing is opened; a node is made aside to ask what
pins it has.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

from sacbus.bus import Fault
from sacbus.bus.duration import time_text
from sacbus.config.mistake import ConfigError, Mistake
from sacbus.config.notation import ranges
from sacbus.configuration import Configuration, check
from sacbus.kernel import LineRate
from sacbus.mother import BadRequest
from sacbus.mother.masters import MasterKind, find_master
from sacbus.node import Node, PinError, find_kind, settings_from
from sacbus.scenario.expectations import (
    Counted,
    NodeIs,
    PacketSeen,
    Shown,
    Silent,
    Straight,
    Together,
)
from sacbus.scenario.play import predecessors
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
    Scenario,
    Send,
    Step,
    Turn,
    Type,
)

__all__ = ["Complaint", "complaints", "line_complaints", "refuse"]

#: Counts that a master keeps, and so can be had over a link.
_MASTERS = ("retries", "naks", "acks", "timeouts")


@dataclass(frozen=True, slots=True)
class Complaint:
    """Something about a step, by its index, or, with None, about the whole; ``key``: within it."""

    step: int | None
    key: str
    what: str
    remedy: str = "correct it"


def refuse(scenario: Scenario, *, line_only: bool = False) -> None:
    """ConfigError with all that is against a scenario; with ``line_only``, to play it on a link."""
    found = list(complaints(scenario))
    if line_only and not found:
        found = list(line_complaints(scenario))
    if found:
        raise ConfigError([_mistake(scenario, one) for one in found])


def _mistake(scenario: Scenario, one: Complaint) -> Mistake:
    name = scenario.file or repr(scenario.title)
    if one.step is None:
        return Mistake(name, None, None, one.key, one.what, one.remedy)
    place, _, line = scenario.steps[one.step].place.rpartition(":")
    key = ".".join(filter(None, (f"steps[{one.step}]", one.key)))
    if place and line.isdecimal():
        return Mistake(place, int(line), None, one.key or "step", one.what, one.remedy)
    return Mistake(name, None, None, key, one.what, one.remedy)


def complaints(scenario: Scenario) -> Iterator[Complaint]:
    """All that is against a scenario, step by step."""
    if not scenario.buses:
        yield Complaint(None, "bus", "expected one bus at least, got none", "add one")
        return
    names = [bus.name for bus in scenario.buses]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        what = f"expected a name of its own for each, got {twice[0]!r} twice"
        yield Complaint(None, "bus", what, "name them")
        return
    rules = _Rules(scenario)
    for index, step in enumerate(scenario.steps):
        for key, what, remedy in rules.of(index, step):
            yield Complaint(index, key, what, remedy)


def line_complaints(scenario: Scenario) -> Iterator[Complaint]:
    """What takes more than a line: it cannot be played on a link."""
    if len(scenario.buses) != 1:
        what = f"expected one bus to play on a link, got {len(scenario.buses)}"
        yield Complaint(None, "bus", what, "play it without --link")
    for index, step in enumerate(scenario.steps):
        for deed in (step.does, step.after):
            if (beyond := _beyond_a_line(deed)) is not None:
                what = f"expected what a line can show, got {beyond}"
                yield Complaint(index, "", what, "leave it out, or play it without --link")


def _beyond_a_line(deed: Deed | str | None) -> str | None:
    match deed:
        case Raw(ninth=ninth) if ninth is not None:
            return "ninth bits"
        case Type():
            return "keys at a terminal"
        case Pin():
            return "pins"
        case Turn():
            return "an encoder"
        case Power():
            return "a power switch"
        case Disturb():
            return "faults of the line"
        case Together() | Straight():
            return "the motion of nodes"
        case NodeIs(position=position, velocity=velocity, state=state):
            names = {"position": position, "velocity": velocity, "state": state}
            asked = [name for name, value in names.items() if value is not None]
            return f"the {asked[0]} of a node" if asked else "pins"
        case Shown():
            return "a terminal"
        case Silent(source=source) if source is not None:
            return "the silence of one node among others"
        case Counted(counts=counts):
            others = [name for name in counts if name not in _MASTERS]
            return f"a count of {others[0]}" if others else None
        case _:
            return None


_Found = tuple[str, str, str]


class _Rules:
    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._buses = {bus.name: bus for bus in scenario.buses}
        #: Checked once each: that looks through all kinds of nodes, and there are many steps.
        self._spoken = {bus.name: check(bus).name for bus in scenario.buses}
        self._before = predecessors(scenario.steps)
        self._circular = _circular(self._before)
        self._aside: dict[tuple[str, int], Node] = {}
        self._kind = cache(find_kind)

    def of(self, index: int, step: Step) -> Iterator[_Found]:
        yield from self._times(index, step)
        if step.after is not None and not isinstance(step.after, str):
            yield from self._deed(step.after, "after")
        yield from self._deed(step.does, "")

    def _times(self, index: int, step: Step) -> Iterator[_Found]:
        steps, end = self._scenario.steps, self._scenario.end
        if step.at is not None and step.after is not None:
            yield "after", "expected at or after, got both", "leave one out"
            return
        if step.at is not None and end is not None and step.at > end:
            what = f"expected a time up to the end at {time_text(end)}, got {time_text(step.at)}"
            yield "at", what, "correct it"
        if isinstance(step.after, str) and self._before[index] is None:
            names = sorted({one.name for one in steps if one.name and one is not step})
            known = f"; known are {', '.join(names)}" if names else "; no other step has one"
            yield (
                "after",
                f"expected the name of another step, got {step.after!r}",
                f"correct it{known}",
            )
        elif isinstance(step.after, str) and index in self._circular:
            what = f"expected a step that does not wait for this one, got {step.after!r}"
            yield "after", what, "correct it"
        times = (step.at, step.wait)
        if any(one is not None and one < 0 for one in times):
            yield "at", "expected a time from 0 on, got a negative one", "correct it"

    def _deed(self, deed: Deed, key: str) -> Iterator[_Found]:
        name = getattr(deed, "bus", "")
        bus = self._buses.get(name) if name else self._scenario.buses[0]
        if bus is None:
            known = ", ".join(self._buses)
            yield (
                "bus",
                f"expected the name of a bus, got {name!r}",
                f"correct it; known are {known}",
            )
            return
        match deed:
            case Send(lines=lines, outcome=outcome) | Poll(lines=lines, outcome=outcome):
                if not lines:
                    yield "send", "expected one line at least, got none", "give one"
                spoken = self._spoken[bus.name]
                try:
                    master = find_master(spoken)
                except BadRequest as wrong:
                    yield "send", str(wrong), "or give bytes, as raw"
                    return
                if master is None:
                    what = f"expected a bus whose protocol has a master here, got {spoken}"
                    yield "send", what, "install one, or give bytes, as raw"
                    return
                says = deed.says if isinstance(deed, Send) else None
                for line in lines:
                    yield from self._line(bus, master, line, outcome, says)
                if says is not None and outcome != "ack":
                    yield "says", f"expected only with outcome ack, got {outcome}", "remove it"
                elif says is not None and not master.answers_in_words:
                    what = f"expected a protocol whose answers bring words, got {spoken}"
                    yield "says", what, "remove it"
                if isinstance(deed, Poll) and deed.every <= 0:
                    yield "every", "expected a time of more than 0, got 0 s", "correct it"
            case Raw(data=data):
                if not data:
                    yield "raw", "expected one byte at least, got none", "give some"
            case PacketSeen(pattern=pattern):
                yield from self._pattern(pattern, key or "expect")
            case Shown(node=node):
                yield from self._nodes(bus, (node,), key or "expect")
                yield from self._terminals(bus, (node,), key or "expect")
            case Type(nodes=nodes, keys=keys):
                if any(ord(one) > 0xFF for one in keys):
                    yield "type", f"expected characters of one byte, got {keys!r}", "correct it"
                yield from self._nodes(bus, nodes, "type")
                yield from self._terminals(bus, nodes, "type")
            case Pin(nodes=nodes, levels=levels):
                yield from self._nodes(bus, nodes, "pin")
                for pin, level in levels.items():
                    yield from self._drives(bus, nodes, pin, level)
            case Turn(nodes=nodes):
                yield from self._nodes(bus, nodes, "turn")
                yield from self._drives(bus, nodes, "enA", 1)
            case Power(nodes=nodes):
                yield from self._nodes(bus, nodes, "power")
            case NodeIs(nodes=nodes, state=state, pins=pins):
                yield from self._nodes(bus, nodes, key or "expect")
                if state is not None:
                    yield from self._has_state(bus, nodes, state, key or "expect")
                yield from self._has_pins(bus, nodes, pins, key or "expect")
            case Counted(nodes=nodes):
                if nodes is not None:
                    yield from self._nodes(bus, nodes, key or "expect")
            case Together(nodes=nodes) | Straight(nodes=nodes):
                yield from self._nodes(bus, nodes, key or "expect")
                if len(nodes) < 2:
                    yield key or "expect", "expected two nodes at least, got one", "name them"
            case Disturb(fault=fault):
                if named := _nodes_of(fault):
                    yield from self._nodes(bus, named, "fault")
            case Lift(step=name):
                yield from self._fault_steps(name)
            case Pause() | Mark() | Silent():
                pass

    def _fault_steps(self, name: str) -> Iterator[_Found]:
        known = sorted(
            {one.name for one in self._scenario.steps if isinstance(one.does, Disturb) and one.name}
        )
        if name not in known:
            words = f"known are {', '.join(known)}" if known else "no step with a fault has one"
            what = f"expected the name of a step with a fault, got {name!r}"
            yield "lift", what, f"correct it; {words}"

    def _line(
        self,
        bus: Configuration,
        master: MasterKind,
        line: str,
        outcome: str,
        says: str | None,
    ) -> Iterator[_Found]:
        try:
            to = master.read(line)
        except BadRequest as wrong:
            yield "send", str(wrong), "correct it"
        else:
            if not to.everybody and outcome == "ack":
                yield from self._nodes(bus, (to.node,), "send")
            elif to.everybody and says is not None and master.answers_in_words:
                what = f"expected only with lines that are answered, got {line!r} to all"
                yield "says", what, "remove it"

    def _nodes(self, bus: Configuration, nodes: Iterable[int], key: str) -> Iterator[_Found]:
        nodes = tuple(nodes)
        there = [one.address for one in bus.every_node]
        if not nodes:
            yield key, "expected one node at least, got none", "name one"
        missing = [one for one in nodes if one not in there]
        if missing:
            have = f"nodes of bus {bus.name!r} ({ranges(there) or 'it has none'})"
            yield key, f"expected {have}, got {ranges(missing)}", "correct it"

    def _pattern(self, pattern: str | None, key: str) -> Iterator[_Found]:
        try:
            re.compile(pattern or "")
        except re.error as wrong:
            yield (
                f"{key}.pattern",
                f"expected a regular expression, got {pattern!r} ({wrong})",
                "correct it",
            )

    def _terminals(self, bus: Configuration, nodes: Iterable[int], key: str) -> Iterator[_Found]:
        for address, node in self._those(bus, nodes):
            if node.terminal is None:
                yield key, f"node {address} has no terminal port", "leave it out"
                return

    def _drives(
        self, bus: Configuration, nodes: Iterable[int], pin: str, level: int
    ) -> Iterator[_Found]:
        for address, node in self._those(bus, nodes):
            if node.pins is None:
                yield "pin", f"node {address} has no pins", "leave it out"
                return
            try:
                node.pins.drive(pin, level, 0)
            except PinError as wrong:
                yield "pin", str(wrong), "correct it"
                return

    def _has_state(
        self, bus: Configuration, nodes: Iterable[int], state: str, key: str
    ) -> Iterator[_Found]:
        for at in bus.every_node:
            if at.address in nodes and state not in (there := self._kind(at.kind).states):
                what = f"expected a state of node {at.address} ({', '.join(there)}), got {state!r}"
                yield f"{key}.state", what, "correct it"
                return

    def _has_pins(
        self, bus: Configuration, nodes: Iterable[int], pins: Iterable[str], key: str
    ) -> Iterator[_Found]:
        for pin in pins:
            for address, node in self._those(bus, nodes):
                there = () if node.pins is None else (*node.pins.inputs, *node.pins.outputs)
                if pin not in there:
                    what = f"expected a pin of node {address} ({', '.join(there)}), got {pin!r}"
                    yield key, what, "correct it"
                    break

    def _those(self, bus: Configuration, nodes: Iterable[int]) -> Iterator[tuple[int, Node]]:
        """Nodes like these, made aside: whatever is done to them shows nowhere."""
        for at in bus.every_node:
            if at.address not in nodes:
                continue
            made = (bus.name, at.address)
            if made not in self._aside:
                kind = self._kind(at.kind)
                settings = settings_from(kind.settings, at.settings)
                self._aside[made] = kind.create(at.address, settings, LineRate(), _ignore)
            yield at.address, self._aside[made]


def _circular(before: list[int | None]) -> set[int]:
    """The steps that wait for themselves, by way of others."""
    found: set[int] = set()
    walks: dict[int, int] = {}  # in which walk each step was come to, by where that began
    for begin in range(len(before)):
        place: int | None = begin
        while place is not None and place not in walks:
            walks[place] = begin
            place = before[place]
        if place is None or walks[place] != begin:
            continue
        while place not in found:
            found.add(place)
            after = before[place]
            assert after is not None, "a circle has no end"
            place = after
    return found


def _nodes_of(fault: Fault) -> tuple[int, ...]:
    """The addresses that a fault names, where it has some."""
    found: set[int] = set()
    for name in ("node", "beyond"):
        value = getattr(fault, name, None)
        found |= {value} if isinstance(value, int) else set(value or ())
    return tuple(sorted(found))


def _ignore(_report: object) -> None:
    """Nobody is told what a node says that is made aside."""
