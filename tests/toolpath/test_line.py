"""Straight lines from rest to rest: together at the end, near the line on the way."""

from __future__ import annotations

from math import pi
from random import Random

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sacbus.motion import Drive
from sacbus.toolpath import Axis, Block, Machine, Pulses, plan_line
from tests.toolpath.lines import Line, random_line

LINES = 200


def line_of(seed: int) -> Line:
    return random_line(Random(seed))


def last_periods(machine: Machine, line: Block) -> list[int]:
    """Ticks of the last pulse of each axis."""
    return [Pulses(machine.axes[run.axis], run).profiles[-1].last_period for run in line.runs]


def ends_apart(line: Block) -> int:
    ends = [run.end for run in line.runs]
    return max(ends) - min(ends)


@pytest.mark.slow
def test_of_random_lines_99_in_100_stay_within_a_step_and_the_rest_say_why() -> None:
    # `python -m benchmarks lines` plans more of them.
    far: list[str] = []
    for seed in range(LINES):
        line = line_of(seed)
        block = plan_line(line.machine, line.steps, line.feed)
        assert ends_apart(block) <= max(last_periods(line.machine, block))
        if block.deviation.steps > 1:
            assert block.deviation.reason
            far.append(block.deviation.reason)
        else:
            assert not block.deviation.reason
    assert len(far) <= LINES / 100, far


@pytest.mark.parametrize(
    ("steps", "feed", "told"),
    [
        ((1,), 60.0, "steps of a line: expected 2, one for each axis, got 1"),
        ((1, 2.5), 60.0, "steps of Y: expected a whole number up to 100000000, got 2.5"),
        ((10**9, 1), 60.0, "steps of X: expected a whole number up to 100000000, got 1000000000"),
        ((1, 2), 0.0, "feed of a line: expected mm/min above 0, got 0.0"),
        ((1, 2), float("nan"), "feed of a line: expected mm/min above 0, got nan"),
    ],
)
def test_what_is_no_line_is_refused(steps: tuple[int, ...], feed: float, told: str) -> None:
    machine = Machine((Axis("X", 10, 100), Axis("Y", 11, 100)))
    with pytest.raises(ValueError, match=f"^{told}$"):
        plan_line(machine, steps, feed)


seeds = st.integers(0, 2**32)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(seeds)
def test_every_axis_gets_where_it_should_and_is_asked_nothing_it_cannot(seed: int) -> None:
    machine, steps, feed = line_of(seed)
    block = plan_line(machine, steps, feed)
    assert [run.axis for run in block.runs] == [at for at, count in enumerate(steps) if count]
    assert block.duration == max(run.end for run in block.runs)
    for run in block.runs:
        axis, count = machine.axes[run.axis], steps[run.axis]
        pulses = Pulses(axis, run)
        assert run.steps == count
        assert pulses.place_at(run.end) == count
        assert pulses.count == abs(count) * axis.drive.m
        assert run.motions[0].sync
        assert not any(motion.sync for motion in run.motions[1:])
        assert len(run.motions) <= 29
        for motion, profile in zip(run.motions, pulses.profiles, strict=True):
            assert motion.cw is ((count > 0) is not axis.inverted)
            assert not profile.shares.truncated
            assert motion.rpm <= axis.max_rpm
            for asked in (motion.acc100, motion.dec100):
                assert asked <= machine.acceleration * 100 + 1e-6 or asked >= 99_800
            # Nothing turns faster from rest than at its slow speed, but on a ramp.
            if motion.acc100 >= 99_800 and not profile.start_rpm:
                assert motion.rpm <= axis.drive.slow or motion.rpm**2 < 1_000 * machine.acceleration
        assert pulses.profiles[-1].kept_rpm == 0


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.integers(-9, 9), min_size=2, max_size=3).filter(any),
    st.floats(1, 1e5),
    st.sampled_from([0, 1, 4]),
)
@example([1, 1], 1.0, 0)
@example([1, 9, -9], 1e5, 0)
def test_the_shortest_of_lines_are_lines_too(steps: list[int], feed: float, u: int) -> None:
    axes = tuple(Axis(name, 10, 100.0, drive=Drive(ustep=u)) for name in "XYZ"[: len(steps)])
    machine = Machine(axes)
    block = plan_line(machine, steps, feed)
    assert [run.steps for run in block.runs] == [count for count in steps if count]
    assert ends_apart(block) <= max(last_periods(machine, block))
    assert block.deviation.steps <= 1.2


def two(max_rpm: int = 300, max_acceleration: float | None = None) -> Machine:
    y = Axis("Y", 11, 100.0, max_rpm=max_rpm, max_acceleration=max_acceleration)
    return Machine((Axis("X", 10, 100.0), y))


