"""A scenario's file to scenarios, one for each case, or to all that is wrong with it.

Owns the order of the reading: text, parameters, buses, steps, and then the rules of all together.
Nothing is opened but the files that are read.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from sacbus.config.mistake import ConfigError, Findings, Mistake
from sacbus.config.reading import read as read_configuration
from sacbus.config.reading import read_source
from sacbus.config.source import Source, load
from sacbus.config.table import Table
from sacbus.configuration import Configuration
from sacbus.scenario.keys import TOP
from sacbus.scenario.parameters import MOST_CASES, Value, cases, put_in
from sacbus.scenario.quantity import nanoseconds
from sacbus.scenario.rules import complaints
from sacbus.scenario.steps import StepReader, Written
from sacbus.scenario.values import Lift, Scenario, Step

__all__ = ["read"]

_NOTHING: Mapping[str, object] = MappingProxyType({})


def read(
    file: str | Path, given: Mapping[str, object] = _NOTHING, *, seed: int | None = None
) -> tuple[Scenario, ...]:
    """The scenarios in a file, or on standard input for ``-``; ConfigError with all mistakes.

    ``given``: values of parameters in place of the file's; ``seed`` in place of every seed in it.
    """
    source = load(file, "scenario")
    findings = Findings(source.name, source.lines)
    top = Table.read(findings, (), source.content, TOP)
    values = {**top.get("parameters", {}), **given}
    for name in given:
        if name not in top.get("parameters", {}) and "parameters" not in top.unsure:
            known = ", ".join(top.get("parameters", {})) or "none"
            findings.add(("parameters",), f"unknown parameter {name!r}", f"known here: {known}")
    found: list[Scenario] = []
    mistakes: dict[Mistake, None] = {}
    for number, (case, varying) in enumerate(cases(values)):
        if number >= MOST_CASES:
            findings.add(("parameters",), f"expected at most {MOST_CASES} cases", "split it")
            break
        reader = _CaseReader(source, top, case, seed)
        scenario = reader.scenario(varying)
        if scenario is not None:
            found.append(scenario)
        mistakes.update(dict.fromkeys(reader.mistakes))
    mistakes.update(dict.fromkeys(findings.mistakes()))
    if mistakes:
        raise ConfigError(sorted(mistakes, key=lambda one: one.line or 0))
    return tuple(found)


def _named(step: Step, key: str) -> str | None:
    """The other step that a key of this one names; None where it names none."""
    if key == "lift" and isinstance(step.does, Lift):
        return step.does.step
    return step.after if key == "after" and isinstance(step.after, str) else None


class _CaseReader:
    """One case of a scenario."""

    def __init__(
        self, source: Source, top: Table, case: Mapping[str, Value], seed: int | None
    ) -> None:
        self._source = source
        self._top = top
        self._case = case
        self._seed = seed
        self._findings = Findings(source.name, source.lines)
        #: Names of steps that were left out for what is wrong with them.
        self._left_out: set[str] = set()
        self.mistakes: list[Mistake] = []

    def scenario(self, varying: Mapping[str, Value]) -> Scenario | None:
        """The scenario, unless something is wrong; then there are ``mistakes``."""
        top = self._top
        buses = self._buses()
        written = self._steps(buses)
        steps = tuple(one.step for one in written)
        scenario = Scenario(
            str(self._put("title", top.get("title", Path(self._source.name).stem))),
            buses,
            steps,
            nanoseconds(top.get("end")) if "end" in top.values else None,
            dict(varying),
            self._source.name,
            dict(self._case),
        )
        if buses:
            for complaint in complaints(scenario):
                assert complaint.step is not None, "there is a bus"
                if _named(steps[complaint.step], complaint.key) in self._left_out:
                    continue
                path = written[complaint.step].path
                where = (*path, *filter(None, complaint.key.split(".")))
                self._findings.add(where, complaint.what, complaint.remedy)
        self.mistakes += self._findings.mistakes()
        return None if self.mistakes else scenario

    def _steps(self, buses: tuple[Configuration, ...]) -> list[Written]:
        content = self._top.get("step")
        if content == []:
            self._findings.add(("step",), "expected one [[step]] at least, got none", "add one")
        reader = StepReader(self._source, self._findings, buses)
        written = reader.read(("step",), content, "step", self._case)
        self._left_out = reader.left_out
        return written

    def _put(self, key: str, value: object) -> object:
        return put_in(value, self._case, (key,), self._findings, set())

    def _buses(self) -> tuple[Configuration, ...]:
        """The buses; none where something is wrong with them."""
        top = self._top
        if "buses" in top.values:
            if "bus" in top.values:
                self._findings.add(
                    top.at("buses"), "expected buses or [[bus]], got both", "leave one out"
                )
            return self._buses_of(str(self._put("buses", top.get("buses"))))
        if top.lacks("bus"):
            self._findings.add(
                (), "expected bus (one [[bus]] at least) or buses, got none", "give one"
            )
            return ()
        if "bus" not in top.values:
            return ()
        content = {"state": False, "bus": self._put("bus", top.get("bus"))}
        try:
            setup = read_source(dataclasses.replace(self._source, content=content))
        except ConfigError as wrong:
            self.mistakes += wrong.mistakes
            return ()
        for number, bus in enumerate(setup.buses):
            if bus.state is not None:
                what = "expected none: what a scenario begins with must be the same every time"
                self._findings.names["bus", number] = f"bus {bus.name!r}"
                self._findings.add(("bus", number, "state"), what, "remove it")
        return tuple(self._seeded(bus, number) for number, bus in enumerate(setup.buses))

    def _buses_of(self, file: str) -> tuple[Configuration, ...]:
        try:
            setup = read_configuration(self._source.directory / file)
        except ConfigError as wrong:
            self.mistakes += [
                dataclasses.replace(
                    one,
                    file=f"{self._source.name}:{self._findings.line(('buses',))}: {one.file}",
                )
                for one in wrong.mistakes
            ]
            return ()
        return tuple(
            self._seeded(dataclasses.replace(bus, state=None), None) for bus in setup.buses
        )

    def _seeded(self, bus: Configuration, number: int | None) -> Configuration:
        """A bus with the seed that counts: the caller's, its own, or the scenario's.

        Without a ``number`` it stands in a file of its own, which has the seed too.
        """
        if self._seed is not None:
            return dataclasses.replace(bus, seed=self._seed)
        tables = self._top.get("bus")
        own = number is not None and isinstance(tables, list) and "seed" in tables[number]
        return (
            bus
            if own or number is None
            else dataclasses.replace(bus, seed=self._top.get("seed", 0))
        )
