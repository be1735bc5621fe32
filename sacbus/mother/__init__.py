"""The master's side: transactions, the emergency stop, the scan of a line."""

from sacbus.mother.calibrate import Calibration, NoSoftOp, calibrate
from sacbus.mother.caller import Caller, SoftOpHeard
from sacbus.mother.clock import Clock
from sacbus.mother.errors import (
    BadRequest,
    LineLost,
    MotherError,
    NoAnswer,
    NotStarted,
    Refused,
    Stopped,
    UnknownOutcome,
)
from sacbus.mother.group import Group, GroupMotion, GroupRun, Member
from sacbus.mother.mother import Mother, addressed_line
from sacbus.mother.outcome import Acknowledged, Sent
from sacbus.mother.release import Release, Share, stand_down, start_together
from sacbus.mother.request import safe_body
from sacbus.mother.scan import ScanProgress
from sacbus.mother.statistics import NodeStatistics

__all__ = [
    "Acknowledged",
    "BadRequest",
    "Calibration",
    "Caller",
    "Clock",
    "Group",
    "GroupMotion",
    "GroupRun",
    "LineLost",
    "Member",
    "Mother",
    "MotherError",
    "NoAnswer",
    "NoSoftOp",
    "NodeStatistics",
    "NotStarted",
    "Refused",
    "Release",
    "ScanProgress",
    "Sent",
    "Share",
    "SoftOpHeard",
    "Stopped",
    "UnknownOutcome",
    "addressed_line",
    "calibrate",
    "safe_body",
    "stand_down",
    "start_together",
]
