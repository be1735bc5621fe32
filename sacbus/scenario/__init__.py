"""Scenarios: what happens on buses and what is expected of them, played the same way every time.

Owns scenarios as values and as TOML, the playing of them in virtual and real time and over a link,
and what came of it. The public names are here.
"""

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
from sacbus.scenario.quantity import Bounds, bounds, nanoseconds
from sacbus.scenario.reading import read
from sacbus.scenario.result import Failure, Met, Result
from sacbus.scenario.run import run, run_on_link, run_real
from sacbus.scenario.values import (
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

__all__ = [
    "Bounds",
    "Counted",
    "Disturb",
    "Expectation",
    "Failure",
    "Lift",
    "Mark",
    "Met",
    "NodeIs",
    "PacketSeen",
    "Pause",
    "Pin",
    "Poll",
    "Power",
    "Raw",
    "Result",
    "Scenario",
    "Send",
    "Shown",
    "Silent",
    "Step",
    "Straight",
    "Together",
    "Turn",
    "Type",
    "bounds",
    "nanoseconds",
    "read",
    "run",
    "run_on_link",
    "run_real",
]
