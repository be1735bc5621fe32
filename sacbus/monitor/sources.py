"""Where the monitor hears: the feed of a bus of ours, or a link of its own.

Owns both as coroutines that hand entries to a :class:`~sacbus.monitor.output.Output` until what
they look at has ended. Neither ever writes a byte.
"""

from __future__ import annotations

import asyncio
import time

from sacbus import __version__
from sacbus.feed import Feed, Hello, Missed, Reached, Sent, Stopped
from sacbus.kernel import SECOND, LineRate, Ns
from sacbus.links import open_line
from sacbus.monitor.output import Output
from sacbus.monitor.pcap import Looked
from sacbus.monitor.wanted import Wanted
from sacbus.node import KindError, Protocol, Report, find_kind, find_protocol, protocols_of
from sacbus.watch import FEED_SLACK, LINK_SLACK, Summary, Watch

__all__ = ["watch_feed", "watch_link"]

#: The kind whose protocol an unknown line is taken to speak.
DEFAULT_KIND = "sac"


async def watch_feed(feed: Feed, wanted: Wanted, output: Output, summary: Summary) -> str:
    """Show what a bus says of itself, until it ends; then why, in words. Closes the feed."""
    hello = feed.hello
    try:
        watch = Watch(
            _protocol_of(hello, wanted.kind),
            LineRate(hello.baud, hello.bits),
            lanes=hello.lanes,
            slack=_slack(hello),
            summary=summary,
        )
        output.clock.set(hello.time, hello.clock, hello.speed)
        rate = LineRate(hello.baud, hello.bits)
        line = Looked(hello.bus, hello.bus, hello.protocol, rate, hello.lanes, "exact times")
        output.begin(_in_words(hello), _in_fields(hello, wanted.link), line)
        return await _follow(feed, watch, output)
    except ValueError as fault:
        return f"the bus cannot be understood ({fault})"
    finally:
        await feed.close()


async def _follow(feed: Feed, watch: Watch, output: Output) -> str:
    hello = feed.hello
    before = watch.summary.elapsed
    now = hello.time
    why = "the bus was killed"
    try:
        while (line := await feed.read()) is not None:
            match line:
                case Sent():
                    now = max(now, line.end)
                    output.show(watch.sent(line))
                case Report():
                    output.show(watch.reported(line))
                case Reached(reached, clock):
                    now = max(now, reached)
                    output.clock.set(reached, clock, hello.speed)
                    output.show(watch.wake(now))
                case Missed(lines):
                    output.show(watch.lost(lines))
                case Stopped():
                    why = "the bus has ended"
                case Hello():
                    raise ValueError("it says hello twice")
            # What is not read here waits in the daemon, which counts what it cannot keep.
            await output.room()
    finally:
        output.show(watch.end(now))
        watch.summary.elapsed = before + now - hello.time
    return why


async def watch_link(link: str, wanted: Wanted, output: Output, summary: Summary) -> str:
    """Show what comes over a link, until it is gone; then why. LinkError when it cannot be had.

    Times are counted from now on.
    """
    protocol = find_kind(wanted.kind or DEFAULT_KIND).protocol
    rate = LineRate(wanted.baud or protocol.rate.baud, protocol.rate.bits)
    heard = protocol.lanes - 1
    watch = Watch(protocol, rate, first=heard, slack=LINK_SLACK, summary=summary)
    loop = asyncio.get_running_loop()
    gone: asyncio.Future[str] = loop.create_future()
    timer: asyncio.TimerHandle | None = None
    before = summary.elapsed
    async with open_line(link, rate.baud, rts=False) as line:
        start = loop.time()
        output.clock.set(0, time.time_ns())
        looked = Looked(link, None, protocol.name, rate, 1, "times of arrival")
        output.begin(*_of_link(link, protocol, rate), looked)

        def now() -> Ns:
            # Rounded: a timer that fires at its very time must not find itself a nanosecond early.
            return round((loop.time() - start) * SECOND)

        def hear(data: bytes) -> None:
            output.show(watch.read(data, now()))
            arm()

        def wake() -> None:
            output.show(watch.wake(now()))
            arm()

        def arm() -> None:
            nonlocal timer
            if timer is not None:
                timer.cancel()
            when = watch.wake_at()
            timer = None if when is None else loop.call_at(start + when / SECOND, wake)

        def lose(why: str) -> None:
            if not gone.done():
                # Told in full, with where and what to do; of that we have our own.
                gone.set_result(why.partition(f", {link}")[0])

        line.start(hear, lose)
        try:
            return await gone
        finally:
            if timer is not None:
                timer.cancel()
            output.show(watch.end(now()))
            summary.elapsed = before + now()


def _slack(hello: Hello) -> Ns:
    """Real nodes' answers come through an adapter, which holds them back for a while."""
    real = any(way.kind == "adapter" for way in hello.links)
    return LINK_SLACK if real else FEED_SLACK


def _protocol_of(hello: Hello, kind: str | None) -> Protocol:
    """What the bus speaks, from a kind that is installed here; KindError when none speaks it."""
    if kind is not None:
        asked = find_kind(kind)
        spoken = [one for one in protocols_of(asked) if one.name == hello.protocol]
        return spoken[0] if spoken else asked.protocol
    try:
        return find_protocol(hello.protocol, [name for _, name in hello.nodes])
    except KindError as fault:
        raise KindError(f"{fault}, bus {hello.bus}, install the package of its nodes") from fault


def _in_words(hello: Hello) -> str:
    links = ", ".join(way.where for way in hello.links) or "without links"
    return (
        f"bus {hello.bus} ({links}): {len(hello.nodes)} nodes, {hello.protocol} at "
        f"{hello.baud} baud; exact times, senders and collisions from its feed"
    )


def _in_fields(hello: Hello, link: str | None) -> dict[str, object]:
    return {
        "version": __version__,
        "through": "feed",
        "link": link,
        "bus": hello.bus,
        "protocol": hello.protocol,
        "baud": hello.baud,
        "bits": hello.bits,
        "lanes": hello.lanes,
        "nodes": [node for node, _ in hello.nodes],
        "start_ns": hello.time,
    }


def _of_link(link: str, protocol: Protocol, rate: LineRate) -> tuple[str, dict[str, object]]:
    words = (
        f"{link}: {protocol.name} at {rate.baud} baud; times are those of the arrival of bytes here"
    )
    return words, {
        "version": __version__,
        "through": "link",
        "link": link,
        "bus": None,
        "protocol": protocol.name,
        "baud": rate.baud,
        "bits": rate.bits,
        "lanes": 1,
        "nodes": [],
        "start_ns": 0,
    }
