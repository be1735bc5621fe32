"""The three ways of moving the kernel's clock.

A host in real time is tested on a loop in virtual time: its clock is then as exact as the claims.
"""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
from collections.abc import Awaitable, Callable
from math import inf

import pytest

from sacbus.host import (
    BEHIND,
    LEAD,
    LEISURE,
    RealHost,
    Standstill,
    VirtualHost,
    VirtualLoop,
    run_virtual,
)
from sacbus.kernel import MS, SECOND, US, Kernel, Ns
from tests.nodes.sac.bench import NODE, Bench, Said, packet


def beside(wall: Kernel, main: Callable[[asyncio.AbstractEventLoop], Awaitable[None]]) -> None:
    """Run ``main`` on a loop whose wall clock is the kernel ``wall``."""

    async def run() -> None:
        await main(asyncio.get_running_loop())

    run_virtual(wall, run())


def nearly(moment: Ns, expected: Ns) -> bool:
    """A timer in virtual time is a ns or so late, never early."""
    return 0 <= moment - expected < US


# ---- real and scaled ----------------------------------------------------------------------------


def test_in_real_time_an_event_runs_when_the_clock_of_the_loop_says_so() -> None:
    kernel = Kernel()

    async def main() -> Ns:
        loop = asyncio.get_running_loop()
        done: asyncio.Future[Ns] = loop.create_future()
        host = RealHost(kernel, loop)
        kernel.at(3 * MS, lambda: done.set_result(kernel.now))
        host.arrive(lambda: None)  # the event was made outside: the host looks again
        when = await done
        assert host.bus_now() >= 3 * MS
        host.close()
        return when

    assert asyncio.run(main()) == 3 * MS


