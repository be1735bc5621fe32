"""Part programs run, on virtual nodes in virtual time or on a line, and what came of it.

Owns the way from a program's items to nodes that have moved: planning, streaming, counting, looking
on. How each of these is done is known elsewhere (``toolpath``, ``mother``, ``daemon``).
"""

from sacbus.machining.course import Course, TooFar
from sacbus.machining.listing import listing_of
from sacbus.machining.run import Machined, Told, plan_only, rehearse, run_on_link
from sacbus.machining.trail import Trail

__all__ = [
    "Course",
    "Machined",
    "Told",
    "TooFar",
    "Trail",
    "listing_of",
    "plan_only",
    "rehearse",
    "run_on_link",
]
