"""How fast motion is: pulse times, positions, memory, and 762 engines in real time.

*Pulse times.* Queues of 30 commands at 16 microsteps, each planned and asked for all its pulse
times as one array; beside ``numpy.cumsum`` over an array of as many periods, the least that any
method must do, and beside the reference of the tests, which makes one pulse after the other.

*Engines in real time.* 762 nodes on 4 buses in this process, run by the host that ``serve`` uses,
at wall time. Each runs its queue of one-second commands: from rest to 33.3 kHz (16 microsteps,
vc480), cruise, and to rest again, one way and the other. Their ends are spread over the second, so
that nothing is done for two at a time. Nobody asks for pulses, and the line is quiet: queues are
filled between the spells that are measured, by broadcasts in virtual time. The figure is processor
time of the whole process: the ends and beginnings of commands, the kernel, and the event loop.
Nobody could tell when within some ms a command ends, so the host ends several at one wake-up. The
baseline is as many appointments at which nothing is done, each punctual: 762 wake-ups a second.
"""

from __future__ import annotations

import asyncio
import statistics
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import cycle

import numpy as np

from benchmarks.figure import Figure, alternate, seconds
from nodes.sac import KIND, SacNode, SacSettings
from sacbus.bus import Bus, Port
from sacbus.host import RealHost
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.language import Defaults, Motion
from sacbus.mother import safe_body
from sacbus.motion import Drive, Profile, Rpm, plan
from sacbus.selector import real_loop
from sacbus.wire import GENERAL_CALL, MOTHER, encode
from tests.motion.reference import Setup, run

QUEUE = 30
DRIVE = Drive(ustep=4)

NODES = 762
BUSES = 4
FIRST = 10
#: Seconds of wall time in a round of engines; less says little on a machine with neighbours.
SPELL = 3.0
#: 61 steps up to 625 RPM, 1 495 at 33.3 kHz of pulses, 61 down: 0.9999 s.
SECOND_LONG = b"m%s1617vc480a10d10"


def queue(kinds: Sequence[bool]) -> list[Motion]:
    """Commands of about a second each, harmonic or linear, with ramps of all lengths."""
    commands = []
    for number, linear in zip(range(QUEUE), cycle(kinds), strict=False):
        rpm = 60 + 18 * number
        # Every third goes on at its velocity into the next.
        dec100 = 99_900 if number % 3 == 1 else 100 + 10 * number
        commands.append(
            Motion(
                steps=rpm * 4,
                cw=number % 4 != 0,
                rpm=rpm,
                cycle_us=Defaults().cycle_of(rpm),
                acc100=(3_000 if linear else 50) + 40 * number,
                dec100=dec100 * (5 if linear and dec100 < 10_000 else 1),
                linear=linear,
            )
        )
    return commands


def through(commands: Sequence[Motion], begin: Callable[[Motion, Rpm], Profile]) -> int:
    """Plan commands one after the other, each at the velocity kept; all pulse times; how many."""
    kept: Rpm = 0
    pulses = 0
    for motion in commands:
        profile = begin(motion, kept)
        assert profile.duration is not None
        pulses += profile.pulse_times(0, profile.duration).size
        kept = profile.kept_rpm
    return pulses


def one_by_one(commands: Sequence[Motion]) -> int:
    """The same by the reference."""
    setup = Setup(ustep=DRIVE.ustep)
    kept: Rpm = 0
    pulses = 0
    for motion in commands:
        done = run(motion, setup, kept)
        pulses += len(done.times)
        kept = done.kept
    return pulses


def pulse_times(rounds: int) -> list[Figure]:
    found = []
    planned = partial(plan, drive=DRIVE)
    for name, kinds in (
        ("harmonic", (False,)),
        ("linear", (True,)),
        ("mixed", (False, True, True, False)),
    ):
        commands = queue(kinds)
        act = partial(through, commands, lambda motion, kept: planned(motion, start_rpm=kept))
        count = act()
        periods = np.full(count, 100, dtype=np.int64)
        took, baseline = alternate(act, partial(np.cumsum, periods), rounds)
        found.append(
            Figure(
                f"pulse times, {name} queue",
                count / took / 1e6,
                "M pulses/s",
                baseline / took,
                f"cumsum of {count:,} periods",
                150.0,
                "value, at least",
            )
        )
        few = commands[::10]
        slow = statistics.median(seconds(partial(one_by_one, few)) for _ in range(3))
        assert one_by_one(few) == through(few, lambda motion, kept: planned(motion, start_rpm=kept))
        rate = one_by_one(few) / slow
        found.append(
            Figure(
                f"the same of {len(few)} of its commands, one by one",
                rate / 1e6,
                "M pulses/s",
                count / took / rate,
                "of that is the above",
                100.0,
                "ratio, at least",
            )
        )
    return found


def positions(rounds: int) -> Figure:
    """Where 250 motors stand, at one instant after the other."""
    commands = [replace(one, steps=20_000) for one in queue((False, True))]
    profiles = [plan(motion, DRIVE) for motion, _ in zip(cycle(commands), range(250), strict=False)]
    instants = range(1_000_000, 41_000_000, 2_000_000)

    def ask() -> None:
        for at in instants:
            for profile in profiles:
                profile.pulses_at(at)

    def divide(at: int) -> int:
        return at // 60 + 1

    def baseline() -> None:
        for at in instants:
            for _ in profiles:
                divide(at)

    ask()
    took, least = alternate(ask, baseline, rounds)
    asked = len(instants) * len(profiles)
    return Figure(
        "positions of 250 profiles", asked / took, "queries/s", least / took, "a call that divides"
    )


