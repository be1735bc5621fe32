"""The selector of a real-time loop keeps every promise that asyncio relies on; how late it wakes is
measured by the benchmarks, not here.

A promise that is broken may show as a wait without end, so every wait here has a hand that ends it.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
import selectors
import signal
import socket
import sys
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import partial

import pytest

from sacbus.selector import SPIN, FineSelector, real_loop

#: Long enough for any machine; a wait that lasts as long has failed.
NEVER = 30.0

FINE = [False, True]

pytestmark = pytest.mark.parametrize("precise", FINE, ids=["normal", "precise"])


@contextmanager
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.setblocking(False)
        yield ours, theirs


@contextmanager
def descriptors(count: int) -> Iterator[None]:
    """Room for so many descriptors in this process."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < count:
        pytest.skip(f"the system allows {hard} descriptors, {count} are needed")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, count), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@contextmanager
def on_signal(act: Callable[[], object]) -> Iterator[None]:
    """``act`` is called in the middle of a wait, from a signal handler."""
    before = signal.signal(signal.SIGALRM, lambda _number, _frame: act())
    signal.setitimer(signal.ITIMER_REAL, 0.01)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


# ---- as a selector ------------------------------------------------------------------------------


@pytest.mark.parametrize("timeout", [None, NEVER, SPIN / 2, 0, -1])
def test_what_is_ready_is_given_whatever_the_timeout(precise: bool, timeout: float | None) -> None:
    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, theirs):
        key = selector.register(ours, selectors.EVENT_READ | selectors.EVENT_WRITE, "data")
        assert selector.select(timeout) == [(key, selectors.EVENT_WRITE)]
        theirs.send(b"\x06")
        assert selector.select(timeout) == [(key, selectors.EVENT_READ | selectors.EVENT_WRITE)]
        key = selector.modify(ours, selectors.EVENT_READ, "other data")
        assert selector.select(timeout) == [(key, selectors.EVENT_READ)]
        selector.unregister(ours)
        assert not selector.get_map()


@pytest.mark.parametrize("timeout", [0, -1, -1e-9, 1e-9, SPIN / 2, SPIN, 0.01])
def test_a_wait_in_vain_comes_back_with_nothing(precise: bool, timeout: float) -> None:
    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, _):
        selector.register(ours, selectors.EVENT_READ)
        assert selector.select(timeout) == []


def test_a_selector_of_nothing_waits_too(precise: bool) -> None:
    with closing(FineSelector(precise=precise)) as selector:
        assert selector.select(0.001) == []


@pytest.mark.parametrize("timeout", [0.000_01, SPIN, 0.001, 0.01])
def test_a_wait_is_as_long_as_asked_but_for_what_precise_mode_is_to_be_asked_again(
    precise: bool, timeout: float
) -> None:
    # Otherwise the loop would ask again and again for the last of it.
    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, _):
        selector.register(ours, selectors.EVENT_READ)
        before = time.monotonic()
        assert selector.select(timeout) == []
        left = timeout - (time.monotonic() - before)
        assert left <= (SPIN if precise and timeout > SPIN else 0)


@pytest.mark.parametrize("timeout", [None, NEVER])
def test_a_byte_ends_a_wait(precise: bool, timeout: float | None) -> None:
    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, theirs):
        key = selector.register(ours, selectors.EVENT_READ)
        with on_signal(lambda: theirs.send(b"\x06")):
            # The signal alone does not: asyncio has a descriptor of its own for those.
            assert selector.select(timeout) == [(key, selectors.EVENT_READ)]


def test_a_byte_is_noticed_while_precise_mode_spins(
    precise: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sacbus.selector.SPIN", NEVER)
    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, theirs):
        key = selector.register(ours, selectors.EVENT_READ)
        with on_signal(lambda: theirs.send(b"\x06")):
            assert selector.select(NEVER) == [(key, selectors.EVENT_READ)]


def test_what_a_signal_handler_raises_ends_a_wait(precise: bool) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, _):
        selector.register(ours, selectors.EVENT_READ)
        with pytest.raises(KeyboardInterrupt), on_signal(interrupt):
            selector.select(NEVER)


def test_a_descriptor_that_hangs_up_is_ready(precise: bool) -> None:
    with closing(FineSelector(precise=precise)) as selector, pair() as (ours, theirs):
        key = selector.register(ours, selectors.EVENT_READ)
        theirs.close()
        assert selector.select(NEVER) == [(key, selectors.EVENT_READ)]


def test_descriptors_above_1023_are_waited_for(precise: bool) -> None:
    with (
        descriptors(1_200),
        closing(FineSelector(precise=precise)) as selector,
        ExitStack() as stack,
    ):
        ours, theirs = stack.enter_context(pair())
        high = os.dup2(ours.fileno(), 1_100)
        stack.callback(os.close, high)
        key = selector.register(high, selectors.EVENT_READ)
        with on_signal(lambda: theirs.send(b"\x06")):
            assert selector.select(NEVER) == [(key, selectors.EVENT_READ)]


