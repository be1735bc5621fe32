"""What a test expects, in the words of a scenario, as the value that is looked for.

Owns what Python writes otherwise than TOML: ``from_`` and ``for_``, tuples, several addresses in a
row. All else is the scenario's own reading and its own rules.
"""

from __future__ import annotations

from collections.abc import Mapping

from sacbus.config.mistake import ConfigError, Findings
from sacbus.config.notation import ranges
from sacbus.config.table import Table
from sacbus.configuration import Configuration
from sacbus.scenario.expectations import Expectation
from sacbus.scenario.expecting import ExpectationReader
from sacbus.scenario.keys import EXPECT
from sacbus.scenario.rules import complaints
from sacbus.scenario.values import Scenario, Step

__all__ = ["wanted"]

#: What the mistakes of a call are told under, where a file has its name.
HERE = "in this test"


def wanted(
    expected: Expectation | None, keys: Mapping[str, object], bus: Configuration
) -> Expectation:
    """The expectation that is given as a value or by its keys; ConfigError for what is none."""
    if expected is None:
        expected = _read(keys, bus)
    elif keys:
        raise TypeError("expected an expectation or its keys, got both")
    scenario = Scenario(HERE, (bus,), (Step(expected),))
    findings = Findings(HERE, {})
    for one in complaints(scenario):
        rest = (key for key in one.key.split(".") if key not in ("", "expect"))
        findings.add(("expect", *rest), one.what, one.remedy)
    _refuse(findings)
    return expected


def _read(keys: Mapping[str, object], bus: Configuration) -> Expectation:
    content = {name.rstrip("_"): _plain(name, value) for name, value in keys.items()}
    findings = Findings(HERE, {})
    table = Table.read(findings, ("expect",), content, EXPECT)
    expected = ExpectationReader(findings, (bus,)).read(table, "")
    _refuse(findings)
    assert expected is not None, "what is none has been found"
    return expected


def _plain(name: str, value: object) -> object:
    """A value as TOML would have it."""
    if name == "node" and isinstance(value, list | tuple | set | range):
        return ranges(value)
    return list(value) if isinstance(value, tuple) else value


def _refuse(findings: Findings) -> None:
    if mistakes := findings.mistakes():
        raise ConfigError(mistakes)
