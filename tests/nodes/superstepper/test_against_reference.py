"""The analytic motion against a motor that makes one step after the other."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nodes.superstepper.engine import NS_PER_TICK
from nodes.superstepper.ramp import Pace, Ramp
from sacbus.wire.superstepper import ChangeSpeed, MoveAtSpeed, MoveSteps, Rate, Stop
from tests.nodes.superstepper.bench import Bench
from tests.nodes.superstepper.reference import SlowMotor, ramp

_RATES = st.sampled_from([Rate.FAST, Rate.FAST, Rate.MEDIUM])
_SPEEDS = st.integers(2_000, 40_000) | st.sampled_from([0, 65_535])
_COMMANDS = (
    st.builds(MoveAtSpeed, st.booleans(), _SPEEDS, _RATES, st.booleans())
    | st.builds(MoveSteps, st.booleans(), _SPEEDS, st.integers(0, 120), _RATES)
    | st.builds(ChangeSpeed, _SPEEDS)
    | st.builds(Stop, st.booleans(), st.booleans())
)


@given(
    commands=st.lists(st.tuples(_COMMANDS, st.integers(0, 1_500_000)), min_size=1, max_size=7),
    start=st.sampled_from([32_000, 20_000, 4_000]),
    rate=st.sampled_from([0, 97, 1_000, 30_000]),
    time_base=st.sampled_from([0, 10, 60]),
)
@example(
    # Too fast to come down from within the steps of a faster move.
    commands=[
        (MoveAtSpeed(True, 10_000), 1_500_000 * 3),
        (MoveSteps(True, 5_000, 3), 900_000),
        (MoveSteps(True, 5_000, 120), 900_000),
    ],
    start=32_000,
    rate=256,
    time_base=10,
)
@settings(max_examples=120)
def test_it_moves_as_a_motor_that_makes_step_after_step(
    commands: list[tuple[MoveAtSpeed | MoveSteps | ChangeSpeed | Stop, int]],
    start: int,
    rate: int,
    time_base: int,
) -> None:
    bench = Bench(3, rate=rate, time_base=time_base, starting_speed=start)
    slow = SlowMotor(start=start, rate=rate, beat=(time_base + 1) * 4_000)
    told: list[int] = []
    tick = 0
    for command, wait in commands:
        bench.execute(command)
        slow.command(command, tick)
        for part in (1, 2, 3):
            at = tick + wait * part // 3
            bench.kernel.run_until(at * NS_PER_TICK)
            slow.run(at)
            told.append(bench.node.snapshot(bench.now).position_pulses)
            assert told[-1] == slow.position(at)
            assert bench.node.commands.engine.steps(bench.now) == len(slow.steps)
        tick += wait


@given(
    slow=st.integers(1, 65_536),
    fast=st.integers(1, 65_536),
    rate=st.integers(50, 70_000) | st.just(0),
    beat=st.integers(1, 256).map(lambda ms: 4_000 * ms),
    divider=st.sampled_from([1, 8, 64]),
)
@settings(max_examples=100)
def test_a_ramp_is_its_periods_one_by_one(
    slow: int, fast: int, rate: int, beat: int, divider: int
) -> None:
    values = ramp(slow, fast, rate, beat, divider)
    made = Ramp(slow, fast, Pace(rate, beat), divider)
    assert made.periods == len(values)
    tick = 0
    for number, value in enumerate(values[:200]):
        assert (made.begin(number), made.value(number)) == (tick, value)
        assert made.number_at(tick) == made.number_at(tick + 2 * divider * value - 1) == number
        assert made.begun_before(tick) == number
        tick += 2 * divider * value
    assert made.duration == sum(2 * divider * value for value in values)
    assert made.begin(made.periods) == made.duration
    assert made.value(made.periods) == fast
    assert made.begun_before(made.duration + 1) == made.periods


def test_a_motor_accelerates_from_32_000_to_10_000_by_rate_and_time_base() -> None:
    """The manual's own example, step by step: 256 less every 11 ms, from the command on."""
    bench = Bench(3)
    at = bench.execute(MoveAtSpeed(True, 10_000))
    slow = SlowMotor(start=32_000, rate=0x0100, beat=11 * 4_000)
    slow.command(MoveAtSpeed(True, 10_000), 0)
    slow.run(5_000_000)
    course = bench.node.commands.engine.course
    assert course is not None
    ticks = [tick for tick, _ in slow.steps]
    assert ticks[:3] == [32_000, 95_744, 158_976]
    assert [course.time_of(number) for number in range(len(ticks))] == ticks
    assert course.step_times(0, 5_000_001).tolist() == ticks
    # 86 beats bring it to 10 000: from then on all steps are 5 ms apart.
    assert at == 0
    assert {late - early for early, late in zip(ticks[-20:], ticks[-19:], strict=False)} == {20_000}
    assert bench.node.commands.engine.state(86 * 11_000_000 - 20_000_000) == "ACCEL"
    assert bench.node.commands.engine.state(86 * 11_000_000 + 20_000_000) == "CRUISE"


@pytest.mark.parametrize("steps", [1, 2, 3, 40, 41, 200])
def test_steps_end_on_the_last_one_and_mirror_the_way_up(steps: int) -> None:
    bench = Bench(3)
    bench.execute(MoveSteps(True, 10_000, steps))
    course = bench.node.commands.engine.course
    assert course is not None
    assert course.steps == steps
    ticks = course.step_times(0, 1 << 40).tolist()
    gaps = [late - early for early, late in pairwise(ticks)]
    assert gaps == gaps[::-1]


def test_there_are_no_steps_before_the_first_and_behind_the_last() -> None:
    bench = Bench(3)
    bench.execute(MoveSteps(True, 10_000, 3))
    course = bench.node.commands.engine.course
    assert course is not None
    for wrong in (-1, 3):
        with pytest.raises(IndexError, match=f"no step {wrong} in a course of 3"):
            course.time_of(wrong)