def test_the_manuals_move_takes_a_command_an_axis() -> None:
    # Manual, "SAC in a multi-axis environment": a transit of (240, 200).
    block = plan_line(two(), (240, 200), 600)
    x, y = (run.motions for run in block.runs)
    assert (len(x), len(y)) == (1, 1)
    assert y[0].cycle_us / x[0].cycle_us == pytest.approx(6 / 5, rel=1e-3)
    assert y[0].acc100 / x[0].acc100 == pytest.approx(5 / 6, rel=0.02)
    assert block.deviation.steps < 0.75
    assert block.length == pytest.approx(3.124, abs=1e-3)
    assert block.lowered_by == "the line is too short for its acceleration"


def test_a_cruise_that_no_cycle_fits_is_split_at_two_neighbours() -> None:
    # 10 000 and 7 001 steps: at whole cycles of X those of Y are not whole.
    block = plan_line(two(), (10_000, 7_001), 300)
    cycles = {motion.cycle_us for motion in block.runs[1].motions}
    assert len(cycles) == 2
    assert max(cycles) - min(cycles) == 1
    assert block.deviation.steps < 1


def test_feed_is_shared_out_along_the_line() -> None:
    block = plan_line(two(), (3_000, 4_000), 300)
    # 5 mm/s along the line are 3 and 4 of the axes: 300 and 400 steps/s.
    x, y = (run.motions[0] for run in block.runs)
    assert x.cycle_us == pytest.approx(1e6 / 300, abs=4)
    assert y.cycle_us == pytest.approx(1e6 / 400, abs=4)
    assert block.lowered == pytest.approx(0, abs=1e-3)
    assert block.asked == pytest.approx(10)


def test_an_axis_that_cannot_go_so_fast_slows_all_down() -> None:
    block = plan_line(two(max_rpm=60), (4_000, 4_000), 6_000)
    assert block.lowered_by == "Y makes 200 steps/s at most"
    assert block.lowered == pytest.approx(1 - 200 * 2**0.5 / 100 / 100, abs=1e-3)
    assert max(motion.rpm for run in block.runs for motion in run.motions) <= 60


def test_pulses_of_a_ramp_are_no_quicker_than_the_device_computes_them() -> None:
    # Manual, "Discussion": 52 us a step of a linear ramp; at 128 microsteps that is 45 RPM.
    machine = Machine((Axis("X", 10, 100.0, drive=Drive(ustep=7)),))
    block = plan_line(machine, (4_000,), 6_000)
    assert block.lowered_by == "X makes 150 steps/s at most"
    (run,) = block.runs
    shortest = min(
        profile.time_of(at + 1) - profile.time_of(at)
        for profile in Pulses(machine.axes[0], run).profiles
        for at in range(0, profile.pulses or 0, 97)
    )
    assert shortest >= 104


def test_an_axis_that_bears_less_acceleration_makes_all_gentler() -> None:
    block = plan_line(two(max_acceleration=10.0), (4_000, 4_000), 3_000)
    for run in block.runs:
        for motion in run.motions:
            assert min(motion.acc100, motion.dec100) <= 1_000


def test_a_slow_axis_follows_by_pieces_the_ramps_of_a_fast_one() -> None:
    block = plan_line(two(), (8_000, 200), 4_000)
    _, y = block.runs
    assert len(y.motions) > 2
    assert all(motion.rpm <= 10 for motion in y.motions)
    assert all(motion.acc100 == 99_900 for motion in y.motions)
    assert block.deviation.steps < 1


def test_a_feed_of_none_is_the_rapid_rate_and_lines_are_told() -> None:
    block = plan_line(two(), (4_000, 0), None, 17)
    assert block == plan_line(two(), (4_000, 0), 600, 17)
    assert block.lines == (17, 17)


def test_a_line_to_nowhere_is_refused() -> None:
    with pytest.raises(ValueError, match="needs an axis that moves"):
        plan_line(two(), (0, 0), 300)


def test_the_time_is_that_of_a_trapezoid() -> None:
    machine = Machine((Axis("X", 10, 100.0),), acceleration=50.0)
    block = plan_line(machine, (10_000,), 600)
    speed, acceleration = 1_000.0, 50 * 200 / (2 * pi)
    assert block.duration / 2e6 == pytest.approx(10_000 / speed + speed / acceleration, rel=0.01)


def test_a_line_that_is_a_step_off_is_tried_at_lower_accelerations() -> None:
    # Full steps, three axes, as fast as it can: the hardest there is.
    machine = Machine(tuple(Axis(name, 10, 50.0) for name in "XYZ"), acceleration=50.0)
    block = plan_line(machine, (-1_700, -504, -241), 1e9)
    assert 0.9 < block.deviation.steps < 1.05
    assert bool(block.deviation.reason) == (block.deviation.steps > 1)
    assert max(motion.acc100 for run in block.runs for motion in run.motions[:1]) < 4_900
