"""From a tool's way to the commands of every axis, and their exact times.

Owns geometry, velocities along a path, and how they are shared out over axes that have no common
clock. Synchronous and deterministic; no bytes, no asyncio, no node. Imports ``motion`` and
``language``.
Source: manual, "SAC in a multi-axis environment"; spec, mother ("Straight lines", "G-code").
"""

from sacbus.toolpath.block import AxisRun, Block, Deviation
from sacbus.toolpath.deviation import deviation
from sacbus.toolpath.follow import COMMANDS_MAX, follow
from sacbus.toolpath.jitter import Jitter, SideBySide, bresenham, side_by_side
from sacbus.toolpath.law import Law, Phase
from sacbus.toolpath.line import plan_line
from sacbus.toolpath.machine import MOST_STEPS, Axis, Machine
from sacbus.toolpath.path import Dwell, Halt, PathItem, Straight
from sacbus.toolpath.planner import plan_path
from sacbus.toolpath.pulses import Pulses
from sacbus.toolpath.survey import Survey

__all__ = [
    "COMMANDS_MAX",
    "MOST_STEPS",
    "Axis",
    "AxisRun",
    "Block",
    "Deviation",
    "Dwell",
    "Halt",
    "Jitter",
    "Law",
    "Machine",
    "PathItem",
    "Phase",
    "Pulses",
    "SideBySide",
    "Straight",
    "Survey",
    "bresenham",
    "deviation",
    "follow",
    "plan_line",
    "plan_path",
    "side_by_side",
]
