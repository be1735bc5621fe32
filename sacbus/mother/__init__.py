"""The master's side. This version: transactions; groups, paths and G-code follow."""

from sacbus.mother.calibrate import Calibration, NoSoftOp, calibrate
from sacbus.mother.caller import Acknowledged, Caller, Clock, Sent, SoftOpHeard
from sacbus.mother.errors import (
    BadRequest,
    LineLost,
    MotherError,
    NoAnswer,
    NotStarted,
    Refused,
    UnknownOutcome,
)
from sacbus.mother.group import Group, GroupMotion, GroupRun, Member
from sacbus.mother.mother import Mother, addressed_line
from sacbus.mother.release import Release, Share, stand_down, start_together
from sacbus.mother.request import safe_body
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
    "Sent",
    "Share",
    "SoftOpHeard",
    "UnknownOutcome",
    "addressed_line",
    "calibrate",
    "safe_body",
    "stand_down",
    "start_together",
]
