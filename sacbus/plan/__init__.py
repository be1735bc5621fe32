"""``sacbus plan``: what commands would do, worked out before any motor turns.

The calculator of the manual. A leaf beside the command line; all figures come from
``sacbus.motion``. ``picture`` needs matplotlib and is imported by who draws.
"""

from sacbus.plan.entries import Commands, ListFile, PlanError, QueueFile, Source, Spool
from sacbus.plan.report import as_json, as_text
from sacbus.plan.sequence import Plan, Planned, Survey, plan_sequence

__all__ = [
    "Commands",
    "ListFile",
    "Plan",
    "PlanError",
    "Planned",
    "QueueFile",
    "Source",
    "Spool",
    "Survey",
    "as_json",
    "as_text",
    "plan_sequence",
]
