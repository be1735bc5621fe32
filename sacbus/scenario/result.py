"""What came of a scenario: its failures, its counts, when it ended.

Owns how a failure reads. Times in ns of bus time since the scenario's beginning.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sacbus.kernel import SECOND, US, Ns
from sacbus.node import Snapshot
from sacbus.scenario.values import Scenario
from sacbus.trace import Recording

__all__ = ["Failure", "Met", "Result", "case_words"]


@dataclass(frozen=True, slots=True)
class Failure:
    """An expectation that was not met, or something that could not be done.

    ``when``: when that was certain. ``step``: the name of the step, if it has one; ``place``: where
    it stands. ``packets``: the last ones on the line, oldest first; ``states``: what the nodes that
    it is about were like.
    """

    when: Ns
    expected: str
    got: str
    step: str = ""
    place: str = ""
    packets: tuple[str, ...] = ()
    states: tuple[str, ...] = ()

    def __str__(self) -> str:
        step = f"{self.step}: " if self.step else ""
        place = f"{self.place}: " if self.place else ""
        when = f"at {self.when / SECOND:.6f} s"
        return f"{place}{step}expected {self.expected}, got {self.got}, {when}"

    def lines(self) -> list[str]:
        """The failure, and below it what the line and the nodes were like."""
        told = [str(self)]
        told += [f"    {one}" for one in self.packets]
        told += [f"    {one}" for one in self.states]
        return told


@dataclass(frozen=True, slots=True)
class Met:
    """An expectation that was met; ``when``, ``step`` and ``place`` as of a :class:`Failure`."""

    when: Ns
    expected: str
    step: str = ""
    place: str = ""


@dataclass(slots=True)
class Result:
    """What came of one scenario with one set of parameters; ``ended``: after how much bus time.

    ``expectations``: how many were looked at. ``counts``: what was counted, by the names of the
    buses.
    """

    scenario: Scenario
    failures: list[Failure] = field(default_factory=list)
    ended: Ns = 0
    expectations: int = 0
    counts: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    #: What was met, and the failures once more, in the order in which that was certain.
    looked: list[Met | Failure] = field(default_factory=list)
    #: When it began, in the bus time of the recording.
    origin: Ns = 0
    #: What the nodes were like at its end, by bus and configured address; none behind a link.
    nodes: Mapping[tuple[str, int], Snapshot] = field(default_factory=dict)
    #: What was recorded; None where nothing was.
    recording: Recording | None = None

    @property
    def passed(self) -> bool:
        """Whether all that was expected came."""
        return not self.failures

    @property
    def name(self) -> str:
        """Its title, with the case where there are several."""
        case = case_words(self.scenario.case)
        return f"{self.scenario.title} [{case}]" if case else self.scenario.title

    def as_json(self) -> dict[str, Any]:
        """All of it. ``Any``: the shapes of JSON."""
        return {
            "file": self.scenario.file,
            "title": self.scenario.title,
            "case": dict(self.scenario.case),
            "passed": self.passed,
            "ended_us": self.ended / US,
            "expectations": self.expectations,
            "counts": {name: dict(counts) for name, counts in self.counts.items()},
            "failures": [
                {
                    "at_us": one.when / US,
                    "step": one.step,
                    "place": one.place,
                    "expected": one.expected,
                    "got": one.got,
                    "packets": list(one.packets),
                    "states": list(one.states),
                }
                for one in self.failures
            ],
        }


def case_words(case: Mapping[str, object]) -> str:
    """``speed=120, seed=1``."""
    return ", ".join(f"{name}={value}" for name, value in case.items())
