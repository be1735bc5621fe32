"""``sacbus monitor`` at run time: what is looked at, signals, and the end.

Owns the life of the monitoring process: it looks for a bus of ours that has the link, otherwise
opens the link itself, and waits for it to come back if that is wanted. A leaf beside the command
line.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any, Final

from sacbus.feed import Feed, SeveralBuses, find
from sacbus.links import LinkError
from sacbus.monitor.output import Output
from sacbus.monitor.sources import watch_feed, watch_link
from sacbus.monitor.wanted import Wanted
from sacbus.signals import heed_signals
from sacbus.watch import Summary

__all__ = ["monitor"]

#: Seconds between two looks for what is waited for.
RETRY: Final = 0.5


async def monitor(wanted: Wanted) -> int:
    """Show what is said until SIGINT (status 130), SIGTERM (0) or a closed terminal (129).

    Raises LinkError when there is nothing to look at, or not any more; KindError for a kind that is
    not installed; and OSError when standard output cannot be written any more (BrokenPipeError:
    its reader has left).
    """
    ended: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def end(status: int) -> None:
        if not ended.done():
            ended.set_result(status)

    def lost(fault: OSError) -> None:
        if not ended.done():
            ended.set_exception(fault)

    heed_signals(end)
    output = Output(wanted, lost)
    session = _Session(wanted, output)
    looking = asyncio.create_task(session.run())
    try:
        either: list[asyncio.Future[Any]] = [ended, looking]  # of an int, and of nothing
        await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
    finally:
        looking.cancel()
        await asyncio.wait([looking])
    # Looked at in any case: what nobody asks for would be complained about.
    failed = None if looking.cancelled() else looking.exception()
    broken = ended.exception() if ended.done() else None
    if output.begun and broken is None:
        output.end(session.summary)
    else:
        output.close()
    if not ended.done() and failed is not None:
        raise failed
    return ended.result()


class _NotYet(Exception):
    """There is still nothing that we may open."""


class _Session:
    """Everything from the first look for the line on."""

    def __init__(self, wanted: Wanted, output: Output) -> None:
        self._wanted = wanted
        self._output = output
        self.summary = Summary()
        #: Whether what was looked at last was a bus's feed.
        self._fed = False

    async def run(self) -> None:
        """Does not return: what was looked at has ended, or is waited for, and that for ever."""
        where = self._wanted.link or "the bus that runs here"
        told = ""
        while True:
            try:
                why = await self._look(waited=bool(told))
            except SeveralBuses:
                raise
            except _NotYet:
                await asyncio.sleep(RETRY)
                continue
            except LinkError as fault:
                if not self._wanted.wait:
                    raise
                why = fault.what
            else:
                told = ""
                if not self._wanted.wait:
                    raise LinkError(why, where, "start it again, or let --wait wait for it")
            if why != told:
                self._output.remark(f"{why}, {where}, waiting for it")
                told = why
            await asyncio.sleep(RETRY)

    async def _look(self, *, waited: bool) -> str:
        """Look at it until it ends; then why. LinkError when it is not there."""
        link = self._wanted.link
        feed = await find(link)
        if feed is None and link is not None and waited:
            feed = await self._look_again(link)
        if feed is not None:
            self._fed = True
            return await watch_feed(feed, self._wanted, self._output, self.summary)
        assert link is not None  # without one, find gives a feed or raises
        return await watch_link(link, self._wanted, self._output, self.summary)

    async def _look_again(self, link: str) -> Feed | None:
        """The feed of a bus that may be just starting: its port is there before its feed is.

        To open that port would take bytes away from the program that it is meant for.
        """
        if self._fed or not _may_be_there(link):
            raise _NotYet
        await asyncio.sleep(RETRY)
        return await find(link)


def _may_be_there(link: str) -> bool:
    return "://" in link or Path(link).exists()
