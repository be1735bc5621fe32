"""What a line says: bytes or transmissions with their times in, entries out.

``watch.py`` is told what is heard, and tells what belongs together, as entries (``entries.py``);
``stream.py`` gives bytes their times, ``summary.py`` counts. No event loop and no clock: the
monitor runs it on a live line, and what is written down of a line goes through it as well.
"""

from sacbus.watch.entries import (
    Collision,
    Entry,
    Lost,
    Part,
    Reported,
    Spoken,
    Unanswered,
    concerns,
    is_fault,
)
from sacbus.watch.summary import Summary
from sacbus.watch.watch import FEED_SLACK, LINK_SLACK, Watch

__all__ = [
    "FEED_SLACK",
    "LINK_SLACK",
    "Collision",
    "Entry",
    "Lost",
    "Part",
    "Reported",
    "Spoken",
    "Summary",
    "Unanswered",
    "Watch",
    "concerns",
    "is_fault",
]
