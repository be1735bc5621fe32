"""What the process holds: pages of memory, and objects that the collector knows.

Owns the bound. What is remembered on purpose (lines, ramps, drives) is all of bounded size and is
there after the warm-up; what grows behind that is a leak. Two counts, since each is blind for
something: pages for objects that hold no others, such as bytes; objects for what is small.
"""

from __future__ import annotations

import gc
import os
from pathlib import Path
from typing import Final, NamedTuple

__all__ = ["MOST", "Held", "held", "warm_up"]

_PAGES: Final = Path("/proc/self/statm")


class Held(NamedTuple):
    """MiB that are resident (0 where the system does not tell), and objects."""

    mib: float
    objects: int

    def __str__(self) -> str:
        return f"{self.mib:.1f} MiB, {self.objects:,} objects"


#: What may come on top after the warm-up, of what is remembered: a leak of four bytes a line, or of
#: an object in 300 lines, is more in ten million.
MOST: Final = Held(32.0, 30_000)


def warm_up(lines: int) -> int:
    """How many of so many lines are the warm-up."""
    return min(lines // 2, 1_000_000)


def held() -> Held:
    """What is held now; garbage is collected first."""
    gc.collect()
    pages = int(_PAGES.read_text().split()[1]) if _PAGES.exists() else 0
    return Held(pages * os.sysconf("SC_PAGE_SIZE") / 2**20, len(gc.get_objects()))