def test_a_selector_whose_own_descriptor_is_above_1023_falls_back_to_the_systems_way(
    precise: bool,
) -> None:
    with descriptors(1_200), ExitStack() as stack:
        for _ in range(1_100):
            stack.callback(os.close, os.open(os.devnull, os.O_RDONLY))
        selector = stack.enter_context(closing(FineSelector(precise=precise)))
        if sys.platform == "linux":
            assert isinstance(selector, selectors.EpollSelector)
            assert selector.fileno() > 1023
        ours, theirs = stack.enter_context(pair())
        key = selector.register(ours, selectors.EVENT_READ)
        assert selector.select(0.001) == []
        with on_signal(lambda: theirs.send(b"\x06")):
            assert selector.select(NEVER) == [(key, selectors.EVENT_READ)]


# ---- in a loop ----------------------------------------------------------------------------------


def run(precise: bool, scene: Callable[[], Awaitable[None]]) -> None:
    async def main() -> None:
        async with asyncio.timeout(NEVER):
            await scene()

    with asyncio.Runner(loop_factory=partial(real_loop, precise=precise)) as runner:
        runner.run(main())


def test_readers_writers_timers_and_threads_work_in_such_a_loop(precise: bool) -> None:
    async def scene() -> None:
        loop = asyncio.get_running_loop()
        happened: list[str] = []
        with pair() as (ours, theirs):
            theirs.setblocking(False)
            done = loop.create_future()

            def writable() -> None:
                loop.remove_writer(ours)
                happened.append("writable")
                ours.send(b"\x02")

            def readable() -> None:
                loop.remove_reader(theirs)
                happened.append(f"read {theirs.recv(1)!r}")
                loop.call_later(0.01, done.set_result, None)

            loop.add_reader(theirs, readable)
            loop.add_writer(ours, writable)
            await done
        await asyncio.to_thread(happened.append, "thread")
        woken = asyncio.Event()
        threading.Timer(0.01, loop.call_soon_threadsafe, (woken.set,)).start()
        await woken.wait()
        assert happened == ["writable", "read b'\\x02'", "thread"]

    run(precise, scene)


def test_a_timer_is_never_called_early(precise: bool) -> None:
    async def scene() -> None:
        loop = asyncio.get_running_loop()
        for seconds in (0.0, 1e-7, 0.000_05, 0.000_3, 0.001_2, 0.01):
            due = loop.time() + seconds
            done: asyncio.Future[float] = loop.create_future()

            def tell(done: asyncio.Future[float] = done) -> None:
                done.set_result(loop.time())

            loop.call_at(due, tell)
            assert await done >= due

    run(precise, scene)


def test_signals_wake_the_loop(precise: bool) -> None:
    async def scene() -> None:
        loop = asyncio.get_running_loop()
        done = loop.create_future()
        loop.add_signal_handler(signal.SIGALRM, done.set_result, None)
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        await done
        loop.remove_signal_handler(signal.SIGALRM)

    run(precise, scene)


def test_ctrl_c_ends_the_run(precise: bool) -> None:
    async def scene() -> None:
        signal.raise_signal(signal.SIGINT)
        await asyncio.get_running_loop().create_future()

    with pytest.raises(KeyboardInterrupt):
        run(precise, scene)


def test_streams_and_processes_work_in_such_a_loop(precise: bool) -> None:
    async def scene() -> None:
        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(await reader.readexactly(4))
            writer.close()
            await writer.wait_closed()

        async with await asyncio.start_server(answer, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"\x02\x01\x0a\x06")
            assert await reader.read() == b"\x02\x01\x0a\x06"
            writer.close()
            await writer.wait_closed()
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", "raise SystemExit(3)")
        assert await process.wait() == 3

    run(precise, scene)


def test_a_loop_with_2000_descriptors_hears_each_of_them(precise: bool) -> None:
    count = 1_000

    async def scene() -> None:
        loop = asyncio.get_running_loop()
        heard: asyncio.Queue[bytes] = asyncio.Queue()

        def hear(end: socket.socket) -> None:
            heard.put_nowait(end.recv(16))

        with ExitStack() as stack:
            pairs = [stack.enter_context(pair()) for _ in range(count)]
            assert max(ours.fileno() for ours, _ in pairs) > 1023
            for ours, _ in pairs:
                loop.add_reader(ours, hear, ours)
            # One at a time, so that each is the one that wakes the loop.
            for number, (_, theirs) in enumerate(pairs):
                theirs.send(b"%d" % number)
                assert await heard.get() == b"%d" % number
            for ours, _ in pairs:
                loop.remove_reader(ours)

    with descriptors(2 * count + 200):
        run(precise, scene)


def test_closing_a_loop_leaves_nothing_and_may_be_repeated(precise: bool) -> None:
    loop = real_loop(precise=precise)
    loop.close()
    loop.close()
    with contextlib.suppress(RuntimeError):
        loop.run_forever()
    assert loop.is_closed()
