"""Mother on a LINK, for the commands that speak as she does: SAC, and nothing else.

Owns the look at what a line speaks before a byte goes out. Her bytes mean something else to nodes
of another protocol: some would move. Of a bus that runs here its feed tells; of any other line
nothing does, and it is taken to be a SAC's.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sacbus.mother import Mother

__all__ = ["check_spoken", "mothers_line"]

#: Seconds that the look may take: an emergency stop waits for it.
PATIENCE: Final = 0.5


@asynccontextmanager
async def mothers_line(link: str, baud: int) -> AsyncIterator[Mother]:
    """Mother on a line, for an ``async with`` block; LinkError where it cannot be had."""
    from sacbus.mother import Mother

    await check_spoken(link)
    async with Mother.connect(link, baud=baud) as mother:
        yield mother


async def check_spoken(link: str) -> None:
    """LinkError if LINK is that of a bus here which speaks another protocol than mother."""
    from sacbus.feed import find
    from sacbus.links import LinkError
    from sacbus.mother.request import SPEAKS

    try:
        async with asyncio.timeout(PATIENCE):
            feed = await find(link)
    except TimeoutError:  # who does not say what it speaks may be in need of a stop
        return
    if feed is None:
        return
    spoken = feed.hello.protocol
    await feed.close()
    if spoken not in SPEAKS:
        raise LinkError(
            f"this line speaks {spoken}, to which a SAC's commands mean something else",
            link,
            "take a master of that protocol: nothing was sent",
        )