@pytest.mark.parametrize(("speed", "bus_seconds"), [(1.0, 2), (10.0, 20), (0.5, 1)])
def test_bus_time_is_the_clock_times_speed(speed: float, bus_seconds: int) -> None:
    kernel = Kernel()
    seen: list[Ns] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at(bus_seconds * SECOND // 2, lambda: seen.append(round(loop.time() * 1000)))
        host = RealHost(kernel, loop, speed=speed)
        await asyncio.sleep(2)
        assert nearly(host.bus_now(), bus_seconds * SECOND)
        host.close()

    beside(Kernel(), main)
    assert seen == [1000]


@pytest.mark.parametrize("speed", [0, -1, float("nan")])
def test_time_that_does_not_pass_is_refused(speed: float) -> None:
    async def main(loop: asyncio.AbstractEventLoop) -> None:
        with pytest.raises(ValueError, match=r"speed: expected more than 0, got"):
            RealHost(Kernel(), loop, speed=speed)

    beside(Kernel(), main)


def test_the_clock_may_stand_anywhere_when_the_host_begins() -> None:
    kernel = Kernel(start=5 * SECOND)

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(kernel, loop)
        assert host.bus_now() == 5 * SECOND
        await asyncio.sleep(1)
        assert nearly(host.bus_now(), 6 * SECOND)
        host.close()

    beside(Kernel(start=123 * SECOND), main)


def test_what_comes_in_finds_bus_time_up_to_date() -> None:
    kernel = Kernel()
    seen: list[Ns] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(kernel, loop)
        await asyncio.sleep(0.25)
        assert kernel.now < 250 * MS  # nothing was due, so nobody moved the clock
        host.arrive(lambda: seen.append(kernel.now))
        host.close()

    beside(Kernel(), main)
    assert len(seen) == 1
    assert nearly(seen[0], 250 * MS)


def test_what_comes_in_may_bring_the_next_event_forward() -> None:
    kernel = Kernel()
    seen: list[int] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at(10 * SECOND, lambda: None)
        host = RealHost(kernel, loop)
        host.arrive(lambda: kernel.at(SECOND, lambda: seen.append(round(loop.time()))))
        await asyncio.sleep(5)
        host.close()

    beside(Kernel(), main)
    assert seen == [1]


def test_a_late_awakening_delays_an_event_and_shifts_none() -> None:
    wall, kernel = Kernel(), Kernel()
    seen: list[tuple[Ns, Ns]] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        for when in (10 * MS, 20 * MS, 90 * MS):
            kernel.at(when, lambda: seen.append((kernel.now, wall.now // MS * MS)))
        host = RealHost(kernel, loop)
        wall.run_until(50 * MS)  # as if the process had been away
        await asyncio.sleep(1)
        host.close()

    beside(wall, main)
    assert seen == [(10 * MS, 50 * MS), (20 * MS, 50 * MS), (90 * MS, 90 * MS)]


def test_after_close_nothing_runs_and_closing_again_is_no_mistake() -> None:
    kernel = Kernel()
    ran: list[str] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at(MS, ran.append, "event")
        host = RealHost(kernel, loop)
        host.close()
        host.close()
        host.arrive(ran.append, "arrival")
        await asyncio.sleep(1)

    beside(Kernel(), main)
    assert ran == []


# ---- quiet events -------------------------------------------------------------------------------


def seen_by(wall: Kernel, kernel: Kernel, seen: list[tuple[Ns, Ns]]) -> Callable[[], object]:
    """An event that notes the bus time and the wall time, in whole us, at which it ran."""
    return lambda: seen.append((kernel.now, wall.now // US * US))


def test_quiet_events_wait_for_each_other_but_not_for_long_and_keep_their_bus_times() -> None:
    wall, kernel = Kernel(), Kernel()
    seen: list[tuple[Ns, Ns]] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        for when in (10 * MS, 11 * MS, 10 * MS + LEISURE, 30 * MS):
            kernel.at_leisure(when, seen_by(wall, kernel, seen))
        host = RealHost(kernel, loop)
        await asyncio.sleep(1)
        host.close()

    beside(wall, main)
    together = 10 * MS + LEISURE
    assert seen == [
        (10 * MS, together),
        (11 * MS, together),
        (together, together),
        (30 * MS, 30 * MS + LEISURE),
    ]


@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0])
def test_how_long_quiet_events_may_wait_is_wall_time_whatever_the_speed(speed: float) -> None:
    wall, kernel = Kernel(), Kernel()
    seen: list[tuple[Ns, Ns]] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at_leisure(round(10 * MS * speed), seen_by(wall, kernel, seen))
        kernel.at(round(40 * MS * speed), lambda: None)
        kernel.at_leisure(round(38 * MS * speed), seen_by(wall, kernel, seen))
        host = RealHost(kernel, loop, speed=speed)
        await asyncio.sleep(1)
        host.close()

    beside(wall, main)
    assert [at for _, at in seen] == [10 * MS + LEISURE, 40 * MS - LEAD]


def test_quiet_events_run_some_time_before_one_that_is_not_so_that_it_is_not_kept_waiting() -> None:
    wall, kernel = Kernel(), Kernel()
    seen: list[tuple[Ns, Ns]] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        loud, close = 20 * MS, 20 * MS - LEAD // 2
        kernel.at(loud, seen_by(wall, kernel, seen))
        for when in (17 * MS, 18 * MS, close):
            kernel.at_leisure(when, seen_by(wall, kernel, seen))
        host = RealHost(kernel, loop)
        await asyncio.sleep(1)
        host.close()
        # The last one cannot run any earlier.
        early = loud - LEAD
        assert seen == [(17 * MS, early), (18 * MS, early), (close, close), (loud, loud)]

    beside(wall, main)


def test_quiet_events_that_are_due_have_run_before_anything_that_comes_in() -> None:
    kernel = Kernel()
    seen: list[str] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at_leisure(10 * MS, seen.append, "quiet")
        kernel.at_leisure(13 * MS, seen.append, "not yet due")
        host = RealHost(kernel, loop)
        await asyncio.sleep(0.012)
        assert seen == []
        host.arrive(seen.append, "arrival")
        host.close()

    beside(Kernel(), main)
    assert seen == ["quiet", "arrival"]


def test_lateness_and_spare_time_are_of_events_that_are_not_quiet() -> None:
    wall, kernel = Kernel(), Kernel()
    told: list[Ns] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(kernel, loop)
        host.late_watcher = told.append
        host.arrive(kernel.at_leisure, 10 * MS, lambda: None)
        assert host.spare() == inf
        host.arrive(kernel.at, 60 * MS, lambda: None)
        assert host.spare() == pytest.approx(0.06)
        wall.run_until(50 * MS)  # as if the process had been away
        await asyncio.sleep(1)
        host.close()
        assert kernel.ran == 2
        assert host.lateness.count == 1
        assert host.lateness.worst < US

    beside(wall, main)
    assert told == []


def busy_bench() -> Bench:
    """Ten nodes that are told to move, and to stop, all the time; many motions are short."""
    bench = Bench(*range(10, 20))
    for number in range(40):
        line = ("m21v300a5d5", "m-7v60", "S", "m400v200a2d2", "m1v300", "m-1")[number % 6]
        send, data = bench.bus.medium.transmit, packet(line, 10 + number % 10)
        bench.kernel.at(number * 17 * MS, send, bench.port, data, 0)
    return bench


@pytest.mark.parametrize("away", [0, 3 * MS, 40 * MS])
def test_a_bus_in_real_time_comes_to_what_it_comes_to_in_virtual_time(away: Ns) -> None:
    wall, real, virtual = Kernel(), busy_bench(), busy_bench()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(real.kernel, loop)
        for _ in range(100):
            await asyncio.sleep(0.03)
            wall.run_until(wall.now + away)  # as if the process had been away
        host.close()

    beside(wall, main)
    assert len(real.answers) == 40
    for bench in (real, virtual):
        bench.kernel.run_until(10 * SECOND)
    assert real.transcript() == virtual.transcript()


def test_whoever_looks_at_nodes_sees_them_as_they_are_though_their_events_wait() -> None:
    real, virtual = busy_bench(), busy_bench()
    waited = 0

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        nonlocal waited
        host = RealHost(real.kernel, loop)
        for _ in range(1_000):
            await asyncio.sleep(0.000_7)
            due = real.kernel.next_at()
            waited += due is not None and due + US < host.bus_now()
            host.arrive(lambda: None)
            virtual.kernel.run_until(real.kernel.now)
            assert real.transcript() == virtual.transcript()
        host.close()

    beside(Kernel(), main)
    assert waited > 5


# ---- lateness -----------------------------------------------------------------------------------


def test_how_late_events_ran_is_measured_one_by_one() -> None:
    wall, kernel = Kernel(), Kernel()
    lateness: list[int] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        for when in (10 * MS, 20 * MS, 90 * MS):
            kernel.at(when, lambda: None)
        host = RealHost(kernel, loop)
        wall.run_until(50 * MS)  # as if the process had been away
        await asyncio.sleep(1)
        host.close()
        lateness.extend((host.lateness.count, host.lateness.worst, host.lateness.p50))

    beside(wall, main)
    count, worst, half = lateness
    assert count == 3
    assert nearly(worst, 40 * MS)
    assert half == pytest.approx(30 * MS, rel=0.04)


def test_an_event_that_takes_long_makes_the_next_one_late() -> None:
    wall, kernel = Kernel(), Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at(10 * MS, lambda: wall.run_until(wall.now + 7 * MS))
        kernel.at(10 * MS + 1, lambda: None)
        host = RealHost(kernel, loop)
        # Both are due when something comes in, before the timer of the first has fired.
        wall.run_until(10 * MS + 1)
        host.arrive(lambda: None)
        assert host.lateness.count == 2
        assert nearly(host.lateness.worst, 7 * MS)
        host.close()

    beside(wall, main)


def test_events_of_one_instant_count_once() -> None:
    kernel = Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        for _ in range(10):
            kernel.at(10 * MS, lambda: None)
        host = RealHost(kernel, loop)
        await asyncio.sleep(1)
        host.close()
        assert host.lateness.count == 1
        assert host.lateness.worst < US

    beside(Kernel(), main)


@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0])
def test_lateness_is_wall_time_whatever_the_speed(speed: float) -> None:
    wall, kernel = Kernel(), Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at(round(10 * MS * speed), lambda: None)
        host = RealHost(kernel, loop, speed=speed)
        wall.run_until(15 * MS)
        await asyncio.sleep(1)
        host.close()
        assert nearly(host.lateness.worst, 5 * MS)

    beside(wall, main)


def test_what_runs_ahead_is_not_late() -> None:
    bench = Bench()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(bench.kernel, loop, line_free_at=lambda: bench.bus.medium.free_at(0))
        for _ in range(10):
            host.arrive(bench.port.talk, packet("v100"))
            await asyncio.sleep(0.1)
        assert len(bench.heard) == 10
        assert host.lateness.count == 0
        host.close()

    beside(Kernel(), main)


def test_a_machine_that_cannot_keep_up_is_told_of_with_the_worst_but_once_a_second() -> None:
    wall, kernel = Kernel(), Kernel()
    told: list[tuple[float, Ns]] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(kernel, loop)
        host.late_watcher = lambda late: told.append((round(loop.time(), 2), late // MS))
        for when, late in (
            (1_000, BEHIND // MS),
            (2_000, 20),
            (2_400, 50),
            (2_600, 30),
            (3_050, 11),
            (3_500, 40),
            (5_000, 12),
        ):
            for moment in (when, when + 1):  # the worst of what is late together counts
                host.arrive(kernel.at, moment * MS, lambda: None)
            await asyncio.sleep(when / 1_000 - loop.time() - 0.001)
            wall.run_until((when + late) * MS)  # as if the process had been away
        await asyncio.sleep(1)
        host.close()
        assert host.lateness.count == 14

    beside(wall, main)
    assert told == [(2.02, 20), (3.06, 50), (5.01, 40)]


def test_with_nobody_to_tell_a_machine_that_cannot_keep_up_goes_on() -> None:
    wall, kernel = Kernel(), Kernel()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        kernel.at(10 * MS, lambda: None)
        loop.set_exception_handler(lambda _loop, context: failed.append(context))
        host = RealHost(kernel, loop)
        wall.run_until(SECOND)
        await asyncio.sleep(1)
        assert host.lateness.worst >= 990 * MS
        host.close()

    failed: list[object] = []
    beside(wall, main)
    assert failed == []


# ---- running ahead ------------------------------------------------------------------------------


def test_without_pace_an_answer_is_there_at_once_and_took_its_line_time() -> None:
    bench = Bench()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(bench.kernel, loop, line_free_at=lambda: bench.bus.medium.free_at(0))
        before = loop.time()
        for _ in range(100):
            host.arrive(bench.port.talk, packet("v100"))
            host.arrive(lambda: bench.kernel.run_until(bench.kernel.now + 2 * MS))
        assert len(bench.heard) == 100
        assert loop.time() == before
        host.close()

    beside(Kernel(), main)
    paced = Bench()
    for number in range(2):
        paced.sends(packet("v100"), at=bench.heard[number].at - bench.heard[0].at)
        paced.run()
    assert paced.heard == bench.heard[:2]


def test_without_pace_motion_still_keeps_the_time_of_the_clock() -> None:
    bench = Bench()
    states: list[str] = []

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        host = RealHost(bench.kernel, loop, line_free_at=lambda: bench.bus.medium.free_at(0))
        host.arrive(bench.port.talk, packet("m200v100a1d1"))
        assert bench.answers == [bytes((2, 1, NODE, 6))]
        # The manual's command takes 1.469 s from the end of its packet; the line took no time.
        for wait in (0, 1.465, 0.005):
            await asyncio.sleep(wait)
            host.arrive(lambda: states.append(bench.node.snapshot(bench.kernel.now).state))
        host.close()

    beside(Kernel(), main)
    assert states == ["ACCEL", "DECEL", "STANDBY"]


def test_without_pace_what_stands_already_comes_as_much_earlier_as_the_line_ran_ahead() -> None:
    bench = Bench()

    async def main(loop: asyncio.AbstractEventLoop) -> None:
        bench.kernel.at(SECOND, lambda: None)
        host = RealHost(bench.kernel, loop, line_free_at=lambda: bench.bus.medium.free_at(0))
        host.arrive(bench.port.talk, packet("v100"))
        assert bench.kernel.now > 3 * MS
        await asyncio.sleep(1)
        assert host.lateness.count == 1
        assert host.lateness.worst < US
        host.close()

    beside(Kernel(), main)


# ---- virtual ------------------------------------------------------------------------------------


def test_virtual_time_jumps_to_the_next_event_or_timer_whichever_comes_first() -> None:
    kernel = Kernel()
    seen: list[tuple[str, float]] = []

    async def main() -> str:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        kernel.at(1500 * MS, lambda: seen.append(("event", loop.time())))
        await asyncio.sleep(1)
        seen.append(("timer", round(loop.time(), 6)))
        await asyncio.sleep(3600)
        seen.append(("timer", round(loop.time(), 6)))
        return "done"

    assert run_virtual(kernel, main()) == "done"
    assert seen == [("timer", 1.0), ("event", 1.5), ("timer", 3601.0)]


@pytest.mark.parametrize("seconds", [1e-9, 0.05, 0.1 + 0.2, 0.2 - 0.05, 1 / 3, 86_400.1])
def test_a_timer_is_never_early_and_less_than_a_microsecond_late(seconds: float) -> None:
    kernel = Kernel()

    async def main() -> None:
        await asyncio.sleep(seconds)

    run_virtual(kernel, main())
    assert nearly(kernel.now, int(seconds * SECOND))


def test_an_event_wakes_the_coroutine_that_waits_for_it() -> None:
    kernel = Kernel()

    async def main() -> Ns:
        done: asyncio.Future[Ns] = asyncio.get_running_loop().create_future()
        kernel.at(7 * MS, lambda: done.set_result(kernel.now))
        return await done

    assert run_virtual(kernel, main()) == 7 * MS


def test_waiting_for_what_nothing_will_ever_bring_is_an_error_and_not_a_hang() -> None:
    async def main() -> None:
        await asyncio.get_running_loop().create_future()

    with pytest.raises(Standstill, match="virtual time stands still"):
        run_virtual(Kernel(), main())


def test_a_descriptor_that_becomes_ready_is_noticed_in_virtual_time() -> None:
    async def main() -> bytes:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            ours.setblocking(False)
            theirs.send(b"\x06")
            return await asyncio.get_running_loop().sock_recv(ours, 1)

    assert run_virtual(Kernel(), main()) == b"\x06"


@pytest.mark.skipif(sys.platform == "win32", reason="its loops take no signals")
def test_a_signal_is_noticed_in_virtual_time() -> None:
    async def main() -> str:
        loop = asyncio.get_running_loop()
        came: asyncio.Future[str] = loop.create_future()
        loop.add_signal_handler(signal.SIGUSR1, came.set_result, "noticed")
        os.kill(os.getpid(), signal.SIGUSR1)
        for _ in range(3):
            await asyncio.sleep(0)
        async with asyncio.timeout(1):
            return await came

    assert run_virtual(Kernel(), main()) == "noticed"


@pytest.mark.skipif(sys.platform == "win32", reason="its loops take no signals")
def test_a_signal_is_noticed_in_virtual_time_while_there_is_always_something_to_do() -> None:
    async def main() -> int:
        loop = asyncio.get_running_loop()
        came = asyncio.Event()
        loop.add_signal_handler(signal.SIGUSR1, came.set)
        os.kill(os.getpid(), signal.SIGUSR1)
        for turn in range(100_000):
            if came.is_set():
                return turn
            await asyncio.sleep(0)
        return -1

    assert run_virtual(Kernel(), main()) >= 0


def test_what_arrives_at_a_virtual_host_is_taken_in_at_once() -> None:
    kernel = Kernel()
    host = VirtualHost(kernel)
    seen: list[Ns] = []
    kernel.run_until(5)
    host.arrive(lambda: seen.append(kernel.now))
    host.close()
    host.close()
    assert seen == [5]
    assert host.lateness.count == 0


def test_a_virtual_run_is_the_same_every_time() -> None:
    def run() -> tuple[list[object], list[Said]]:
        bench = Bench(*range(10, 20))
        host = VirtualHost(bench.kernel)

        async def talk(address: int) -> None:
            for number in range(5):
                await asyncio.sleep(0.001 * address)
                host.arrive(bench.port.talk, packet(f"m{number + 1}00v200", address))

        async def main() -> None:
            await asyncio.gather(*map(talk, range(10, 20)))
            await asyncio.sleep(3)

        run_virtual(bench.kernel, main())
        return bench.transcript(), bench.heard

    first, heard = run()
    assert any(len(said.data) == 4 for said in heard)
    assert run()[0] == first


def test_an_event_that_fails_does_not_stop_the_clock() -> None:
    async def scene() -> list[Ns]:
        kernel = Kernel()
        loop = asyncio.get_running_loop()
        failed: list[object] = []
        loop.set_exception_handler(lambda _loop, context: failed.append(context["exception"]))
        ran: list[Ns] = []
        kernel.at(1 * MS, lambda: 1 // 0)
        kernel.at(5 * MS, lambda: ran.append(kernel.now))
        host = RealHost(kernel, loop)
        async with asyncio.timeout(10):
            while not ran:  # noqa: ASYNC110 (bus time in real time has no event to wait on)
                await asyncio.sleep(0)
        host.close()
        assert [type(one) for one in failed] == [ZeroDivisionError]
        return ran

    assert asyncio.run(scene()) == [5 * MS]


def test_a_coroutine_that_an_event_wakes_finds_the_clock_at_that_event() -> None:
    kernel = Kernel()

    async def main() -> list[Ns]:
        loop = asyncio.get_running_loop()
        found = []
        for number in range(20):  # beside them, events that nobody waits for
            kernel.at(number * MS, lambda: None)
        for wake in ("future", "timer", "thread-safe"):
            woken: asyncio.Future[None] = loop.create_future()
            match wake:
                case "future":
                    kernel.at(kernel.now + 2_500 * US, woken.set_result, None)
                case "timer":
                    kernel.at(kernel.now + 2_500 * US, loop.call_later, 0, woken.set_result, None)
                case _:
                    wakes = loop.call_soon_threadsafe
                    kernel.at(kernel.now + 2_500 * US, wakes, woken.set_result, None)
            await woken
            found.append(kernel.now)
        return found

    found = run_virtual(kernel, main())
    assert found[0] == 2_500 * US
    assert found[1] - found[0] in (2_500 * US, 2_500 * US + 1)
    assert found[2] - found[1] == 2_500 * US
