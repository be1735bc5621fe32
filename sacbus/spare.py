"""Work that must cost the line nothing: done in pieces, when nothing on the bus is due.

Owns when such work runs. A job is a generator that yields between pieces of some 20 us each and
returns what it has made; what it makes is its own business.

Theory of operation. The line and everybody who waits share one thread with the job. So a job runs
for 0.1 ms at a time, between two turns of the loop: whoever has sent something waits no longer than
that. And no such slice begins when an event of the bus is due soon: an event would be late by what
is left of the slice. (The alternative, a thread, takes the interpreter's lock for up to 5 ms at a
time.) On a line that is never idle for long enough the job goes on all the same after a while.
"""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Sequence
from typing import Final, TypeVar

from sacbus.host import Host

__all__ = ["Job", "at_once", "in_spare_time"]

_T = TypeVar("_T")

Job = Generator[None, None, _T]

#: Seconds of work between two turns of the loop; about what a turn is late by anyhow.
SLICE: Final = 0.000_1

#: No slice begins when something is due within these seconds: a slice, a slow last piece, and the
#: way back into the loop's sleep, from which it wakes on time.
CLEAR: Final = 0.000_5

#: Seconds after an event that a job that gives way to it asks again: by then it has run.
BEHIND_IT: Final = 0.000_01

#: Seconds that a job waits for its turns, all in all; then it no longer asks.
PATIENCE: Final = 0.1


async def in_spare_time(job: Job[_T], hosts: Sequence[Host]) -> _T:
    """Run ``job`` to its end beside what the hosts run; what it returns."""
    clock = asyncio.get_running_loop().time
    patience = PATIENCE
    while True:
        # Whatever has arrived, or is due, goes first: the loop looks for it in its next turn, and
        # runs it in the same turn, but behind those who were waiting for that turn already.
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        while patience > 0 and (spare := min(host.spare() for host in hosts)) < CLEAR:
            began = clock()
            await asyncio.sleep(spare + BEHIND_IT)
            patience -= clock() - began
        until = clock() + SLICE
        try:
            while clock() < until:
                next(job)
        except StopIteration as done:
            made: _T = done.value
            return made


def at_once(job: Job[_T]) -> _T:
    """Run ``job`` to its end, whoever waits; what it returns."""
    while True:
        try:
            next(job)
        except StopIteration as done:
            made: _T = done.value
            return made
