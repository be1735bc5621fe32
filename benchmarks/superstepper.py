"""How fast a Super Stepper Bus is: transactions, moves and their pulses, and memory of a module.

*Transactions.* One module is asked for its status again and again, in memory and in virtual time:
by the coroutines of ``SuperStepper``, and by the lines that scenarios send. The baseline is what an
event queue must do at least: some five events a transaction, as on a SAC's bus.

*Moves.* 32 modules, all that a bus can have, each with a move of about a second after the other, up
to 10 000 microsteps a second, on, and down; the line is left out, since it carries a hundred
messages a second. A move takes a second, so as many as are done in one second of processor time may
move at once, with a command each a second. Beside it an event that does nothing a move.

*Pulse times.* The same moves, each planned and asked for all its pulse times as one array, beside
``numpy.cumsum`` over as many periods, the least that any method must do.

*Memory.* Of 32 modules that are alike, at rest and in motion.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle, islice

import numpy as np

from benchmarks.figure import Figure, alternate
from benchmarks.kernel import EVENTS, bare_heap
from nodes.superstepper import KIND, SuperStepperNode, SuperStepperSettings
from nodes.superstepper.course import Course
from nodes.superstepper.plan import Profile, steps_plan
from nodes.superstepper.ramp import Pace
from sacbus import open_bus
from sacbus.bus import Bus, Port
from sacbus.configuration import Configuration
from sacbus.host import run_virtual
from sacbus.kernel import SECOND, Kernel
from sacbus.mother.masters import Came
from sacbus.mother.superstepper import SuperStepper
from sacbus.mother.superstepper_master import SUPER_STEPPER_MASTER
from sacbus.wire.superstepper import Microsteps, MoveSteps

TRANSACTIONS = 2_000
MODULES = 32
#: Moves of each module in a round.
MOVES = 20

#: Half a period, in ticks of 250 ns: 10 000 microsteps a second; and where ramps begin.
SPEED = 200
START = 2_000
#: 100 less each millisecond: 19 ms up, and as much down.
RATE, TIME_BASE = 100, 0
SETTINGS = SuperStepperSettings(rate=RATE, time_base=TIME_BASE, starting_speed=START)


def moves(count: int) -> Iterator[MoveSteps]:
    """Moves of a second, one way and the other, no two running alike."""
    steps = cycle(range(9_700, 9_800, 7))
    return (MoveSteps(number % 2 == 0, SPEED + number % 5, next(steps)) for number in range(count))


class Table:
    """A bus with modules in eighth steps, full unless said otherwise."""

    def __init__(self, modules: int = MODULES) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, KIND.protocol)
        self.modules = [
            KIND.create(address, SETTINGS, self.bus.rate, self.bus.tell)
            for address in range(modules)
        ]
        for one in self.modules:
            self.bus.add(one)
            self.execute(one, Microsteps(3))

    def execute(self, module: SuperStepperNode, message: Microsteps | MoveSteps) -> None:
        """What a module does with a message that has come, without its way there."""
        module.now = self.kernel.now
        module.message(message, self.kernel.now)
        module.look(self.kernel.now)
        self.bus.touch(module)

    def move(self, orders: Sequence[MoveSteps]) -> None:
        """Each module makes each of these moves, spread over a second."""
        for order in orders:
            for module in self.modules:
                self.execute(module, order)
                self.kernel.run_until(self.kernel.now + SECOND // MODULES)
            self.kernel.run_until(self.kernel.now + SECOND // 10)
        self.kernel.run_until(self.kernel.now + SECOND)
        assert not self.bus.report_counts, self.bus.report_counts


def transactions(rounds: int) -> list[Figure]:
    """By coroutines, and in words."""

    async def scene() -> None:
        async with open_bus(Configuration(nodes=(3,), kind="ss-mst67")) as bus:
            master = SuperStepper.on(bus)
            for _ in range(TRANSACTIONS):
                await master.status(3)

    found = []
    names = {
        "transactions in memory, virtual time": lambda: run_virtual(Kernel(), scene()),
        "the same in words, as scenarios send them": in_words,
    }
    for name, act in names.items():
        act()
        took, baseline = alternate(act, bare_heap, rounds)
        rate = TRANSACTIONS / took
        found.append(
            Figure(
                name,
                rate,
                "/s",
                rate / (EVENTS / 5 / baseline),
                "5 bare heap events a transaction",
            )
        )
    return found


def in_words() -> None:
    """Lines, each asked when the one before it is answered."""
    table = Table(1)
    port = Port(table.bus.medium, lambda heard, _now: master.hear(heard.data), latency=0)
    master = SUPER_STEPPER_MASTER.create(
        table.kernel,
        lambda data, _ninth: port.talk(data),
        table.bus.rate,
        unsent=lambda: port.unsent,
    )
    left = TRANSACTIONS

    def done(came: Came) -> None:
        nonlocal left
        assert came.words == "at rest", came
        left -= 1
        if left:
            master.ask("0 status", done)

    master.ask("0 status", done)
    while left:
        table.kernel.run_next()


def moving(rounds: int) -> Figure:
    """Moves from command to rest."""
    orders = list(moves(MOVES))
    count = MODULES * MOVES
    steps = sum(order.steps for order in orders)

    def act() -> None:
        table = Table()
        table.move(orders)
        for module in table.modules:
            assert module.state(table.kernel.now) == "STANDBY"
            assert module.commands.engine.steps(table.kernel.now) == steps

    def baseline() -> None:
        kernel = Kernel()
        for number in range(count):
            kernel.at(number, _nothing)
        kernel.run_until(count)

    act()
    took, least = alternate(act, baseline, rounds)
    return Figure(
        "modules that move, with a command a second",
        count / took,
        "modules",
        took / least,
        "an event that does nothing a move",
    )


def pulses(rounds: int) -> Figure:
    """All pulse times of moves, each planned anew."""
    profile = Profile(START, Pace.of(RATE, TIME_BASE))
    orders = list(islice(moves(100), 30))

    def act() -> int:
        made = 0
        for order in orders:
            sign = 1 if order.clockwise else -1
            plan = steps_plan(None, order.speed, order.rate.divider, sign, profile, order.steps)
            course = Course(plan)
            assert course.duration is not None
            made += course.step_times(0, course.duration).size
        return made

    count = act()
    assert count == sum(order.steps for order in orders)
    periods = np.full(count, 2 * SPEED, dtype=np.int64)
    took, least = alternate(act, partial(np.cumsum, periods), rounds)
    return Figure(
        "pulse times of moves with two ramps",
        count / took / 1e6,
        "M pulses/s",
        least / took,
        f"cumsum of {count:,} periods",
    )


def memory() -> Figure:
    """What a module takes that moves; what all share, as their ramps, is not counted."""
    order = next(moves(1))
    Table().move([order])
    tracemalloc.start()
    began = tracemalloc.get_traced_memory()[0]
    table = Table()
    still = tracemalloc.get_traced_memory()[0] - began
    for module in table.modules:
        table.execute(module, order)
    table.kernel.run_until(table.kernel.now + SECOND // 2)
    taken = tracemalloc.get_traced_memory()[0] - began
    tracemalloc.stop()
    assert all(one.state(table.kernel.now) == "CRUISE" for one in table.modules)
    return Figure(
        "memory of a module that moves",
        taken / MODULES,
        "bytes",
        taken / still,
        "one that stands",
        4_096.0,
        "value, at most",
    )


def _nothing() -> None:
    """What an event does that does nothing."""


def figures(rounds: int) -> list[Figure]:
    """Transactions, moves, pulse times, memory."""
    return [*transactions(rounds), moving(rounds), pulses(rounds), memory()]