class Floor:
    """Several buses full of nodes on one kernel, each with mother's end of the line."""

    def __init__(self, nodes: int, buses: int) -> None:
        self.kernel = Kernel()
        self.buses = [Bus(self.kernel, KIND.protocol) for _ in range(buses)]
        self.ports = [Port(bus.medium, lambda _heard, _now: None, latency=0) for bus in self.buses]
        settings = SacSettings(ustep=4)
        self.nodes: list[SacNode] = []
        for number in range(nodes):
            bus = self.buses[number % buses]
            node = KIND.create(FIRST + number // buses, settings, bus.rate, bus.tell)
            self.nodes.append(node)
            bus.add(node)

    def start(self) -> None:
        """One command each, at its own time of the second, and some more to follow."""
        wait = SECOND // len(self.nodes)
        begin = 4 * SECOND
        for number, node in enumerate(self.nodes):
            port = self.ports[number % len(self.ports)]
            self.kernel.run_until(self.kernel.now + 16 * MS // len(self.ports))
            later = (begin + number * wait - self.kernel.now) // 1_000
            line = SECOND_LONG % b"" + b"t%d" % later
            port.talk(encode(node.address, MOTHER, safe_body(line)))
        self.fill(2)
        self.kernel.run_until(begin + SECOND)

    def fill(self, commands: int) -> None:
        """Broadcast some more commands to everybody, one way and the other."""
        for number in range(commands):
            self.kernel.run_until(self.kernel.now + 20 * MS)
            line = safe_body(SECOND_LONG % (b"" if number % 2 else b"-"))
            for port in self.ports:
                port.talk(encode(GENERAL_CALL, MOTHER, line))
        self.check()

    def check(self) -> None:
        """Nothing was lost, and nothing overrun; that 625 RPM is fast may be said."""
        for bus in self.buses:
            assert bus.report_counts.keys() <= {"warning"}, bus.report_counts

    def moving(self) -> int:
        """How many are in motion."""
        now = self.kernel.now
        return sum(node.state(now) in ("ACCEL", "CRUISE", "DECEL") for node in self.nodes)


def bytes_of_a_node() -> tuple[float, float, float]:
    """What a node takes that stands, that moves, and that moves and was asked where it is.

    Of 240 that are alike; what they share is not counted, as the tables of their ramps.
    """
    warm = Floor(240, 1)
    warm.start()
    tracemalloc.start()
    began = tracemalloc.get_traced_memory()[0]
    floor = Floor(240, 1)
    found = [tracemalloc.get_traced_memory()[0] - began]
    floor.ports[0].talk(encode(GENERAL_CALL, MOTHER, safe_body(SECOND_LONG % b"")))
    floor.kernel.run_until(SECOND // 2)
    found.append(tracemalloc.get_traced_memory()[0] - began)
    for node in floor.nodes:
        assert node.snapshot(floor.kernel.now).rpm == 625
    found.append(tracemalloc.get_traced_memory()[0] - began)
    tracemalloc.stop()
    still, moving, asked = (size / len(floor.nodes) for size in found)
    return still, moving, asked


def memory() -> list[Figure]:
    still, moving, asked = bytes_of_a_node()
    stands = "one that stands"
    return [
        Figure(
            "memory of a node that moves",
            moving,
            "bytes",
            moving / still,
            stands,
            4_096.0,
            "value, at most",
        ),
        Figure(
            "the same, asked where it is",
            asked,
            "bytes",
            asked / still,
            stands,
            4_096.0,
            "value, at most",
        ),
    ]


async def spell(kernel: Kernel) -> float:
    """Share of a core that a kernel in real time takes."""
    host = RealHost(kernel, asyncio.get_running_loop())
    wall, used = time.perf_counter(), time.process_time()
    await asyncio.sleep(SPELL)
    share = (time.process_time() - used) / (time.perf_counter() - wall)
    host.close()
    return share


def nothing_much(kernel: Kernel) -> None:
    """As many appointments a second as there are engines, and nothing done at them but in time."""

    def happen(when: Ns) -> None:
        kernel.at(when + SECOND, happen, when + SECOND)

    for number in range(NODES):
        when = kernel.now + number * SECOND // NODES
        kernel.at(when, happen, when)


def engines(rounds: int) -> Figure:
    """762 of them, beside the manual's one, which takes 10.3 % of its processor."""
    floor = Floor(NODES, BUSES)
    floor.start()
    idle = Kernel()
    nothing_much(idle)
    shares, least = [], []
    with asyncio.Runner(loop_factory=real_loop) as runner:
        for _ in range(min(rounds, 5)):
            least.append(runner.run(spell(idle)))
            floor.fill(4)
            shares.append(runner.run(spell(floor.kernel)))
            # At any instant but the few that are between two commands.
            assert floor.moving() > 0.95 * NODES, floor.moving()
    floor.check()
    share = statistics.median(shares)
    return Figure(
        f"{NODES} engines on {BUSES} buses at 33.3 kHz, live",
        100 * share,
        "% of a core",
        share / statistics.median(least),
        "762 empty events a second",
        10.3,
        "value, at most",
    )


def figures(rounds: int) -> list[Figure]:
    """Pulse times, positions, memory, engines."""
    return [*pulse_times(rounds), positions(rounds), *memory(), engines(rounds)]
