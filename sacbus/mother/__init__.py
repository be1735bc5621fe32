"""The master's side: transactions, the emergency stop, the scan of a line."""

from sacbus.mother.caller import Caller
from sacbus.mother.clock import Clock
from sacbus.mother.errors import (
    BadRequest,
    LineLost,
    MotherError,
    NoAnswer,
    Refused,
    Stopped,
    UnknownOutcome,
)
from sacbus.mother.mother import Mother, addressed_line
from sacbus.mother.outcome import Acknowledged, Sent
from sacbus.mother.request import safe_body
from sacbus.mother.scan import ScanProgress
from sacbus.mother.statistics import NodeStatistics

__all__ = [
    "Acknowledged",
    "BadRequest",
    "Caller",
    "Clock",
    "LineLost",
    "Mother",
    "MotherError",
    "NoAnswer",
    "NodeStatistics",
    "Refused",
    "ScanProgress",
    "Sent",
    "Stopped",
    "UnknownOutcome",
    "addressed_line",
    "safe_body",
]
