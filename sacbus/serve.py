"""``sacbus serve`` at run time: buses, signals, and the order in which things begin and end.

Owns the life of the serving process from the first line printed to the exit status. A leaf beside
the command line.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
from collections.abc import Sequence
from contextlib import AsyncExitStack
from functools import partial
from pathlib import Path
from typing import Any, Final

from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.feed import FeedServer
from sacbus.notify import notify
from sacbus.output import output_for
from sacbus.signals import heed_signals
from sacbus.spare import at_once, in_spare_time
from sacbus.trace.recorder import Recorder

__all__ = ["serve"]

#: Seconds after which what has been recorded is in its file, also when nothing more happens.
SAVED_EVERY: Final = 0.5


async def serve(
    configurations: Sequence[Configuration],
    *,
    as_json: bool,
    show_table: bool,
    record: Path | None = None,
) -> int:
    """Host buses until SIGINT (status 130), SIGTERM (0) or a closed terminal (129).

    ``record``: where to record all that happens, a file that is written anew. When that cannot be
    written on, the buses go on, a report says so, and RecordingCutOff is raised at the end.

    Raises what :func:`~sacbus.daemon.open_bus` does, and OSError when standard output cannot be
    written any more (BrokenPipeError: its reader has left); the buses are closed in order then too.
    """
    ended: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def end(status: int) -> None:
        if not ended.done():
            ended.set_result(status)

    def lost(fault: OSError) -> None:
        if not ended.done():
            ended.set_exception(fault)

    # Before anything is opened: a signal at any instant ends in an orderly close.
    heed_signals(end)
    async with AsyncExitStack() as stack:
        buses = [await stack.enter_async_context(open_bus(one)) for one in configurations]
        recorder = None
        if record is not None:
            sink = stack.enter_context(record.open("wb", buffering=0))
            recorder = stack.enter_context(Recorder(buses, sink))
        for bus in buses:
            feed = FeedServer(bus)
            await feed.open()
            stack.callback(feed.close)
        # What there is by now stays. To look through all of it for garbage would take 30 ms with
        # 250 nodes, in which the line stands still; what is made from now on is little.
        gc.collect()
        gc.freeze()
        # A key that came while a SAC boots would restore its factory settings.
        await _boot(buses, ended)
        output = output_for(buses, lost, as_json=as_json, show_table=show_table)
        output.ready()
        for bus in buses:
            for report in bus.bus.reports:
                output.report(bus, report)
            bus.bus.report_watchers.append(partial(output.report, bus))
            bus.host.late_watcher = partial(output.late, bus)
        notify("READY=1")
        while not ended.done():
            await in_spare_time(output.drawing(), [bus.host for bus in buses])
            interval = output.interval
            if recorder is not None:
                recorder.flush()
                interval = min(interval or SAVED_EVERY, SAVED_EVERY)
            await asyncio.wait([ended], timeout=interval)
        notify("STOPPING=1")
        at_once(output.drawing())
        status = ended.result()
    output.stopped()
    output.close()
    if recorder is not None and recorder.fault is not None:
        raise recorder.fault
    return status


async def _boot(buses: Sequence[HostedBus], ended: asyncio.Future[int]) -> None:
    """Wait until all nodes obey, or until a signal has come."""
    booting = asyncio.gather(*(bus.booted() for bus in buses))
    either: tuple[asyncio.Future[Any], ...] = (ended, booting)  # they give different things
    await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
    booting.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await booting
