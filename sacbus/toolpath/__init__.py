"""From a tool's way to the commands of every axis, and their exact times.

Owns geometry, velocities along a path, and how they are shared out over axes that have no common
clock. Synchronous and deterministic; no bytes, no asyncio, no node. Imports ``motion`` and
``language``.
Source: manual, "SAC in a multi-axis environment"; spec, mother ("Straight lines", "G-code").
"""

from sacbus.toolpath.block import AxisRun, Block, Deviation
from sacbus.toolpath.machine import Axis, Machine
from sacbus.toolpath.path import Dwell, Halt, PathItem, Straight

__all__ = [
    "Axis",
    "AxisRun",
    "Block",
    "Deviation",
    "Dwell",
    "Halt",
    "Machine",
    "PathItem",
    "Straight",
]
