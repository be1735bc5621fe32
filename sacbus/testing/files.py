"""Scenarios as tests: each case of a file is one.

Owns how they are collected, played, and told of when they fail.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sacbus.config.mistake import ConfigError
from sacbus.scenario import Result, Scenario, read, run
from sacbus.scenario.result import case_words
from sacbus.testing.recordings import Recordings
from sacbus.trace import RecordingCutOff

__all__ = ["ScenarioFile", "ScenarioItem"]


class ScenarioFile(pytest.File):
    """A scenario's file."""

    def collect(self) -> Iterator[ScenarioItem]:
        """A test for each case."""
        try:
            scenarios = read(self.path)
        except ConfigError as wrong:
            raise self.CollectError(str(wrong)) from wrong
        for scenario in scenarios:
            case = case_words(scenario.case)
            name = f"{scenario.title}[{case}]" if case else scenario.title
            yield ScenarioItem.from_parent(self, name=name, scenario=scenario)


class ScenarioItem(pytest.Item):
    """One case of a scenario, played in virtual time."""

    def __init__(self, *, scenario: Scenario, **others: Any) -> None:  # noqa: ANN401 (pytest's own)
        super().__init__(**others)
        self.scenario = scenario

    def runtest(self) -> None:
        """Play it."""
        directory = self.config.getoption("--sacbus-record")
        if directory is None:
            result = run(self.scenario)
        else:
            root = self.config.rootpath
            recordings = Recordings(Path(directory), self.nodeid, self.path, root)
            with recordings.open() as record:
                result = run(self.scenario, record=record)
        if not result.passed:
            raise _Failed(result)

    def repr_failure(
        self,
        excinfo: pytest.ExceptionInfo[BaseException],
        style: Any = None,  # noqa: ANN401
    ) -> Any:  # noqa: ANN401 (as pytest has it)
        """The expectations that failed, with the last packets and the states; no traceback."""
        if isinstance(excinfo.value, _Failed | RecordingCutOff):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where it stands."""
        return self.path, None, self.name


class _Failed(Exception):
    """A scenario that was not as expected."""

    def __init__(self, result: Result) -> None:
        lines = [line for failure in result.failures for line in failure.lines()]
        super().__init__("\n".join(lines))
