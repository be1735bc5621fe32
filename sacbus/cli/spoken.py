"""What a LINK speaks, for the commands that put bytes on one.

Owns the look at that before a byte goes out: to nodes of another protocol the same bytes mean
something else, and some would move. Of a bus that runs here its feed tells; of any other line
nothing does, and it is taken to speak what the command does.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

__all__ = ["check_spoken"]

#: Seconds that the look may take: an emergency stop waits for it.
PATIENCE: Final = 0.5


async def check_spoken(
    link: str, speaks: str | None = None, advice: Mapping[str, str] = MappingProxyType({})
) -> None:
    """LinkError if LINK is that of a bus here which speaks another protocol than ``speaks``.

    ``speaks`` None: what mother does, SAC. ``advice``: what to do about some of the others.
    """
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
    if spoken not in (SPEAKS if speaks is None else (speaks,)):
        sac = speaks is None or speaks in SPEAKS
        commands = "a SAC's commands" if sac else f"messages of {speaks}"
        raise LinkError(
            f"this line speaks {spoken}, to which {commands} mean something else",
            link,
            f"{advice.get(spoken, 'take a master of that protocol')}: nothing was sent",
        )
