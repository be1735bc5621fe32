"""Mother on a LINK, for the commands that speak as she does: SAC, and nothing else."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from sacbus.cli.spoken import check_spoken

if TYPE_CHECKING:
    from sacbus.mother import Mother

__all__ = ["mothers_line"]


@asynccontextmanager
async def mothers_line(link: str, baud: int) -> AsyncIterator[Mother]:
    """Mother on a line, for an ``async with`` block; LinkError where it cannot be had."""
    from sacbus.mother import Mother

    await check_spoken(link)
    async with Mother.connect(link, baud=baud) as mother:
        yield mother
